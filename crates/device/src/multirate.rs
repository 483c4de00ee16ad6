//! Multirate integration of a session: prediction of macro steps, and correction of the motion at their ends ([`crate::macro_step`]).

use crate::Token;
use crate::condensed_response::{CondensedResponse, ForceResponse};
use crate::macro_step::{
    DisplayOffset, MacroStep, MacroStepPosition, PeakMotion, SquareExtrapolation, SquareIntegrals, decay_shares,
    extended, fitted_line, hermite_shares,
};
use crate::states::Snapshot;
use bimorph_analysis::reduced::TRAINED;
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::equations::Bodies;
use bimorph_solve::equations::bodies::NormWeights;
use bimorph_solve::time::adaptive::{Adaptive, Advance, Control};
use bimorph_solve::time::formulated::Formulated;
use bimorph_solve::time::method::Motion;
use bimorph_solve::time::reduced_rodas4::ReducedRodas4;
use bimorph_solve::time::rodas4::Rodas4;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points of the requested length that a macro step must hold (1).
const MIN_POINTS: f64 = 6.0;
/// Steps of the integrator that a macro step holds.
const INTEGRATOR_STEPS: f64 = 2.0;
/// Points without macro steps after one that ended within [`MIN_POINTS`].
const PAUSE: u32 = 64;
/// Largest difference of rows of gap voltages that count as equal (1).
const EQUAL_ROWS: f64 = 1e-12;
/// Most different gap voltages.
const MOST_VOLTAGES: usize = 16;
/// Smallest motion since the equilibrium, relative to the displacement from the drawing, for which macro steps are made (1).
const MIN_MOTION: f64 = 1e-6;
/// Predicted macro steps in the cache.
const CACHED: usize = 2;
/// Internal steps of a correction at most.
const MAX_STEPS: usize = 64;

/// Storage of multirate integration.
#[derive(Debug)]
pub(crate) struct Multirate {
    /// The gap voltages that differ by more than their sign.
    voltages: Vec<SharedVoltage>,
    /// Whether a signal or port shows a rate, or may.
    sees_rates: bool,
    stepper: MacroStepper,
    /// Where voltages act on directions without mass; from the first such force on.
    response: Option<CondensedResponse>,
    /// About the shortest time in which something moves (s).
    shortest: f64,
    drive: Drive,
    change: Drive,
    push: Vec<Pose>,
    push_rate: Vec<Pose>,
    motion: Motion,
    /// Latest predictions. Trials of one point may continue a macro step or begin the next one, by their lengths.
    cache: VecDeque<PredictedStep>,
    /// Latest state that was corrected for steps without macro steps.
    corrected: Option<(Token, Arc<Snapshot>)>,
}

/// Steps of the motion between the sources' values at the start of a macro step, with the forces of squared voltages beside these.
#[derive(Debug)]
pub(crate) enum MacroStepper {
    /// Every body has its own coordinates.
    Bodies(Box<Adaptive<Rodas4>>),
    /// A reduced model.
    Reduced(Box<Adaptive<ReducedRodas4>>),
}

impl MacroStepper {
    /// Of the formulation in which a session steps; none: it has no macro steps.
    pub(crate) fn new(method: &Formulated, reduced: Option<ReducedRodas4>, system: &System) -> Option<Self> {
        let n = system.bodies();
        Some(match (method, reduced) {
            (Formulated::Joints(_), _) => return None,
            (_, Some(reduced)) => Self::Reduced(Box::new(Adaptive::new(n, reduced.with_ports(&[])))),
            (_, None) => Self::Bodies(Box::new(Adaptive::new(n, Rodas4::new(system, &[])))),
        })
    }

    /// Whether a reduced model holds where the last step ended: within the trained amplitude, its polynomials within their part of the tolerance.
    fn holds(&mut self, drive: &Drive) -> bool {
        match self {
            Self::Bodies(_) => true,
            Self::Reduced(stepper) => stepper.method.excess_now() <= TRAINED && stepper.method.holds(drive),
        }
    }

