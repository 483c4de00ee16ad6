//! The error of a run's signals over time, from the error of its motion, see [`bimorph_solve::time::defect`].

use super::super::chart::error::{SMALL, half_range};
use super::super::statics::source_vector;
use super::options::TransientOptions;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use crate::readout::signal::SignalView;
use bimorph_domains::{Drive, Ramp};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::forces::kinetic_energy;
use bimorph_multibody::planar::Pose;
use bimorph_solve::time::defect::MotionError;
use bimorph_solve::time::method::Motion;

/// Ends of steps at which signals are compared, at most.
const ENOUGH: f64 = 1000.0;
/// Motion below this fraction of the model's length scale, or of 1 rad or 1 K, is rounding (1).
const NEGLIGIBLE_MOTION: f64 = 1e-9;
/// Error of a signal, of its range, from which on it is not predictable.
const LOST: f64 = 0.3;
/// Growth of an error from the second to the last quarter of the time until phase is lost. Phase errors grow at most as
/// a power of time, and stay below this; neighbouring chaotic motions diverge by more.
const CHAOTIC: f64 = 30.0;

/// When a signal is lost.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SignalLoss {
    pub(crate) signal: String,
    /// From when on (s).
    pub(crate) t: f64,
    /// Neighbouring motions part exponentially: no tolerance helps for long.
    pub(crate) chaotic: bool,
}

/// Step error of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StepErrorEstimate {
    /// Root mean square error of the worst signal, of its amplitude (1).
    pub(crate) error: f64,
    /// The first signal that is lost, if any is.
    pub(crate) lost: Option<SignalLoss>,
    /// Largest change of the amplitude by the energy that the steps took (1).
    pub(crate) damped: f64,
}

/// Signals and their errors at some ends of steps.
pub(crate) struct ErrorLog<'a> {
    compiled: &'a CompiledModel,
    ramp: &'a Ramp<'a>,
    volts: &'a [f64],
    signals: &'a [Expression<RunSignal>],
    stride: f64,
    next: f64,
    exact: Motion,
    rise: Vec<f64>,
    t: Vec<f64>,
    values: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
    /// Parts touch: the error after that is not estimated.
    touched: bool,
    energy: MotionEnergy,
}

/// Energies over a run (J).
struct MotionEnergy {
    drive: Drive,
    rest: Vec<Pose>,
    /// Largest kinetic energy.
    kinetic: f64,
    /// Least and largest potential, from that of the drawing under the same sources.
    potential: [f64; 2],
    /// Most that the steps took.
    taken: f64,
}

impl MotionEnergy {
    fn observe(&mut self, model: &CompiledModel, ramp: &Ramp<'_>, t: f64, (motion, taken): (&Motion, f64)) {
        let Self { drive, rest, kinetic, potential: [low, high], .. } = self;
        let system = &model.parts.system;
        ramp.at(t, drive);
        let moving = kinetic_energy(&system.model, &motion.v);
        let potential = system.energy(&motion.q, &motion.v, drive) - moving - system.energy(rest, rest, drive);
        (*kinetic, *low, *high) = (kinetic.max(moving), low.min(potential), high.max(potential));
        self.taken = self.taken.max(taken.abs());
    }

    /// Half of what the steps took, of what the run moved: an energy goes with the square of its amplitude.
    fn damped(&self) -> f64 {
        let [low, high] = self.potential;
        let moved = self.kinetic.max(high - low);
        if self.taken > 0.0 && moved > 0.0 { 0.5 * self.taken / moved } else { 0.0 }
    }
}

