//! One `A` device: maps ngspice's calls to requests of its [`Device`], and decides the treatment of failed evaluations.
//!
//! Nothing here knows ngspice's memory; `crate::call` copies between the two. State that must follow accepted and
//! rejected steps is in a [`History`], which the host rolls back; the rest here is only a cache or a count.

use crate::alternation::Alternation;
use crate::companion::DifferentiationRule;
use crate::evaluation::{Evaluation, EvaluationOutcome, EvaluationRequest};
use crate::failed_evaluations::FailedEvaluations;
use crate::history::History;
use crate::settings::{Monitor, PortName};
use bimorph::device::scale::PortScale;
use bimorph::device::{
    Agitation, Description, Device, DeviceError, Mode, OpenRequest, PortKind, SmallSignal, Status, Token, Trial,
    TrialReply,
};
use bimorph::netlist::Diagnostic;

/// One device in a circuit.
pub struct Instance {
    name: String,
    pub(crate) device: Box<dyn Device>,
    pub(crate) monitors: Vec<Monitor>,
    description: Description,
    /// Of each port.
    pub(crate) scales: Vec<PortScale>,
    /// Input of each port, in its own unit.
    pub(crate) given: Vec<f64>,
    pub(crate) reply: TrialReply,
    answer: Evaluation,
    small: SmallSignal,
    small_key: Option<(Token, u64)>,
    accepted: Option<Token>,
    /// The last equilibrium whose warnings were read.
    warned: Option<Token>,
    step_bound: f64,
    refusals: FailedEvaluations,
    alternation: Alternation,
    pub(crate) counts: InstanceCounters,
}

/// Counters of an instance's evaluations since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct InstanceCounters {
    /// Points that the circuit accepted.
    pub(crate) points: u64,
    /// Evaluations of currents.
    pub(crate) trials: u64,
    /// Those without an answer.
    pub(crate) refused: u64,
}

impl Instance {
    /// Opens `device` for an instance. `branches` is true for each port with a current as its input (`%hd`). No `names`
    /// stand for every port of the netlist.
    ///
    /// # Errors
    /// Errors of the device, a wrong number of ports, or a connection that does not suit a port.
    pub fn open(
        name: &str,
        mut device: Box<dyn Device>,
        (names, branches): (&[PortName], &[bool]),
        monitors: &[Monitor],
        noise: Option<Agitation>,
    ) -> Result<Self, DeviceError> {
        if let Some(monitor) = monitors.iter().find(|m| m.scale == 0.0 || !m.scale.is_finite()) {
            return Err(DeviceError::BadRequest {
                what: "monitors",
                expected: format!(
                    "a finite scale of \"{}\" that is not 0: it would show 0 V for anything",
                    monitor.signal
                ),
                got: monitor.scale.to_string(),
            });
        }
        let signals = monitors.iter().map(|m| m.signal.clone()).collect();
        let description =
            device.open(&OpenRequest { ports: names.iter().map(|p| p.name.clone()).collect(), signals, noise })?;
        if description.ports.len() != branches.len() {
            let names: Vec<_> = description.ports.iter().map(|p| p.name.as_str()).collect();
            return Err(DeviceError::BadRequest {
                what: "ports",
                expected: format!("{} node pairs for the ports {names:?}", names.len()),
                got: branches.len().to_string(),
            });
        }
        let mut scales = Vec::with_capacity(branches.len());
        for (n, (port, &branch)) in description.ports.iter().zip(branches).enumerate() {
            if port.kind.given_flow() != branch {
                let (right, wrong) = if branch { ("%gd", "%hd") } else { ("%hd", "%gd") };
                return Err(DeviceError::BadRequest {
                    what: "ports",
                    expected: format!(
                        "{right} before the nodes of \"{}\", a port of {}",
                        port.name,
                        port.kind.given().0
                    ),
                    got: wrong.into(),
                });
            }
            let across = names.get(n).and_then(|p| p.scale);
            if across.is_some_and(|scale| port.kind == PortKind::Electrical || scale == 0.0) {
                return Err(DeviceError::BadRequest {
                    what: "ports",
                    expected: format!(
                        "\"{}\" without a scale, or one that is not 0 on a port of another kind",
                        port.name
                    ),
                    got: across.map_or(String::new(), |scale| format!("{}:{scale}", port.name)),
                });
            }
            scales.push(PortScale::new(port.kind, across));
        }
        Ok(Self {
            scales,
            given: Vec::new(),
            name: name.to_owned(),
            device,
            monitors: monitors.to_vec(),
            description,
            reply: TrialReply::default(),
            answer: Evaluation::default(),
            small: SmallSignal::default(),
            small_key: None,
            accepted: None,
            warned: None,
            step_bound: f64::INFINITY,
            refusals: FailedEvaluations::default(),
            alternation: Alternation::default(),
            counts: InstanceCounters::default(),
        })
    }