    /// Steps from a motion, at most to the end of the ramp.
    fn advance(
        &mut self,
        bodies: &mut Bodies<'_>,
        motion: &mut Motion,
        h: &mut f64,
        tol: f64,
        observe: &mut dyn FnMut(f64, f64, &Motion) -> bool,
    ) -> Result<Advance, SolveError> {
        let control = Control::Tolerance(tol);
        let mut observe = |t: f64, taken: f64, _: &Motion, after: &Motion| observe(t, taken, after);
        match self {
            Self::Bodies(stepper) => stepper.advance(bodies, motion, h, control, MAX_STEPS, &mut observe),
            Self::Reduced(stepper) => {
                stepper.method.resume(None);
                stepper.advance(bodies, motion, h, control, MAX_STEPS, &mut observe)
            }
        }
    }
}

/// A voltage that lies across some gaps.
#[derive(Debug)]
struct SharedVoltage {
    /// Its change with each source (1).
    row: Vec<f64>,
    /// The gaps.
    gaps: Vec<usize>,
    /// Force on each body per squared voltage (N/V², N·m/V²).
    force: Vec<Pose>,
    /// Force over the directions of a reduced model per squared voltage (√(N·m)/V²); empty with every body's own coordinates.
    over_directions: Vec<f64>,
}

impl SharedVoltage {
    /// Its value (V).
    fn volts(&self, sources: &[f64]) -> f64 {
        self.row.iter().zip(sources).map(|(row, source)| row * source).sum()
    }

    /// Acceleration per squared voltage, in the norm of masses; infinite where a gap acts on a direction without mass.
    fn acceleration(&self, system: &System) -> f64 {
        let squared = |(j, force): (usize, &Pose)| -> f64 {
            let mass = system.model.mass(j);
            force.iter().zip(mass.iter()).filter(|(f, _)| **f != 0.0).map(|(f, m)| f * f / m).sum()
        };
        self.force.iter().enumerate().map(squared).sum::<f64>().sqrt()
    }
}

/// Prediction of a macro step.
#[derive(Debug)]
pub(crate) struct PredictedStep {
    step: Arc<MacroStep>,
    /// Times since its start at which its two steps of the integrator end (s), and the proposed next step (s); none where one failed.
    pub(crate) ends: Option<([f64; 2], f64)>,
    /// Motions there.
    motions: [Motion; 2],
    /// Responses per square of each voltage.
    responses: Vec<ForceResponse>,
    /// Allowed errors at points of displacements, rates and displacements of directions without mass, in the norm of masses.
    allowed: [f64; 3],
}

impl Multirate {
    /// None for a mechanism with heaters, floating conductors or mechanical inputs, without gap voltages, or with gaps that act on directions with neither mass
    /// nor springs. Nothing moves in less than about `shortest` (s).
    pub(crate) fn new(system: &System, sees_rates: bool, stepper: MacroStepper, shortest: f64) -> Option<Self> {
        let electrics = &system.electrics;
        let (heating, others) = (&electrics.heating, electrics.inputs.len());
        if heating.states() > 0 || heating.means() > 0 || others > 0 || !electrics.floating.is_empty() {
            return None;
        }
        let n = system.bodies();
        let voltages = gap_voltages(system);
        if voltages.is_empty() || voltages.len() > MOST_VOLTAGES {
            return None;
        }
        let mut multirate = Self {
            // the current of a port at a constant voltage is that of the motion
            sees_rates: sees_rates || voltages.len() > 1,
            voltages,
            stepper,
            response: None,
            shortest,
            drive: electrics.drive(),
            change: electrics.drive(),
            push: vec![Pose::zeros(); n],
            push_rate: vec![Pose::zeros(); n],
            motion: Motion::zeros(n),
            cache: VecDeque::with_capacity(CACHED),
            corrected: None,
        };
        let rest = vec![Pose::zeros(); n];
        multirate.evaluate_forces(system, &rest);
        multirate.tangent_is_needed(system);
        let drive = electrics.drive();
        multirate.response.as_mut().is_none_or(|response| response.begin(system, &rest, &drive)).then_some(multirate)
    }

