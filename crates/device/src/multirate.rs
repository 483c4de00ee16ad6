//! Multirate integration of a session: prediction of macro steps, and correction of the motion at their ends ([`crate::macro_step`]).

use crate::Token;
use crate::macro_step::{MacroStep, MacroStepPosition, PeakMotion, SquareExtrapolation, extended, fitted_line};
use crate::states::Snapshot;
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_solve::equations::Bodies;
use bimorph_solve::equations::bodies::NormWeights;
use bimorph_solve::time::adaptive::{Adaptive, Advance, Control};
use bimorph_solve::time::method::Motion;
use bimorph_solve::time::rodas4::Rodas4;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points of the requested length that a macro step must hold (1).
const MIN_POINTS: f64 = 6.0;
/// Points without macro steps after one that ended within [`MIN_POINTS`].
const PAUSE: u32 = 64;
/// Largest difference of rows of gap voltages that count as equal (1).
const EQUAL_ROWS: f64 = 1e-12;
/// Smallest motion since the equilibrium, relative to the displacement from the drawing, for which macro steps are made (1).
const MIN_MOTION: f64 = 1e-6;
/// Predicted macro steps in the cache.
const CACHED: usize = 2;
/// Internal steps of a correction at most.
const MAX_STEPS: usize = 64;

/// Storage of multirate integration.
#[derive(Debug)]
pub(crate) struct Multirate {
    /// Change of the voltage of all gaps with each source (1).
    row: Vec<f64>,
    /// Whether a signal or port shows a rate.
    sees_rates: bool,
    stepper: Adaptive<Rodas4>,
    drive: Drive,
    change: Drive,
    /// Force on each body per squared voltage (N/V², N·m/V²).
    force: Vec<Pose>,
    push: Vec<Pose>,
    push_rate: Vec<Pose>,
    motion: Motion,
    /// Latest predictions. Trials of one point may continue a macro step or begin the next one, by their lengths.
    cache: VecDeque<PredictedStep>,
    /// Latest state that was corrected for steps without macro steps.
    corrected: Option<(Token, Arc<Snapshot>)>,
}

/// Prediction of a macro step.
#[derive(Debug)]
pub(crate) struct PredictedStep {
    step: Arc<MacroStep>,
    /// Its length, and the proposed next one (s); none where the step failed.
    pub(crate) lengths: Option<[f64; 2]>,
    /// Motion at its end.
    pub(crate) end: Motion,
    /// Acceleration per squared voltage, in the norm of masses.
    acceleration: f64,
    /// Allowed errors of displacements and rates at points, in that norm.
    allowed: [f64; 2],
}

impl Multirate {
    /// None for a mechanism whose forces depend on more than one voltage, or act on bodies without mass.
    pub(crate) fn new(system: &System, sees_rates: bool) -> Option<Self> {
        let electrics = &system.electrics;
        let (heating, others) = (&electrics.heating, electrics.inputs.len());
        if heating.states() > 0 || heating.means() > 0 || others > 0 || !electrics.floating.is_empty() {
            return None;
        }
        let rows = &electrics.gap_rows;
        let mut active = (0..rows.nrows()).filter(|gap| rows.row(*gap).iter().any(|x| *x != 0.0));
        let first = active.next()?;
        let equal =
            |gap: usize| rows.row(gap).iter().zip(rows.row(first).iter()).all(|(a, b)| (a - b).abs() <= EQUAL_ROWS);
        if !active.all(equal) {
            return None;
        }
        let n = system.bodies();
        let mut multirate = Self {
            row: rows.row(first).iter().copied().collect(),
            sees_rates,
            stepper: Adaptive::new(n, Rodas4::new(system, &[])),
            drive: electrics.drive(),
            change: electrics.drive(),
            force: vec![Pose::zeros(); n],
            push: vec![Pose::zeros(); n],
            push_rate: vec![Pose::zeros(); n],
            motion: Motion::zeros(n),
            cache: VecDeque::with_capacity(CACHED),
            corrected: None,
        };
        multirate.evaluate_force(system, &vec![Pose::zeros(); n]);
        multirate.acceleration(system).is_finite().then_some(multirate)
    }

    /// Voltage of the gaps (V).
    pub(crate) fn volts(&self, sources: &[f64]) -> f64 {
        self.row.iter().zip(sources).map(|(row, source)| row * source).sum()
    }

    /// Evaluates the force per squared voltage at displacements `q`.
    fn evaluate_force(&mut self, system: &System, q: &[Pose]) {
        for (gap, row) in system.electrics.gap_rows.row_iter().enumerate() {
            let is_active = row.iter().any(|x| *x != 0.0);
            // r contains −½·V²·∇C
            (self.drive.volts[gap], self.change.volts[gap]) = if is_active { (1.0, 0.5) } else { (0.0, 0.0) };
        }
        self.change.load = 0.0;
        system.drive_force(q, &self.drive, &self.change, &mut self.force);
        self.force.iter_mut().for_each(|force| *force = -*force);
    }