    /// Name in the deck.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Description of the opened device.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The last static or transient evaluation.
    pub fn answer(&self) -> &Evaluation {
        &self.answer
    }

    /// Last small-signal admittances of port `row` over the ports.
    pub fn admittances(&self, row: usize) -> impl Iterator<Item = [f64; 2]> {
        let ports = self.scales.len();
        self.over_ports(self.scales[row].answered, &self.small.admittance[row * ports..(row + 1) * ports])
    }

    /// Last small-signal response of monitor `row`.
    pub fn monitor_responses(&self, row: usize) -> impl Iterator<Item = [f64; 2]> {
        let ports = self.scales.len();
        self.over_ports(self.monitors[row].scale, &self.small.outputs[row * ports..(row + 1) * ports])
    }

    fn over_ports(&self, answered: f64, row: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
        row.iter().zip(&self.scales).map(move |(part, scale)| part.map(|x| answered * x * scale.given))
    }

    /// Longest next step the device is likely to bear (s).
    pub fn step_bound(&self) -> f64 {
        self.step_bound
    }

    /// Asks the device. `previous` is the last accepted point; for a small signal, the operating point.
    pub fn ask(&mut self, question: EvaluationRequest, voltages: &[f64], previous: &History) -> EvaluationOutcome {
        let mut given = std::mem::take(&mut self.given);
        given.clear();
        given.extend(voltages.iter().zip(&self.scales).map(|(v, scale)| v * scale.given));
        let outcome = self.ask_given(question, &given, previous);
        self.given = given;
        outcome
    }

    fn ask_given(&mut self, question: EvaluationRequest, voltages: &[f64], previous: &History) -> EvaluationOutcome {
        match question {
            EvaluationRequest::Static => {
                let outcome = self.trial(Mode::Static, 0.0, 0.0, voltages, previous.token);
                self.finish(outcome, None, voltages, previous)
            }
            EvaluationRequest::Transient { t, dt, rule } => {
                let outcome = self.trial(Mode::Transient, t, dt, voltages, previous.token);
                self.finish(outcome, Some((rule, t, dt)), voltages, previous)
            }
            EvaluationRequest::SmallSignal { omega } => self.linearize(omega, previous.token),
        }
    }

    /// Accepts the device's last state for the circuit, and returns its warnings.
    pub fn accept(&mut self) -> Vec<Diagnostic> {
        let Some(token) = self.answer.token.filter(|t| self.accepted != Some(*t)) else { return Vec::new() };
        let mut warnings = self.device.warns(token);
        self.device.accept(token);
        self.accepted = Some(token);
        self.counts.points += 1;
        let names = self.description.ports.iter().map(|p| p.name.as_str());
        warnings.extend(self.alternation.accepted(self.answer.step, &self.answer.charges, &self.answer.base, names));
        warnings
    }

    /// Warnings about its last equilibrium, where the circuit has converged there, in a sweep or at an operating point.
    pub fn settled(&mut self, sweeping: bool) -> Vec<Diagnostic> {
        // a test of convergence comes again where another part has not settled
        let still = self.answer.token.filter(|_| self.answer.step == 0.0 && self.warned != self.answer.token);
        self.warned = still.or(self.warned);
        if sweeping {
            self.refusals.settled();
        }
        still.map_or_else(Vec::new, |token| self.device.warns(token))
    }