impl<'a> ErrorLog<'a> {
    /// From the start of the motion, which has no error.
    pub(super) fn start(
        (compiled, stop): (&'a CompiledModel, f64),
        (ramp, volts): (&'a Ramp<'a>, &'a [f64]),
        signals: &'a [Expression<RunSignal>],
        motion: &Motion,
    ) -> Self {
        let system = &compiled.parts.system;
        let mut log = Self {
            compiled,
            ramp,
            volts,
            signals,
            stride: stop / ENOUGH,
            next: 0.0,
            exact: Motion::zeros(system.bodies()),
            rise: vec![0.0; system.electrics.heating.means()],
            t: Vec::new(),
            values: vec![Vec::new(); signals.len()],
            errors: vec![Vec::new(); signals.len()],
            touched: false,
            energy: MotionEnergy {
                drive: system.electrics.drive(),
                rest: vec![Pose::zeros(); system.bodies()],
                kinetic: 0.0,
                potential: [f64::INFINITY, f64::NEG_INFINITY],
                taken: 0.0,
            },
        };
        log.observe(0.0, motion, MotionError { motion: &Motion::zeros(system.bodies()), taken: 0.0 });
        log
    }

    /// The end of a step at time `t` (s), the motion there and its error; returns whether the next one is of use.
    pub(super) fn observe(
        &mut self,
        t: f64,
        motion: &Motion,
        MotionError { motion: error, taken }: MotionError<'_>,
    ) -> bool {
        self.touched = self.touched || self.compiled.parts.system.contact_energy(&motion.q) > 0.0;
        if self.touched {
            return false;
        }
        if t < self.next {
            return true;
        }
        self.next = t + self.stride;
        for (k, r) in self.rise.iter_mut().enumerate() {
            *r = self.ramp.rise_at(k, t);
        }
        let less = |to: &mut [Pose], x: &[Pose], e: &[Pose]| {
            to.iter_mut().zip(x.iter().zip(e)).for_each(|(to, (x, e))| *to = x - e);
        };
        less(&mut self.exact.q, &motion.q, &error.q);
        less(&mut self.exact.v, &motion.v, &error.v);
        bimorph_base::budget::lay_out(2 * size_of::<f64>() * self.signals.len());
        for (signal, (values, errors)) in self.signals.iter().zip(self.values.iter_mut().zip(&mut self.errors)) {
            let of = |m: &Motion| {
                signal.value(self.compiled, &SignalView { q: &m.q, v: &m.v, rise: &self.rise, volts: self.volts })
            };
            let value = of(motion);
            values.push(value);
            errors.push((value - of(&self.exact)).abs());
        }
        self.t.push(t);
        self.energy.observe(self.compiled, self.ramp, t, (motion, taken));
        true
    }

    /// The estimate; none where something touched, or nothing was compared.
    pub(super) fn estimate(&self, options: &TransientOptions<'_>) -> Option<StepErrorEstimate> {
        if self.touched || self.t.len() < 2 || self.signals.is_empty() {
            return None;
        }
        let swings: Vec<f64> = self.values.iter().map(|values| half_range(values)).collect();
        let largest = |unit: &str| {
            let own = self.signals.iter().zip(&swings).filter(|(s, _)| s.unit() == unit);
            own.map(|(_, swing)| *swing).fold(0.0, f64::max)
        };
        let mut found = StepErrorEstimate { error: 0.0, lost: None, damped: self.energy.damped() };
        for (k, signal) in self.signals.iter().enumerate() {
            let amplitude =
                swings[k].max(SMALL * largest(signal.unit())).max(least(signal.unit(), options, self.compiled));
            let relative: Vec<f64> = self.errors[k].iter().map(|e| relative(*e, amplitude)).collect();
            let error = self.mean_square(&relative).sqrt();
            found.error = if error.is_nan() { f64::INFINITY } else { found.error.max(error) };
            let lost = relative.iter().position(|e| *e > 2.0 * LOST);
            if let Some(at) = lost.filter(|at| found.lost.as_ref().is_none_or(|lost| self.t[*at] < lost.t)) {
                let signal = options.signals[k].clone();
                found.lost = Some(SignalLoss { signal, t: self.t[at], chaotic: grows_fast(&relative[..=at]) });
            }
        }
        Some(found)
    }

    /// Mean over time of the squares of values at the ends of steps.
    fn mean_square(&self, values: &[f64]) -> f64 {
        let spans = self.t.windows(2).zip(values.windows(2));
        let sum: f64 = spans.map(|(t, e)| 0.5 * (t[1] - t[0]) * (e[0] * e[0] + e[1] * e[1])).sum();
        sum / (self.t[self.t.len() - 1] - self.t[0])
    }
}

/// An error relative to the amplitude: a signal of unknown phase has an error of twice the amplitude at most.
fn relative(error: f64, amplitude: f64) -> f64 {
    if error == 0.0 { 0.0 } else { (error / amplitude).min(2.0) }
}

/// Whether an error that ends lost grew faster than phases add up.
fn grows_fast(errors: &[f64]) -> bool {
    let quarter = errors.len() / 4;
    let most = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
    quarter > 0 && most(&errors[3 * quarter..]) > CHAOTIC * most(&errors[quarter..2 * quarter])
}

/// The amplitude below which a signal of this unit stands still.
pub(crate) fn least(unit: &str, options: &TransientOptions<'_>, model: &CompiledModel) -> f64 {
    let length = model.parts.system.length_scale;
    match unit {
        "m" => NEGLIGIBLE_MOTION * length,
        "rad" | "K" => NEGLIGIBLE_MOTION,
        "m/s" => NEGLIGIBLE_MOTION * length / options.stop,
        "rad/s" => NEGLIGIBLE_MOTION / options.stop,
        "A" => NEGLIGIBLE_MOTION * largest_current(options, model),
        _ => 0.0,
    }
}

/// Scale of the currents into ports (A): that through resistances, and all charge within the run.
fn largest_current(options: &TransientOptions<'_>, model: &CompiledModel) -> f64 {
    let Ok(sources) = source_vector(model, &options.voltages) else { return 0.0 };
    let system = &model.parts.system;
    let electrics = &system.electrics;
    let (mut rise, mut drive) = (vec![0.0; electrics.heating.states()], electrics.drive());
    electrics.steady(&sources, &mut rise, &mut drive);
    let rest = vec![Pose::zeros(); system.bodies()];
    let charge: f64 = drive.volts.iter().enumerate().map(|(g, v)| (system.capacitance(g, &rest) * v).abs()).sum();
    let through = electrics.port_currents(&sources, &rise);
    through[..electrics.ports].iter().map(|current| current.abs()).fold(charge / options.stop, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Phases that add up in proportion to time, or to its square, are lost and not chaotic; an error that grows as exp(t/5) is.
    #[test]
    fn powers_are_no_chaos() {
        let errors = |of: fn(f64) -> f64| (1..=100).map(|k| of(f64::from(k))).collect::<Vec<f64>>();
        assert!(!grows_fast(&errors(|t| t)) && !grows_fast(&errors(|t| t * t)));
        assert!(grows_fast(&errors(|t| (0.2 * t).exp())));
        assert!(!grows_fast(&[0.0, 1.0]));
    }
}
