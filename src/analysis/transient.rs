//! Motion in time.
use super::contact_range::within_contact_range;
use super::formulation::Formulation;
use super::integrator::Integrator;
use super::joint_transient::joint_transient;
use super::signal::{Signal, View};
use super::stability::Stability;
use super::statics::{operating_point, source_vector};
use super::{AnalysisError, Watch};
use crate::compile::Compiled;
use crate::gaps::{Ramp, System};
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::options::analysis::TRAN_POINTS;
use crate::solve::baseline::{Solver, SolverKind};
use crate::solve::dense::interpolate;
use crate::solve::time::adaptive::{Advance, Control, Observer};
use crate::solve::time::event::{Detector, Direction};
use crate::solve::time::method::{Motion, Work};
use serde::Serialize;

/// What a transient may be told.
#[derive(Debug, Clone)]
pub struct TransientOptions<'a> {
    /// End time [s].
    pub stop: f64,
    /// Names of the signals wanted, see [`crate::device::SignalInfo`].
    pub signals: Vec<String>,
    /// Number of equally spaced output times, ends included.
    pub points: usize,
    /// Relative error of a step [1].
    pub tol: f64,
    /// Voltages held during the run, by port name [V].
    pub voltages: Vec<(String, f64)>,
    /// A variant of the same netlist whose static equilibrium is the initial state; none: at rest as drawn.
    pub release: Option<&'a Compiled>,
    /// What integrates.
    pub method: Integrator,
    /// Length of equal steps [s]; none: steps follow `tol`.
    pub step: Option<f64>,
    /// Crossings to find: (signal name, level in the signal's unit).
    pub events: Vec<(String, f64)>,
    /// What solves the linear systems of the method. The result is the same to rounding; all but the recursion are
    /// baselines, and Radau5 and rk45 have none.
    pub solver: SolverKind,
    /// Whether the result holds the samples, default true; without, only who is told them as they come has them.
    pub keep: bool,
}

impl Default for TransientOptions<'_> {
    /// From rest to 1 s; whoever asks says more.
    fn default() -> Self {
        Self {
            stop: 1.0,
            signals: Vec::new(),
            points: TRAN_POINTS.count(),
            tol: 1e-3,
            voltages: Vec::new(),
            release: None,
            method: Integrator::default(),
            step: None,
            events: Vec::new(),
            solver: SolverKind::default(),
            keep: true,
        }
    }
}

/// Work done by an integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Solves with a factor.
    pub solves: u64,
    /// Evaluations of the forces, with or without their tangent.
    pub forces: u64,
    /// Newton iterations.
    pub iterations: u64,
}

/// A signal that crossed a level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Name of the signal; of a gap that closes or opens, its `GAP.gap`.
    pub signal: String,
    /// The level, in the signal's unit.
    pub level: f64,
    /// When [s].
    pub t: f64,
    /// Which way.
    pub direction: Direction,
    /// True where the contact force of a gap begins (down) or ends (up) to act.
    pub contact: bool,
}

/// Sampled signals.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TransientResult {
    /// Times [s].
    pub t: Vec<f64>,
    /// Samples of each signal, in the order asked for: (name, unit, values).
    pub signals: Vec<(String, String, Vec<f64>)>,
    /// Work done.
    pub counters: Counters,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Largest estimated relative error by the mesh [1]; none without an estimate.
    pub estimated_error: Option<f64>,
    /// How far the steps in time may be off by the end, of the amplitude [1]; none where they are not compared, see
    /// [`super::step_error`].
    pub step_error: Option<f64>,
    /// Crossings asked for and contacts of gaps, in order of time.
    pub events: Vec<Event>,
    /// What the numbers do not say by themselves.
    pub warnings: Vec<String>,
}

/// Times of a run at which its stability is looked at, the end included.
pub(super) const LOOKS: usize = 16;

/// Share of the tolerance that one step may use: errors of many steps add up.
pub(super) const STEP_SHARE: f64 = 1e-2;

/// What carries a motion from the start of a ramp to its end.
pub(super) trait Carrier {
    /// Takes the start to where the formulation can go on from.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn begin(&mut self, ramp: &Ramp<'_>, motion: &mut Motion) -> Result<(), AnalysisError> {
        let _ = (ramp, motion);
        Ok(())
    }

    /// Advances it; `observe` sees each step.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError>;
}

/// The bodies' own coordinates, joints as springs.
struct Compliant<'a> {
    system: &'a System,
    options: &'a TransientOptions<'a>,
}