    /// Moves the charges of the last transient answer along their derivatives by `volts` (V), and with them what the next
    /// step is differentiated from. False where there is nothing to move.
    pub fn settle(&mut self, volts: &[f64]) -> bool {
        let (answer, dq_dv, ports) = (&mut self.answer, &self.reply.dq_dv, volts.len());
        if answer.step == 0.0 || answer.charges.len() != ports {
            return false;
        }
        for (n, row) in dq_dv.chunks_exact(ports.max(1)).enumerate() {
            let given = volts.iter().zip(&self.scales).map(|(v, scale)| v * scale.given);
            answer.charges[n] += row.iter().zip(given).map(|(c, v)| c * v).sum::<f64>();
        }
        answer.base.settle(&answer.charges, answer.slope);
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
        self.counts.trials += 1;
        match self.device.trial(&request, &mut self.reply) {
            // A sweep's parent is a hint about the branch; equilibrium can be found without.
            Err(DeviceError::UnknownToken(_)) if mode == Mode::Static => {
                self.device.trial(&Trial { parent: None, ..request }, &mut self.reply)
            }
            result => result,
        }
    }

    fn finish(
        &mut self,
        result: Result<(), DeviceError>,
        time: Option<(DifferentiationRule, f64, f64)>,
        given: &[f64],
        previous: &History,
    ) -> EvaluationOutcome {
        if let Err(error) = result {
            return EvaluationOutcome::Stop(error.to_string());
        }
        let step = time.map(|(.., dt)| dt);
        let why = match &self.reply.status {
            Status::Ok => {
                self.refusals.solved(step);
                self.step_bound = if time.is_some() { self.reply.dt_next } else { f64::INFINITY };
                self.fill(time, previous);
                return EvaluationOutcome::Solved;
            }
            // The host shortens the step and asks again, by as much as it takes.
            Status::NeedDt(_) if step.is_some_and(|step| self.refusals.may_shorten(step)) => {
                self.counts.refused += 1;
                return EvaluationOutcome::Retry;
            }
            Status::NeedDt(bound) => {
                format!("the model needs steps below {bound:e} s, and even {:e} s is too long", step.unwrap_or(0.0))
            }
            Status::Fail(why) if step.is_none() => self.unbalanced(given, why),
            Status::Fail(why) => why.clone(),
        };
        self.counts.refused += 1;
        if self.refusals.refused(step) { EvaluationOutcome::Stop(why) } else { EvaluationOutcome::Retry }
    }

    /// Why there is no equilibrium at what is given to the ports. A circuit without a path for direct current drives a port that
    /// conducts nothing to any voltage.
    fn unbalanced(&self, given: &[f64], why: &str) -> String {
        let ports = self.description.ports.iter().zip(given);
        let ports: Vec<String> = ports.map(|(p, x)| format!("{} = {x:.4e} {}", p.name, p.kind.given().1)).collect();
        let insulates = !self.answer.conductances.is_empty() && self.answer.conductances.iter().all(|g| *g == 0.0);
        let hint =
            if insulates { "; the ports conduct no direct current: does the circuit lead it to ground?" } else { "" };
        format!("no equilibrium at {}: {why}{hint}", ports.join(", "))
    }

    /// Converts the reply for ngspice; charges become currents in a transient.
    fn fill(&mut self, time: Option<(DifferentiationRule, f64, f64)>, previous: &History) {
        let (reply, answer) = (&self.reply, &mut self.answer);
        let ports = reply.charges.len();
        answer.take(reply, time, &previous.base);
        for (row, scale) in answer.conductances.chunks_exact_mut(ports.max(1)).zip(&self.scales) {
            row.iter_mut().zip(&self.scales).for_each(|(g, input)| *g *= scale.answered * input.given);
        }
        answer.currents.iter_mut().zip(&self.scales).for_each(|(current, scale)| *current *= scale.answered);
        answer.monitors.clear();
        answer.monitor_gains.clear();
        for (s, monitor) in self.monitors.iter().enumerate() {
            answer.monitors.push(monitor.scale * reply.outputs[s]);
            let row = &reply.doutputs_dv[s * ports..(s + 1) * ports];
            answer.monitor_gains.extend(row.iter().zip(&self.scales).map(|(d, port)| monitor.scale * d * port.given));
        }
    }

    fn linearize(&mut self, omega: f64, token: Option<Token>) -> EvaluationOutcome {
        let Some(token) = token else {
            return EvaluationOutcome::Stop("a small-signal analysis needs an operating point first".into());
        };
        if self.small_key == Some((token, omega.to_bits())) {
            return EvaluationOutcome::Solved;
        }
        self.small_key = None;
        match self.device.linearize(token, omega, &mut self.small) {
            Ok(()) => {
                self.small_key = Some((token, omega.to_bits()));
                EvaluationOutcome::Solved
            }
            Err(error) => EvaluationOutcome::Stop(error.to_string()),
        }
    }
}