    /// Whether a voltage acts on a direction without mass, with storage for its response then.
    fn tangent_is_needed(&mut self, system: &System) -> bool {
        let is_needed = self.voltages.iter().any(|voltage| voltage.acceleration(system).is_infinite());
        if is_needed && self.response.is_none() {
            self.response = Some(CondensedResponse::new(system, self.shortest));
        }
        is_needed
    }

    /// Responses per square of each voltage to the forces that were evaluated, with the tangent at displacements `q` and sources; infinite without one.
    fn responses(&mut self, about: (&System, &NormWeights), q: &[Pose], sources: &[f64]) -> Vec<ForceResponse> {
        let system = about.0;
        let is_needed = self.tangent_is_needed(system);
        let Self { voltages, response, drive, .. } = self;
        let mut tangent = response.as_mut().filter(|_| is_needed);
        if let Some(response) = &mut tangent {
            system.electrics.apply(sources, &[], drive);
            if !response.begin(system, q, drive) {
                tangent = None;
            }
        }
        let of = |voltage: &SharedVoltage| {
            let free = ForceResponse { acceleration: voltage.acceleration(system), displacement: 0.0 };
            match &mut tangent {
                Some(response) if free.acceleration.is_infinite() => response.of(about, &voltage.force),
                _ => free,
            }
        };
        voltages.iter().map(of).collect()
    }

    /// Number of voltages across gaps.
    pub(crate) fn voltages(&self) -> usize {
        self.voltages.len()
    }

    /// Adds a time `dt` (s) over which the sources go linearly `from` some values `to` others to the integrals of a macro step.
    pub(crate) fn extend(&self, step: &MacroStep, integrals: &mut [SquareIntegrals], dt: f64, [from, to]: [&[f64]; 2]) {
        for (voltage, integrals) in self.voltages.iter().zip(integrals) {
            let start = voltage.volts(&step.sources).powi(2);
            *integrals = extended(*integrals, dt, [voltage.volts(from), voltage.volts(to)], start);
        }
    }

    /// Evaluates the force per square of each voltage at displacements `q`.
    fn evaluate_forces(&mut self, system: &System, q: &[Pose]) {
        self.change.load = 0.0;
        for SharedVoltage { gaps, force, over_directions, .. } in &mut self.voltages {
            self.drive.volts.fill(0.0);
            self.change.volts.fill(0.0);
            for &gap in &*gaps {
                // r contains −½·V²·∇C
                (self.drive.volts[gap], self.change.volts[gap]) = (1.0, 0.5);
            }
            system.drive_force(q, &self.drive, &self.change, force);
            force.iter_mut().for_each(|force| *force = -*force);
            if let MacroStepper::Reduced(stepper) = &mut self.stepper {
                *over_directions = stepper.method.drive_force(q, &self.drive, &self.change);
            }
        }
    }

    /// Sets the external force to that of squared voltages which are linear in time: values (V²) and slopes (V²/s).
    fn set_push(&mut self, lines: impl Iterator<Item = [f64; 2]>) {
        let Self { voltages, push, push_rate, stepper, .. } = self;
        push.fill(Pose::zeros());
        push_rate.fill(Pose::zeros());
        if let MacroStepper::Reduced(stepper) = stepper {
            let lines = voltages.iter().zip(lines).map(|(voltage, line)| (&voltage.over_directions[..], line));
            return stepper.method.set_push(lines);
        }
        for (voltage, [value, slope]) in voltages.iter().zip(lines).filter(|(_, line)| *line != [0.0; 2]) {
            for ((push, rate), force) in push.iter_mut().zip(&mut *push_rate).zip(&voltage.force) {
                *push += force * value;
                *rate += force * slope;
            }
        }
    }