impl Carrier for Compliant<'_> {
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError> {
        let options = self.options;
        if options.solver != SolverKind::Recursion && !options.method.takes_solvers() {
            return Err(AnalysisError::BadRequest {
                what: "solver".into(),
                detail: format!(
                    "{} solves its own systems; the {} solver cannot",
                    options.method.name(),
                    options.solver.name()
                ),
            });
        }
        let solver = Solver::new(options.solver, &self.system.model.pattern)?;
        let h = first_step(self.system, options.stop);
        let control = options.step.map_or(Control::Tolerance(STEP_SHARE * options.tol), Control::Fixed);
        let (end, work) = options.method.advance(self.system, solver, ramp, motion, h, control, observe);
        Ok((end?, work))
    }
}

/// Integrates the motion in the formulation of the model. Each finished sample also goes to `sample` (t, values in signal order), for streaming.
///
/// # Errors
/// See [`AnalysisError`].
pub fn transient(
    compiled: &Compiled,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<TransientResult, AnalysisError> {
    let system = &compiled.parts.system;
    let (suited, method) = Formulation::of_run(compiled, options);
    match suited.formulation {
        formulation @ (Formulation::Rcr | Formulation::RcrElastic) => {
            let options = TransientOptions { method, ..options.clone() };
            joint_transient(compiled, formulation, &options, sample, watch).map(|(r, _)| r)
        }
        _ => record(compiled, options, &mut Compliant { system, options }, sample, watch),
    }
}

/// Lets `carrier` go from the start to the end of a run, and takes samples and events on the way.
pub(super) fn record(
    compiled: &Compiled,
    options: &TransientOptions<'_>,
    carrier: &mut impl Carrier,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<TransientResult, AnalysisError> {
    check(options)?;
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let signals: Vec<Signal> =
        options.signals.iter().map(|name| Signal::find(compiled, name)).collect::<Result<_, _>>()?;
    let sources = source_vector(compiled, &options.voltages)?;
    let mut motion = Motion::zeros(system.bodies());
    let mut rise = vec![0.0; electrics.heating.heaters.len()];
    if let Some(start) = options.release {
        let point = operating_point(start, &options.voltages)?;
        if point.q.len() != motion.q.len() {
            return Err(AnalysisError::BadRequest {
                what: "release".into(),
                detail: "the released parameter changes the mechanism itself; release a load or a voltage".into(),
            });
        }
        motion.q.copy_from_slice(&point.q);
        rise.copy_from_slice(&point.rise);
    }
    let ramp = Ramp::new(electrics, &sources, &sources, &rise, options.stop);
    let mut drive = electrics.drive();
    ramp.at(0.0, &mut drive);
    let volts = drive.volts.clone();
    carrier.begin(&ramp, &mut motion)?;

    let kept = if options.keep { options.points } else { 0 };
    let mut result = TransientResult {
        t: Vec::with_capacity(kept),
        signals: (options.signals.iter().zip(&signals))
            .map(|(name, s)| (name.clone(), s.unit().to_owned(), Vec::with_capacity(kept)))
            .collect(),
        counters: Counters::default(),
        unknowns: compiled.unknowns(),
        estimated_error: compiled.order.estimated_error,
        step_error: None,
        events: Vec::new(),
        warnings: Vec::new(),
    };
    let mut stability = Stability::new(system);
    let mut looks = 0;
    let mut watched = watched(compiled, options)?;
    let mut events = Vec::new();
    let spacing = options.stop / (options.points - 1) as f64;
    let mut row = vec![0.0; signals.len()];
    let mut rise_now = rise.clone();
    let mut now = Motion::zeros(system.bodies());
    let mut within = now.clone();
    let mut rise_within = rise.clone();
    for w in &mut watched {
        let view = View { q: &motion.q, v: &motion.v, rise: &rise, volts: &volts };
        w.detector = Detector::new(w.signal.value(compiled, &view) - w.level);
    }
    let mut emit = |t: f64, motion: &Motion, result: &mut TransientResult| {
        for (k, r) in rise_now.iter_mut().enumerate() {
            *r = ramp.rise_at(k, t);
        }
        let view = View { q: &motion.q, v: &motion.v, rise: &rise_now, volts: &volts };
        for (value, signal) in row.iter_mut().zip(&signals) {
            *value = signal.value(compiled, &view);
        }
        if options.keep {
            result.t.push(t);
            for (value, column) in row.iter().zip(&mut result.signals) {
                column.2.push(*value);
            }
        }
        sample(t, &row);
    };
    emit(0.0, &motion, &mut result);
    let mut next = 1;
    let mut beyond = None;
    let mut observe = |s: f64, h: f64, before: &Motion, after: &Motion| {
        if let Err(error) = within_contact_range(compiled, &after.q) {
            beyond = Some(error);
            return false;
        }
        while next < options.points {
            let t = if next + 1 == options.points { options.stop } else { next as f64 * spacing };
            if t > s + h && next + 1 < options.points || t > (s + h) * (1.0 + 1e-12) {
                break;
            }
            interpolate(before, after, h, ((t - s) / h).min(1.0), &mut now);
            emit(t, &now, &mut result);
            next += 1;
        }
        let first = events.len();
        for w in &mut watched {
            let value = |x: f64| {
                interpolate(before, after, h, x, &mut within);
                for (k, r) in rise_within.iter_mut().enumerate() {
                    *r = ramp.rise_at(k, s + x * h);
                }
                let view = View { q: &within.q, v: &within.v, rise: &rise_within, volts: &volts };
                w.signal.value(compiled, &view) - w.level
            };
            w.detector.step(value, |x, direction| {
                crate::budget::lay_out(size_of::<Event>() + w.name.len());
                events.push(Event {
                    signal: w.name.clone(),
                    level: w.level,
                    t: s + x * h,
                    direction,
                    contact: w.contact,
                });
            });
        }
        events[first..].sort_by(|a, b| a.t.total_cmp(&b.t));
        let done = ((s + h) / options.stop * LOOKS as f64 * (1.0 + 1e-12)) as usize;
        if done > looks {
            looks = done;
            ramp.at(s + h, &mut drive);
            stability.look(system, &drive, s + h, (&after.q, &after.v));
        }
        watch(((s + h) / options.stop).min(1.0))
    };
    let (end, work) = carrier.advance(&ramp, &mut motion, &mut observe)?;
    if end == Advance::Stopped {
        return Err(beyond.unwrap_or(AnalysisError::Cancelled));
    }
    result.counters = Counters {
        steps: work.steps,
        rejected: work.rejected,
        factorizations: work.factorizations,
        solves: work.solves,
        forces: work.forces,
        iterations: work.iterations,
    };
    result.events = events;
    result.warnings.extend(stability.told());
    Ok(result)
}

/// A signal whose crossings of a level are found.
struct Watched {
    name: String,
    signal: Signal,
    level: f64,
    contact: bool,
    detector: Detector,
}

/// The crossings asked for, and the contact of every gap that has one.
fn watched(compiled: &Compiled, options: &TransientOptions<'_>) -> Result<Vec<Watched>, AnalysisError> {
    let watch =
        |name: String, signal, level, contact| Watched { name, signal, level, contact, detector: Detector::default() };
    let asked = options
        .events
        .iter()
        .map(|(name, level)| Signal::find(compiled, name).map(|signal| watch(name.clone(), signal, *level, false)));
    let system = &compiled.parts.system;
    let touching =
        (0..system.gaps.len()).filter_map(|g| system.touching(g).map(|[touch, _]| (g, touch))).map(|(g, touch)| {
            let name = format!("{}.gap", compiled.parts.gap_names[g]);
            Ok(watch(name, Signal::Distance(g), touch, true))
        });
    asked.chain(touching).collect()
}

/// A cautious first step: the error control corrects it within a few steps either way.
pub fn first_step(system: &System, interval: f64) -> f64 {
    // a tenth of a radian of the fastest translation that a body and its own joints would make
    let model = &system.model;
    let mut tangent = BlockMatrix::new(&model.pattern);
    let zeros = vec![Pose::zeros(); system.bodies()];
    let mut r = zeros.clone();
    system.tangent(&zeros, &system.electrics.drive(), &mut tangent, &mut r);
    let fastest = (0..system.bodies())
        .filter(|&j| model.mass(j).x > 0.0)
        .map(|j| (tangent.diagonal[j].fixed_view::<2, 2>(0, 0).norm() / model.mass(j).x).sqrt())
        .fold(0.0, f64::max);
    if fastest > 0.0 { interval.min(1.0 / fastest) } else { interval }
}

pub(crate) fn check(options: &TransientOptions<'_>) -> Result<(), AnalysisError> {
    let bad = |what: &str, detail: String| Err(AnalysisError::BadRequest { what: what.into(), detail });
    if !(options.stop.is_finite() && options.stop > 0.0) {
        return bad("stop", format!("{} is not a positive time in seconds", options.stop));
    }
    if options.points < 2 {
        return bad("points", format!("{} output times; at least 2 are needed", options.points));
    }
    if !(options.tol.is_finite() && options.tol > 0.0 && options.tol < 1.0) {
        return bad("tol", format!("{} is not a relative error between 0 and 1", options.tol));
    }
    if let Some(step) = options.step
        && !(step.is_finite() && step > 0.0 && options.stop / step < 1e9)
    {
        return bad("step", format!("{step} is not a positive time in seconds, of which at most 1e9 make the run"));
    }
    if let Integrator::GeneralizedAlpha { rho } = options.method
        && !(0.0..=1.0).contains(&rho)
    {
        return bad("rho", format!("{rho} is not between 0 and 1"));
    }
    if let Some((name, level)) = options.events.iter().find(|(_, level)| !level.is_finite()) {
        return bad("event", format!("{name}={level}: the level is not finite"));
    }
    Ok(())
}