    /// Sets the external force to that of a squared voltage which is linear in time: value (V²) and slope (V²/s).
    fn set_push(&mut self, [value, slope]: [f64; 2]) {
        for ((push, rate), force) in self.push.iter_mut().zip(&mut self.push_rate).zip(&self.force) {
            *push = force * value;
            *rate = force * slope;
        }
    }

    /// Acceleration per squared voltage, in the norm of masses; infinite where a gap acts on a body without mass.
    fn acceleration(&self, system: &System) -> f64 {
        let squared = |(j, force): (usize, &Pose)| -> f64 {
            let mass = system.model.mass(j);
            force.iter().zip(mass.iter()).filter(|(f, _)| **f != 0.0).map(|(f, m)| f * f / m).sum()
        };
        self.force.iter().enumerate().map(squared).sum::<f64>().sqrt()
    }

    /// Motion at a state in a macro step, corrected with the integrals of its squared voltage, and the proposed next step (s). Sources are linear between both
    /// states. The residual of the integrals acts as a force at the mean configuration.
    fn correct(
        &mut self,
        (system, weights): (&System, &NormWeights),
        (position, state): (&MacroStepPosition, &Snapshot),
        errors: ErrorBudget,
    ) -> Option<(Motion, f64)> {
        let (step, elapsed) = (&position.step, position.elapsed);
        let errors = relative_errors((system, weights), step, errors)?;
        let mean = |(q, end): (&Pose, &Pose)| 0.5 * (q + end);
        let q: Vec<Pose> = step.motion.q.iter().zip(&state.q).map(mean).collect();
        self.evaluate_force(system, &q);
        let sources = [&step.sources, &state.sources];
        let volts = sources.map(|sources| self.volts(sources));
        let linear = extended([0.0; 2], elapsed, volts, volts[0].powi(2));
        self.set_push(fitted_line([0, 1].map(|k| position.integrals[k] - linear[k]), elapsed));
        let ramp = Ramp::new(&system.electrics, sources[0], sources[1], &[], elapsed)
            .pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let mut h = step.trial_step;
        let advanced = self.stepper.advance(
            &mut Bodies::weighed(system, &ramp, weights),
            &mut self.motion,
            &mut h,
            Control::Tolerance(errors.shared_step()),
            MAX_STEPS,
            &mut |_, _, _, _| true,
        );
        matches!(advanced, Ok(Advance::Done)).then(|| (self.motion.clone(), h))
    }

    /// Predicts a macro step: one step of the integrator under the extrapolated voltage.
    fn predict(
        &mut self,
        (system, weights): (&System, &NormWeights),
        step: Arc<MacroStep>,
        errors: ErrorBudget,
    ) -> PredictedStep {
        let failed = |step: Arc<MacroStep>| PredictedStep {
            end: step.motion.clone(),
            step,
            lengths: None,
            acceleration: 0.0,
            allowed: [0.0; 2],
        };
        let Some(relative) = relative_errors((system, weights), &step, errors) else { return failed(step) };
        self.evaluate_force(system, &step.motion.q);
        self.set_push(step.extrapolation.line());
        let ramp = Ramp::new(&system.electrics, &step.sources, &step.sources, &[], step.trial_step)
            .pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let (mut h, mut length) = (step.trial_step, 0.0);
        let advanced = self.stepper.advance(
            &mut Bodies::weighed(system, &ramp, weights),
            &mut self.motion,
            &mut h,
            Control::Tolerance(relative.shared_step()),
            1,
            &mut |_, taken, _, _| {
                length = taken;
                false
            },
        );
        let ends = [&step.motion, &self.motion];
        let allowed = weights.allowed_error(system, ends, relative.within_step());
        let (Ok(_), Some(allowed)) = (advanced, allowed) else { return failed(step) };
        let of_rates = match self.sees_rates {
            true => ErrorBudget::of(errors.rates_within_step()).within(step.peak.rate),
            false => f64::INFINITY,
        };
        PredictedStep {
            step,
            lengths: (length > 0.0).then_some([length, h]),
            end: self.motion.clone(),
            acceleration: self.acceleration(system),
            allowed: [allowed, of_rates],
        }
    }

    /// Prediction of a macro step, from the cache or made again.
    pub(crate) fn predicted(
        &mut self,
        about: (&System, &NormWeights),
        step: &Arc<MacroStep>,
        errors: ErrorBudget,
    ) -> &PredictedStep {
        match self.cache.iter().position(|known| known.step.start == step.start) {
            Some(place) => &self.cache[place],
            None => {
                let predicted = self.predict(about, Arc::clone(step), errors);
                self.store(predicted)
            }
        }
    }

    fn store(&mut self, predicted: PredictedStep) -> &PredictedStep {
        if self.cache.len() == CACHED {
            self.cache.pop_front();
        }
        self.cache.push_back(predicted);
        &self.cache[self.cache.len() - 1]
    }

