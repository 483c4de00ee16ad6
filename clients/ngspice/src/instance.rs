//! One `A` device: asks its [`Device`] what ngspice's calls ask, and decides what becomes of an answer that is none.
//!
//! Nothing here knows ngspice's memory; `crate::call` copies between the two. State that must follow accepted and
//! rejected steps lives in a [`History`], which the host rolls back; what stays here is only a cache or a count.

use crate::companion::{Companion, shortest};
use crate::history::{Base, History};
use crate::settings::Monitor;
use bimorph::device::{
    Description, Device, DeviceError, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply,
};

/// How often in a row a step or an operating point may fail before the analysis ends. Each attempt of a transient is
/// eight times shorter than the one before it.
const ATTEMPTS: u32 = 4;
/// A step that fails although it is shorter than this share of the longest one taken is hopeless, too [1]: the steps
/// are creeping up to a point beyond which there is no answer.
const HOPELESS: f64 = 1e-4;

/// What ngspice asks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Question {
    /// Operating point or sweep: equilibrium.
    Static,
    /// A step of `dt` [s] that ends at `t` [s].
    Transient {
        /// End of the step [s].
        t: f64,
        /// Length [s], positive.
        dt: f64,
    },
    /// Small-signal answer at `omega` [rad/s].
    SmallSignal {
        /// Angular frequency [rad/s].
        omega: f64,
    },
}

/// What becomes of a question.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// [`Instance::answer`] or [`Instance::gains`] holds.
    Solved,
    /// No answer for this step: ngspice shall try a shorter one, or another way to the operating point.
    Retry,
    /// The analysis must end; the text says why.
    Stop(String),
}

/// Currents, conductances and monitors as ngspice wants them. p ports, s monitors; matrices row-major.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Answer {
    /// State reached.
    pub token: Option<Token>,
    /// Step that led to it [s]; 0 for equilibrium.
    pub step: f64,
    /// Current into each port [A] (p).
    pub currents: Vec<f64>,
    /// ∂current/∂voltage [S] (p×p).
    pub conductances: Vec<f64>,
    /// Charges [C] (p).
    pub charges: Vec<f64>,
    /// What the next step's charges will be differentiated from, if this point is accepted.
    pub base: Base,
    /// Scaled monitors [V] (s).
    pub monitors: Vec<f64>,
    /// ∂monitor/∂voltage [1] (s×p).
    pub monitor_gains: Vec<f64>,
}

/// One device in a circuit.
pub struct Instance {
    name: String,
    device: Box<dyn Device>,
    monitors: Vec<Monitor>,
    description: Description,
    reply: TrialReply,
    answer: Answer,
    small: SmallSignal,
    small_key: Option<(Token, u64)>,
    accepted: Option<Token>,
    step_bound: f64,
    failures: u32,
    longest: f64,
}

impl Instance {
    /// Opens `device` for an instance of `ports` ports. An empty `names` stands for every port of the netlist.
    ///
    /// # Errors
    /// What the device refuses, or a wrong number of ports.
    pub fn open(
        name: &str,
        mut device: Box<dyn Device>,
        names: &[String],
        ports: usize,
        monitors: &[Monitor],
    ) -> Result<Self, DeviceError> {
        let signals = monitors.iter().map(|m| m.signal.clone()).collect();
        let description = device.open(&OpenRequest { ports: names.to_vec(), signals })?;
        if description.ports.len() != ports {
            let names: Vec<_> = description.ports.iter().map(|p| p.name.as_str()).collect();
            return Err(DeviceError::BadRequest {
                what: "ports",
                expected: format!("{} node pairs for the ports {names:?}", names.len()),
                got: ports.to_string(),
            });
        }
        Ok(Self {
            name: name.to_owned(),
            device,
            monitors: monitors.to_vec(),
            description,
            reply: TrialReply::default(),
            answer: Answer::default(),
            small: SmallSignal::default(),
            small_key: None,
            accepted: None,
            step_bound: f64::INFINITY,
            failures: 0,
            longest: 0.0,
        })
    }

    /// Name in the deck.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What was opened.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The last answer to a static or transient question.
    pub fn answer(&self) -> &Answer {
        &self.answer
    }

    /// The last small-signal answer, monitors unscaled.
    pub fn small_signal(&self) -> &SmallSignal {
        &self.small
    }

    /// Scale of each monitor [V per unit].
    pub fn monitors(&self) -> &[Monitor] {
        &self.monitors
    }

    /// Longest next step the device is likely to bear [s].
    pub fn step_bound(&self) -> f64 {
        self.step_bound
    }

    /// Asks the device. `previous` is the last accepted point; for a small signal, the operating point.
    pub fn ask(&mut self, question: Question, voltages: &[f64], previous: &History) -> Outcome {
        match question {
            Question::Static => {
                let outcome = self.trial(Mode::Static, 0.0, 0.0, voltages, previous.token);
                self.finish(outcome, None, previous)
            }
            Question::Transient { t, dt } => {
                let outcome = self.trial(Mode::Transient, t, dt, voltages, previous.token);
                self.finish(outcome, Some((t, dt)), previous)
            }
            Question::SmallSignal { omega } => self.linearize(omega, previous.token),
        }
    }

    /// Tells the device that the circuit accepted its last state.
    pub fn accept(&mut self) {
        if let Some(token) = self.answer.token.filter(|t| self.accepted != Some(*t)) {
            self.device.accept(token);
            self.accepted = Some(token);
        }
    }

