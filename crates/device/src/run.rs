//! Many steps of one device: each goes from the previous state to a time and port values, in as many pieces as the
//! device requires.
//!
//! The steps are those that a caller takes one by one, with the same arithmetic: a run has the same bits.

use super::{Description, Device, DeviceError, Mode, Status, Token, Trial, TrialReply};

/// A step that would have to be shorter than this fraction of itself has failed.
const SHORTEST: f64 = 1e-9;
/// After so many trials the state that the run began from is marked as in use: of a large model a device may hold no more than eight.
const PIECES: usize = 4;

/// A run of a device, between two of its steps.
#[derive(Debug)]
pub struct Run {
    start: Option<Token>,
    parent: Option<Token>,
    t: f64,
    given: Vec<f64>,
    between: Vec<f64>,
    last: TrialReply,
    reply: TrialReply,
    trials: usize,
}

/// Outcome of a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Stepped {
    /// It was taken.
    Taken,
    /// It has no answer, and the run stands where it stood; why.
    Failed(String),
}

impl Run {
    /// A run from the state `start` (none: the model at rest) at time `t` (s), where the ports have the values `given`.
    pub fn new(start: Option<Token>, t: f64, given: Vec<f64>) -> Self {
        Self {
            start,
            parent: start,
            t,
            between: given.clone(),
            given,
            last: TrialReply::default(),
            reply: TrialReply::default(),
            trials: 0,
        }
    }

    /// Time of the state that it has come to (s).
    pub fn t(&self) -> f64 {
        self.t
    }

    /// The reply to the last step taken; empty before any.
    pub fn last(&self) -> &TrialReply {
        &self.last
    }

    /// Trials so far.
    pub fn trials(&self) -> usize {
        self.trials
    }

    /// Steps to the time `t` (s), the ports going linearly to `given`.
    ///
    /// # Errors
    /// Those of [`Device::trial`]; the run stands where it stood.
    pub fn step(&mut self, device: &mut dyn Device, t: f64, given: &[f64]) -> Result<Stepped, DeviceError> {
        let dt = t - self.t;
        let (mut parent, mut reached) = (self.parent, self.t);
        let (mut done, mut h) = (0.0, 1.0);
        loop {
            let ends = done + h >= 1.0;
            if ends {
                h = 1.0 - done;
                self.between.copy_from_slice(given);
            } else {
                let ways = self.given.iter().zip(given);
                self.between.iter_mut().zip(ways).for_each(|(x, (a, b))| *x = a + (b - a) * (done + h));
            }
            let length = h * dt;
            let trial =
                Trial { mode: Mode::Transient, parent, t: reached + length, dt: length, voltages: &self.between };
            device.trial(&trial, &mut self.reply)?;
            self.trials += 1;
            if self.trials.is_multiple_of(PIECES)
                && let Some(start) = self.start
            {
                device.accept(start);
            }
            match &self.reply.status {
                Status::Ok if ends => {
                    std::mem::swap(&mut self.last, &mut self.reply);
                    self.parent = self.last.token;
                    self.t = t;
                    self.given.copy_from_slice(given);
                    return Ok(Stepped::Taken);
                }
                Status::Ok => {
                    parent = self.reply.token;
                    reached += length;
                    done += h;
                }
                Status::NeedDt(need) => {
                    h = (need / dt).min(h / 2.0);
                    if h < SHORTEST || h.is_nan() {
                        let short = h * dt;
                        return Ok(Stepped::Failed(format!("the device requires steps below {short:.3e} s")));
                    }
                }
                Status::Fail(reason) => return Ok(Stepped::Failed(reason.clone())),
            }
        }
    }
}

/// Where a run begins.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a> {
    /// The state; none: the model at rest as drawn.
    pub state: Option<Token>,
    /// Its time (s).
    pub t: f64,
    /// Input of the ports there (p).
    pub given: &'a [f64],
}

/// Inputs over time of a run, and its outputs.
#[derive(Debug, Clone, Copy)]
pub struct DriveSchedule<'a> {
    /// Times at the ends of the steps (s), ascending (n).
    pub times: &'a [f64],
    /// Port values at each time, row by row (n×p), or one row for all (p).
    pub values: &'a [f64],
    /// Signals wanted of each step, of those that were opened.
    pub signals: &'a [String],
    /// Whether currents and charges are wanted.
    pub ports: bool,
}

/// Result of a run. s requested signals, p ports; row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ran {
    /// Steps taken.
    pub steps: usize,
    /// Trials that they took.
    pub trials: usize,
    /// Signals after each step (steps×s).
    pub outputs: Vec<f64>,
    /// Currents after each step (steps×p), where wanted.
    pub currents: Vec<f64>,
    /// Charges after each step (steps×p), where wanted.
    pub charges: Vec<f64>,
    /// The reply to the last step; `None` without a step.
    pub last: Option<TrialReply>,
    /// Why the step numbered `steps` has no answer; none: all were taken.
    pub error: Option<String>,
}

/// Steps a device that is open as `opened` from a state along a course.
///
/// # Errors
/// Those of [`Device::trial`], [`DeviceError::UnknownSignal`], and [`DeviceError::BadRequest`] for values and times that do not fit.
pub fn steps(
    device: &mut dyn Device,
    opened: &Description,
    start: &Start<'_>,
    course: &DriveSchedule<'_>,
) -> Result<Ran, DeviceError> {
    let ports = opened.ports.len();
    let stride = match course.values.len() {
        all if all == ports => 0,
        all if all == ports * course.times.len() => ports,
        got => return Err(misfit("voltages", format!("{ports} values, one for each opened port, a step"), got)),
    };
    let place = |name: &String| {
        let hint = || "signals of a run are among those that the device was opened with".to_owned();
        let found = opened.signals.iter().position(|signal| signal.name == *name);
        found.ok_or_else(|| DeviceError::UnknownSignal { name: name.clone(), hint: hint() })
    };
    let signals: Vec<usize> = course.signals.iter().map(place).collect::<Result<_, _>>()?;
    if start.given.len() != ports {
        return Err(misfit("voltages", format!("{ports} values at the start"), start.given.len()));
    }
    let mut run = Run::new(start.state, start.t, start.given.to_vec());
    let mut ran = Ran::default();
    for (k, &t) in course.times.iter().enumerate() {
        match run.step(device, t, &course.values[k * stride..][..ports])? {
            Stepped::Taken => {}
            Stepped::Failed(why) => {
                ran.error = Some(why);
                break;
            }
        }
        ran.steps += 1;
        ran.outputs.extend(signals.iter().map(|&signal| run.last().outputs[signal]));
        if course.ports {
            ran.currents.extend_from_slice(&run.last().currents);
            ran.charges.extend_from_slice(&run.last().charges);
        }
    }
    (ran.trials, ran.last) = (run.trials, (ran.steps > 0).then_some(run.last));
    Ok(ran)
}

fn misfit(what: &'static str, expected: String, got: usize) -> DeviceError {
    DeviceError::BadRequest { what, expected, got: got.to_string() }
}