    /// Start of a macro step at the parent, for points of length `dt` (s). None where it would be too short, or the parent lies in one that was.
    pub(crate) fn begin(
        &mut self,
        about: (&System, &NormWeights),
        (dt, parent, token): (f64, &Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<MacroStepPosition> {
        if parent.pause > 0 || dt * MIN_POINTS > parent.next_step || parent.macro_step.as_deref().is_some_and(is_short)
        {
            return None;
        }
        let predicted = match self.cache.iter().position(|known| known.step.start == token) {
            // by another trial of this point
            Some(place) => &self.cache[place],
            None => {
                let step = self.next_step(about, (parent, token), errors)?;
                let predicted = self.predict(about, Arc::new(step), errors);
                self.store(predicted)
            }
        };
        let [length, _] = predicted.lengths?;
        (dt * MIN_POINTS <= length).then(|| MacroStepPosition {
            step: Arc::clone(&predicted.step),
            elapsed: 0.0,
            points: 0,
            integrals: [0.0; 2],
        })
    }

    /// Macro step from the parent: from the corrected motion where it lies in one.
    fn next_step(
        &mut self,
        about: (&System, &NormWeights),
        (parent, token): (&Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<MacroStep> {
        let displayed = Motion { q: parent.q.clone(), v: parent.v.clone() };
        let (motion, extrapolation, history) = match parent.macro_step.as_deref() {
            None => (displayed.clone(), SquareExtrapolation::default(), 0),
            Some(position) => {
                let (motion, _) = self.correct(about, (position, parent), errors)?;
                let step = &position.step;
                let [start, end] = [&step.sources, &parent.sources].map(|sources| self.volts(sources).powi(2));
                let extrapolation = step.extrapolation.next(position.integrals, position.elapsed, start - end);
                (motion, extrapolation, 1 + step.history.min(1))
            }
        };
        Some(MacroStep {
            start: token,
            motion,
            displayed,
            sources: parent.sources.clone(),
            extrapolation,
            peak: parent.peak,
            history,
            trial_step: parent.next_step,
        })
    }

    /// A state in a macro step with the corrected motion, from which steps without macro steps continue.
    pub(crate) fn corrected_state(
        &mut self,
        about: (&System, &NormWeights),
        (state, token): (&Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<Arc<Snapshot>> {
        if let Some((_, known)) = self.corrected.as_ref().filter(|(of, _)| *of == token) {
            return Some(Arc::clone(known));
        }
        let position = state.macro_step.as_deref()?;
        let (motion, next_step) = self.correct(about, (position, state), errors)?;
        let corrected = Arc::new(Snapshot { q: motion.q, v: motion.v, next_step, ..state.clone() });
        self.corrected = Some((token, Arc::clone(&corrected)));
        Some(corrected)
    }
}

impl PredictedStep {
    /// Bound of the errors of displacements and rates at a time (s) after the start, relative to the allowed ones.
    pub(crate) fn error_bound(&self, elapsed: f64, integrals: [f64; 2]) -> f64 {
        let [rate, displacement] =
            self.step.extrapolation.residual(integrals, elapsed).map(|x| x.abs() * self.acceleration);
        // zero stays zero where the allowed error is zero
        let relative = |error: f64, allowed: f64| if error == 0.0 { 0.0 } else { error / allowed };
        // a sum propagates NaN, a maximum would not
        let bound = relative(displacement, self.allowed[0]) + relative(rate, self.allowed[1]);
        if bound.is_nan() { f64::INFINITY } else { bound }
    }
}

/// Tolerances of a macro step: relative to the motion since the equilibrium in place of the displacement from the drawing.
fn relative_errors(
    (system, weights): (&System, &NormWeights),
    step: &MacroStep,
    errors: ErrorBudget,
) -> Option<ErrorBudget> {
    let whole = weights.allowed_error(system, [&step.motion, &step.motion], 1.0)?;
    let motion = step.peak.displacement;
    (motion > MIN_MOTION * whole).then(|| errors.of_part(motion.min(whole), whole))
}

/// Whether a macro step ended too early, though its extrapolation was based on two before it.
fn is_short(position: &MacroStepPosition) -> bool {
    position.step.history == 2 && f64::from(position.points) < MIN_POINTS
}

/// Largest motion since the equilibrium, after a step from `parent` to `motion`.
pub(crate) fn peak_after(system: &System, parent: &Snapshot, motion: &Motion) -> PeakMotion {
    let squared = |(j, q): (usize, &Pose)| {
        let x = q - parent.origin.get(j).copied().unwrap_or_default();
        system.model.mass(j).component_mul(&x).dot(&x)
    };
    let displacement = motion.q.iter().enumerate().map(squared).sum::<f64>().sqrt();
    let rate = system.model.mass_product(&motion.v, &motion.v).sqrt();
    PeakMotion { displacement: parent.peak.displacement.max(displacement), rate: parent.peak.rate.max(rate) }
}

/// Points without macro steps after a state that lies in none; `exceeded`: the error bound of one was exceeded.
pub(crate) fn pause_after(parent: &Snapshot, exceeded: bool) -> u32 {
    match parent.macro_step.as_deref() {
        Some(position) if is_short(position) => PAUSE,
        Some(_) => 0,
        None if exceeded => PAUSE,
        None => parent.pause.saturating_sub(1),
    }
}