    /// Moves the charges of the last transient answer along their derivatives by `volts` [V], and with them what the next
    /// step is differentiated from. False where there is nothing to move.
    pub fn settle(&mut self, volts: &[f64]) -> bool {
        let (answer, dq_dv, ports) = (&mut self.answer, &self.reply.dq_dv, volts.len());
        if answer.step == 0.0 || answer.base.skipped != 0.0 || answer.charges.len() != ports {
            return false;
        }
        for (n, row) in dq_dv.chunks_exact(ports.max(1)).enumerate() {
            answer.charges[n] += row.iter().zip(volts).map(|(c, v)| c * v).sum::<f64>();
        }
        answer.base.charges.clone_from(&answer.charges);
        true
    }

    fn trial(
        &mut self,
        mode: Mode,
        t: f64,
        dt: f64,
        voltages: &[f64],
        parent: Option<Token>,
    ) -> Result<(), DeviceError> {
        let request = Trial { mode, parent, t, dt, voltages };
        match self.device.trial(&request, &mut self.reply) {
            // A sweep's parent is a hint about the branch; equilibrium can be found without.
            Err(DeviceError::UnknownToken(_)) if mode == Mode::Static => {
                self.device.trial(&Trial { parent: None, ..request }, &mut self.reply)
            }
            result => result,
        }
    }

    fn finish(&mut self, result: Result<(), DeviceError>, time: Option<(f64, f64)>, previous: &History) -> Outcome {
        if let Err(error) = result {
            return Outcome::Stop(error.to_string());
        }
        let step = time.map_or(0.0, |(_, dt)| dt);
        let why = match &self.reply.status {
            Status::Ok => {
                self.failures = 0;
                self.longest = self.longest.max(step);
                self.step_bound = if time.is_some() { self.reply.dt_next } else { f64::INFINITY };
                self.fill(time, previous);
                return Outcome::Solved;
            }
            // The host shortens the step and asks again, by as much as it takes.
            Status::NeedDt(_) if step > HOPELESS * self.longest => return Outcome::Retry,
            Status::NeedDt(bound) => {
                format!("the model needs steps below {bound:e} s, and even {step:e} s is too long")
            }
            Status::Fail(why) => why.clone(),
        };
        self.failures += 1;
        let hopeless = time.is_some() && step <= HOPELESS * self.longest;
        if self.failures < ATTEMPTS && !hopeless { Outcome::Retry } else { Outcome::Stop(why) }
    }

    /// Turns the reply into what ngspice wants; charges into currents where time passes.
    fn fill(&mut self, time: Option<(f64, f64)>, previous: &History) {
        let (reply, answer) = (&self.reply, &mut self.answer);
        let ports = reply.charges.len();
        answer.token = reply.token;
        answer.step = time.map_or(0.0, |(_, dt)| dt);
        answer.charges.clone_from(&reply.charges);
        answer.currents.clone_from(&reply.currents);
        answer.conductances.clone_from(&reply.di_dv);
        answer.base.clone_from(&previous.base);
        let (base, old) = (&mut answer.base, &previous.base);
        if let Some((t, dt)) = time {
            let step = dt + old.skipped;
            let (resolved, shortest) = (step >= shortest(t), shortest(t));
            let companion = if resolved { Companion::new(step, old.step) } else { Companion::unresolved(shortest) };
            for (n, current) in answer.currents.iter_mut().enumerate() {
                let (q, q1, q2) = (reply.charges[n], old.charges[n], old.charges_before[n]);
                *current += if resolved {
                    companion.current(q, q1, q2)
                } else {
                    let so_far = if old.step > 0.0 { (q1 - q2) / old.step } else { 0.0 };
                    so_far + companion.slope * (q - q1 - so_far * step)
                };
            }
            for (g, c) in answer.conductances.iter_mut().zip(&reply.dq_dv) {
                *g += companion.slope * c;
            }
            if resolved {
                (base.step, base.skipped) = (step, 0.0);
                base.charges_before.clone_from(&old.charges);
                base.charges.clone_from(&reply.charges);
            } else {
                base.skipped = step;
            }
        } else {
            (base.step, base.skipped) = (0.0, 0.0);
            base.charges_before.clone_from(&reply.charges);
            base.charges.clone_from(&reply.charges);
        }
        answer.monitors.clear();
        answer.monitor_gains.clear();
        for (s, monitor) in self.monitors.iter().enumerate() {
            answer.monitors.push(monitor.scale * reply.outputs[s]);
            let row = &reply.doutputs_dv[s * ports..(s + 1) * ports];
            answer.monitor_gains.extend(row.iter().map(|d| monitor.scale * d));
        }
    }

    fn linearize(&mut self, omega: f64, token: Option<Token>) -> Outcome {
        let Some(token) = token else {
            return Outcome::Stop("a small-signal analysis needs an operating point first".into());
        };
        if self.small_key == Some((token, omega.to_bits())) {
            return Outcome::Solved;
        }
        self.small_key = None;
        match self.device.linearize(token, omega, &mut self.small) {
            Ok(()) => {
                self.small_key = Some((token, omega.to_bits()));
                Outcome::Solved
            }
            Err(error) => Outcome::Stop(error.to_string()),
        }
    }
}