    /// Motion at a state in a macro step, corrected with the integrals of squared voltages, and the proposed next step (s). Sources are linear between both
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
        self.evaluate_forces(system, &q);
        let sources = [&step.sources[..], &state.sources[..]];
        let mut linear = vec![[0.0; 2]; self.voltages.len()];
        self.extend(step, &mut linear, elapsed, sources);
        let residual = |(found, linear): (&SquareIntegrals, &SquareIntegrals)| {
            fitted_line([0, 1].map(|k| found[k] - linear[k]), elapsed)
        };
        self.set_push(position.integrals.iter().zip(&linear).map(residual));
        let ramp = Ramp::new(&system.electrics, sources[0], sources[1], &[], elapsed)
            .pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let mut h = step.trial_step;
        let advanced = self.stepper.advance(
            &mut Bodies::weighed(system, &ramp, weights),
            &mut self.motion,
            &mut h,
            errors.shared_step(),
            &mut |_, _, _| true,
        );
        matches!(advanced, Ok(Advance::Done)).then(|| (self.motion.clone(), h))
    }

    /// Predicts a macro step: two steps of the integrator under the extrapolated voltages.
    fn predict(
        &mut self,
        (system, weights): (&System, &NormWeights),
        step: Arc<MacroStep>,
        errors: ErrorBudget,
    ) -> PredictedStep {
        let failed = |step: Arc<MacroStep>| PredictedStep {
            motions: [step.motion.clone(), step.motion.clone()],
            step,
            ends: None,
            responses: Vec::new(),
            allowed: [0.0; 3],
        };
        let Some(relative) = relative_errors((system, weights), &step, errors) else { return failed(step) };
        self.evaluate_forces(system, &step.motion.q);
        let responses = self.responses((system, weights), &step.motion.q, &step.sources);
        self.set_push(step.extrapolations.iter().map(|square| square.line()));
        let longest = INTEGRATOR_STEPS * step.trial_step;
        let ramp = Ramp::new(&system.electrics, &step.sources, &step.sources, &[], longest)
            .pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let (mut h, mut ends, mut middle) = (step.trial_step, Vec::new(), None);
        let advanced = self.stepper.advance(
            &mut Bodies::weighed(system, &ramp, weights),
            &mut self.motion,
            &mut h,
            relative.shared_step(),
            &mut |t, taken, after| {
                ends.push(t + taken);
                middle.get_or_insert_with(|| after.clone());
                ends.len() < 2
            },
        );
        let mut drive = self.drive.clone();
        ramp.at(ends.last().copied().unwrap_or_default(), &mut drive);
        let holds = self.stepper.holds(&drive);
        let allowed = |tol: f64| weights.allowed_error(system, [&step.motion, &self.motion], tol).filter(|_| holds);
        let allowed = allowed(relative.within_step()).zip(allowed(relative.rates_within_step()));
        let (Ok(_), Some((of_masses, of_others)), Some(middle), &[first, last]) =
            (advanced, allowed, middle, &ends[..])
        else {
            return failed(step);
        };
        let of_rates = match self.sees_rates {
            true => ErrorBudget::of(errors.rates_within_step()).within(step.peak.rate),
            false => f64::INFINITY,
        };
        PredictedStep {
            step,
            ends: (first > 0.0 && last > first).then_some(([first, last], h)),
            motions: [middle, self.motion.clone()],
            responses,
            allowed: [of_masses, of_rates, of_others],
        }
    }

    /// Prediction of a macro step, from the cache or made again, with the error bound ([`PredictedStep::error_bound`]) at a time (s) after its start, where
    /// sources have some values and squared voltages some integrals.
    pub(crate) fn predicted(
        &mut self,
        about: (&System, &NormWeights),
        (step, elapsed, integrals): (&Arc<MacroStep>, f64, &[SquareIntegrals]),
        sources: &[f64],
        errors: ErrorBudget,
    ) -> (&PredictedStep, f64) {
        let place = self.cache.iter().position(|known| known.step.start == step.start).unwrap_or_else(|| {
            let predicted = self.predict(about, Arc::clone(step), errors);
            self.store(predicted);
            self.cache.len() - 1
        });
        let (predicted, voltages) = (&self.cache[place], &self.voltages);
        let change = |k: usize| {
            let [now, start] = [sources, &step.sources].map(|sources| voltages[k].volts(sources).powi(2));
            now - start
        };
        (predicted, predicted.error_bound(elapsed, integrals, &change))
    }

    fn store(&mut self, predicted: PredictedStep) -> &PredictedStep {
        if self.cache.len() == CACHED {
            self.cache.pop_front();
        }
        self.cache.push_back(predicted);
        &self.cache[self.cache.len() - 1]
    }

    /// Whether a macro step may begin at the parent for points of length `dt` (s): by the steps of the integrator it is long enough, and the parent lies in
    /// none that was too short.
    pub(crate) fn may_begin(dt: f64, parent: &Snapshot) -> bool {
        parent.pause == 0
            && dt * MIN_POINTS <= INTEGRATOR_STEPS * parent.next_step
            && !parent.macro_step.as_deref().is_some_and(is_short)
    }

    /// Start of a macro step at the parent, for points of length `dt` (s). None where it would be too short.
    pub(crate) fn begin(
        &mut self,
        about: (&System, &NormWeights),
        (dt, parent, token): (f64, &Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<MacroStepPosition> {
        let voltages = self.voltages.len();
        let predicted = match self.cache.iter().position(|known| known.step.start == token) {
            // by another trial of this point
            Some(place) => &self.cache[place],
            None => {
                let step = self.next_step(about, (parent, token), errors)?;
                let predicted = self.predict(about, Arc::new(step), errors);
                self.store(predicted)
            }
        };
        let ([_, length], _) = predicted.ends?;
        (dt * MIN_POINTS <= length).then(|| MacroStepPosition {
            step: Arc::clone(&predicted.step),
            elapsed: 0.0,
            points: 0,
            integrals: vec![[0.0; 2]; voltages],
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
        let (motion, extrapolations, history) = match parent.macro_step.as_deref() {
            None => (integrated(parent), vec![SquareExtrapolation::default(); self.voltages.len()], 0),
            Some(position) => {
                let (motion, _) = self.correct(about, (position, parent), errors)?;
                let step = &position.step;
                let next = |(k, square): (usize, &SquareExtrapolation)| {
                    let [start, end] =
                        [&step.sources, &parent.sources].map(|sources| self.voltages[k].volts(sources).powi(2));
                    square.next(position.integrals[k], position.elapsed, start - end)
                };
                (motion, step.extrapolations.iter().enumerate().map(next).collect(), 1 + step.history.min(1))
            }
        };
        Some(MacroStep {
            start: token,
            motion,
            displayed,
            sources: parent.sources.clone(),
            extrapolations,
            peak: parent.peak,
            history,
            trial_step: parent.next_step,
        })
    }

    /// A state with the integrated motion, from which steps without macro steps continue, and with the offset of the displayed motion. None where both are
    /// the same.
    pub(crate) fn integrated_state(
        &mut self,
        about: (&System, &NormWeights),
        (state, token): (&Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<Arc<Snapshot>> {
        if let Some((_, known)) = self.corrected.as_ref().filter(|(of, _)| *of == token) {
            return Some(Arc::clone(known));
        }
        let (Motion { q, v }, next_step, offset) = match state.macro_step.as_deref() {
            None => (integrated(state), state.next_step, state.offset.clone()?),
            Some(position) => {
                let (motion, next_step) = self.correct(about, (position, state), errors)?;
                let offset = DisplayOffset::between([&state.q, &state.v], &motion, next_step);
                (motion, next_step, Box::new(offset))
            }
        };
        let corrected = Arc::new(Snapshot { q, v, next_step, offset: Some(offset), ..state.clone() });
        self.corrected = Some((token, Arc::clone(&corrected)));
        Some(corrected)
    }
}

/// The motion that steps continue from: the displayed one less its offset.
fn integrated(state: &Snapshot) -> Motion {
    let mut motion = Motion { q: state.q.clone(), v: state.v.clone() };
    if let Some(offset) = &state.offset {
        offset.add(-1.0, &mut motion);
    }
    motion
}

/// The different voltages across gaps, with their gaps.
fn gap_voltages(system: &System) -> Vec<SharedVoltage> {
    let mut voltages: Vec<SharedVoltage> = Vec::new();
    for (gap, row) in system.electrics.gap_rows.row_iter().enumerate() {
        if row.iter().all(|x| *x == 0.0) {
            continue;
        }
        let equal = |voltage: &&mut SharedVoltage| {
            [1.0, -1.0].iter().any(|sign| row.iter().zip(&voltage.row).all(|(a, b)| (a - sign * b).abs() <= EQUAL_ROWS))
        };
        match voltages.iter_mut().find(equal) {
            Some(voltage) => voltage.gaps.push(gap),
            None => {
                let force = vec![Pose::zeros(); system.bodies()];
                let row = row.iter().copied().collect();
                voltages.push(SharedVoltage { row, gaps: vec![gap], force, over_directions: Vec::new() });
            }
        }
    }
    voltages
}

impl PredictedStep {
    /// Sets the displayed motion at a time (s) after the start, which `ends` at the given times.
    pub(crate) fn display(&self, ends: [f64; 2], elapsed: f64, out: &mut Motion) {
        let MacroStep { motion, displayed, .. } = &*self.step;
        let ([start, middle, end], nodes) = (hermite_shares(ends, elapsed), [&self.motions[0], &self.motions[1]]);
        let [of_q, of_v] = decay_shares(elapsed, ends[1]);
        for j in 0..out.q.len() {
            let ([q, v], [shown_q, shown_v]) = ([motion.q[j], motion.v[j]], [displayed.q[j], displayed.v[j]]);
            let (off_q, off_v) = (shown_q - q, shown_v - v);
            let at = |k: usize| {
                let mut sum = q * start[0][k] + v * start[1][k] + off_q * of_q[k] + off_v * of_v[k];
                for (node, shares) in nodes.iter().zip([middle, end]) {
                    sum += node.q[j] * shares[0][k] + node.v[j] * shares[1][k];
                }
                sum
            };
            (out.q[j], out.v[j]) = (at(0), at(1));
        }
    }

    /// Bound of the errors of displacements and rates at a time (s) after the start, relative to the allowed ones; `change` is that of the square of a voltage
    /// since then (V²).
    fn error_bound(&self, elapsed: f64, integrals: &[SquareIntegrals], change: &dyn Fn(usize) -> f64) -> f64 {
        let mut errors = [0.0; 3];
        let squares = self.step.extrapolations.iter().zip(integrals).zip(&self.responses);
        for (k, ((square, integrals), response)) in squares.enumerate() {
            let [rate, displacement] = square.residual(*integrals, elapsed).map(|x| x.abs() * response.acceleration);
            let follows = match response.displacement {
                0.0 => 0.0,
                by_square => {
                    let [value, slope] = square.line();
                    (change(k) - value - slope * elapsed).abs() * by_square
                }
            };
            errors.iter_mut().zip([displacement, rate, follows]).for_each(|(sum, error)| *sum += error);
        }
        // zero stays zero where the allowed error is zero
        let relative = |(error, allowed): (&f64, &f64)| if *error == 0.0 { 0.0 } else { error / allowed };
        // a sum propagates NaN, a maximum would not
        let bound: f64 = errors.iter().zip(&self.allowed).map(relative).sum();
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
