//! Motion in time.
use super::signal::{Signal, View};
use super::statics::{operating_point, source_vector};
use super::{AnalysisError, Watch};
use crate::compile::Compiled;
use crate::gaps::{Ramp, System};
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::solve::adaptive::{Adaptive, Advance};
use crate::solve::rodas4::Motion;
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
}

/// Sampled signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TransientResult {
    /// Times [s].
    pub t: Vec<f64>,
    /// Samples of each signal, in the order asked for: (name, unit, values).
    pub signals: Vec<(String, String, Vec<f64>)>,
    /// Work done.
    pub counters: Counters,
    /// Mechanical unknowns.
    pub unknowns: usize,
}

/// Share of the tolerance that one step may use: errors of many steps add up.
const STEP_SHARE: f64 = 1e-2;

/// Integrates the motion. Each finished sample also goes to `sample` (t, values in signal order), for streaming.
///
/// # Errors
/// See [`AnalysisError`].
pub fn transient(
    compiled: &Compiled,
    options: &TransientOptions<'_>,
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
    let ramp = Ramp { electrics, from: &sources, to: &sources, rise: &rise, dt: options.stop };
    let mut drive = electrics.drive();
    ramp.at(0.0, &mut drive);
    let volts = drive.volts.clone();

    let mut result = TransientResult {
        t: Vec::with_capacity(options.points),
        signals: (options.signals.iter().zip(&signals))
            .map(|(name, s)| (name.clone(), s.unit().to_owned(), Vec::with_capacity(options.points)))
            .collect(),
        counters: Counters::default(),
        unknowns: system.model.unknowns(),
    };
    let spacing = options.stop / (options.points - 1) as f64;
    let mut row = vec![0.0; signals.len()];
    let mut rise_now = rise.clone();
    let mut now = Motion::zeros(system.bodies());
    let mut emit = |t: f64, motion: &Motion, result: &mut TransientResult| {
        for (k, r) in rise_now.iter_mut().enumerate() {
            *r = ramp.rise_at(k, t);
        }
        let view = View { q: &motion.q, v: &motion.v, rise: &rise_now, volts: &volts };
        result.t.push(t);
        for ((value, signal), column) in row.iter_mut().zip(&signals).zip(&mut result.signals) {
            *value = signal.value(compiled, &view);
            column.2.push(*value);
        }
        sample(t, &row);
    };
    emit(0.0, &motion, &mut result);
    let mut next = 1;
    let mut observe = |s: f64, h: f64, before: &Motion, after: &Motion| {
        while next < options.points {
            let t = if next + 1 == options.points { options.stop } else { next as f64 * spacing };
            if t > s + h && next + 1 < options.points || t > (s + h) * (1.0 + 1e-12) {
                break;
            }
            interpolate(before, after, h, ((t - s) / h).min(1.0), &mut now);
            emit(t, &now, &mut result);
            next += 1;
        }
        watch(((s + h) / options.stop).min(1.0))
    };
    let mut stepper = Adaptive::new(system, 0);
    let mut h = first_step(system, options.stop);
    let tol = STEP_SHARE * options.tol;
    let end = stepper.advance(system, &ramp, &mut motion, &[], &mut [], &mut h, tol, usize::MAX, &mut observe)?;
    if end == Advance::Stopped {
        return Err(AnalysisError::Cancelled);
    }
    result.counters = Counters {
        steps: stepper.work.steps,
        rejected: stepper.work.rejected,
        factorizations: stepper.method.factorizations,
        solves: stepper.method.solves,
    };
    Ok(result)
}

/// A cautious first step: the error control corrects it within a few steps either way.
pub(crate) fn first_step(system: &System, interval: f64) -> f64 {
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

fn check(options: &TransientOptions<'_>) -> Result<(), AnalysisError> {
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
    Ok(())
}

/// Cubic Hermite interpolation between two ends of a step of length `h`, at the share `x`.
fn interpolate(before: &Motion, after: &Motion, h: f64, x: f64, out: &mut Motion) {
    let (a, b) = ((1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x), x * x * (3.0 - 2.0 * x));
    let (c, d) = (h * x * (1.0 - x) * (1.0 - x), -h * x * x * (1.0 - x));
    let (da, dc, dd) = (-6.0 * x * (1.0 - x) / h, (1.0 - x) * (1.0 - 3.0 * x), x * (3.0 * x - 2.0));
    for k in 0..out.q.len() {
        let (q0, q1, v0, v1) = (before.q[k], after.q[k], before.v[k], after.v[k]);
        out.q[k] = q0 * a + q1 * b + v0 * c + v1 * d;
        out.v[k] = (q0 - q1) * da + v0 * dc + v1 * dd;
    }
}
