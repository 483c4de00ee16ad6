//! The macro steps of a session ([`crate::macro_step`]): how they are made, and how the motion comes to the start of the next one.

use crate::Token;
use crate::macro_step::{Expected, InMacroStep, MacroStep, line, moments, zeros};
use crate::states::Snapshot;
use bimorph_base::ErrorBudget;
use bimorph_domains::drive::Electrics;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_solve::equations::Bodies;
use bimorph_solve::equations::bodies::NormWeights;
use bimorph_solve::time::adaptive::{Adaptive, Advance, Control};
use bimorph_solve::time::method::Motion;
use bimorph_solve::time::rodas4::Rodas4;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points of this length that a step of the motion must hold (1).
const LEAST_POINTS: f64 = 6.0;
/// Points after a macro step of fewer points than [`LEAST_POINTS`] before another one is made.
const PAUSE: u32 = 64;
/// Groups of gaps with one voltage at most: a motion that is left out shows in the current of another pair, which is differentiated over short points.
const MAX_PAIRS: usize = 1;
/// Relative difference of two voltages that are one (1).
const SAME: f64 = 1e-12;
/// Motion since the equilibrium that a macro step follows, of the whole displacement (1).
const LEAST_REACH: f64 = 1e-6;
/// Macro steps that are kept.
const KEPT: usize = 2;
/// Internal steps from the start of a macro step to a point within it at most.
const MAX_STEPS: usize = 64;

/// Storage for the trials of macro steps.
#[derive(Debug)]
pub(crate) struct Multirate {
    /// Gaps with one voltage, and its change with each source.
    pairs: Vec<(Vec<usize>, Vec<f64>)>,
    /// Rates are seen.
    sees_rates: bool,
    stepper: Adaptive<Rodas4>,
    drive: Drive,
    unit: Drive,
    /// Force of each group for a squared voltage of 1 V².
    patterns: Vec<Vec<Pose>>,
    push: Vec<Pose>,
    push_rate: Vec<Pose>,
    motion: Motion,
    /// The last steps: of one point, trials of one length may go on in a step where those of another begin one.
    known: VecDeque<Flight>,
    /// The last state in a macro step that was left, as the motion has come there.
    pub(crate) left: Option<(Token, Arc<Snapshot>)>,
}

/// A macro step as it is expected.
#[derive(Debug)]
pub(crate) struct Flight {
    step: Arc<MacroStep>,
    /// Its length, and that of the step that would come next (s); none where the motion has none.
    pub(crate) lengths: Option<[f64; 2]>,
    /// The motion at its end.
    pub(crate) end: Motion,
    /// Products of the accelerations by two groups, in the norm of masses.
    gram: Vec<f64>,
    /// Displacements and rates that points may leave out, in that norm.
    may: [f64; 2],
}

impl Multirate {
    /// None where no macro steps can be made.
    pub(crate) fn new(system: &System, sees_rates: bool) -> Option<Self> {
        let electrics = &system.electrics;
        if electrics.heating.states() > 0 || electrics.heating.means() > 0 || !electrics.floating.is_empty() {
            return None;
        }
        let pairs = pairs_of(electrics);
        if pairs.is_empty() || pairs.len() > MAX_PAIRS {
            return None;
        }
        let n = system.bodies();
        let mut found = Self {
            patterns: vec![zeros(n); pairs.len()],
            sees_rates,
            pairs,
            stepper: Adaptive::new(n, Rodas4::new(system, &[])),
            drive: electrics.drive(),
            unit: electrics.drive(),
            push: zeros(n),
            push_rate: zeros(n),
            motion: Motion::zeros(n),
            known: VecDeque::with_capacity(KEPT),
            left: None,
        };
        found.find_patterns(system, &zeros(n));
        found.products(system).iter().all(|product| product.is_finite()).then_some(found)
    }

    /// Groups of gaps with one voltage.
    pub(crate) fn pairs(&self) -> usize {
        self.pairs.len()
    }

    /// Voltage of a group (V).
    pub(crate) fn volts(&self, pair: usize, sources: &[f64]) -> f64 {
        self.pairs[pair].1.iter().zip(sources).map(|(row, source)| row * source).sum()
    }

    /// Fills in the force of each group at displacements `q`, for 1 V².
    fn find_patterns(&mut self, system: &System, q: &[Pose]) {
        for ((gaps, _), pattern) in self.pairs.iter().zip(&mut self.patterns) {
            self.drive.volts.fill(0.0);
            self.unit.volts.fill(0.0);
            self.unit.load = 0.0;
            for &gap in gaps {
                // r has −½·V²·∇C
                (self.drive.volts[gap], self.unit.volts[gap]) = (1.0, 0.5);
            }
            system.drive_force(q, &self.drive, &self.unit, pattern);
            pattern.iter_mut().for_each(|force| *force = -*force);
        }
    }

    /// Sum of the forces of the groups, each times the first and the second of its `sizes`.
    fn fill_push(&mut self, sizes: impl Fn(usize) -> [f64; 2]) {
        self.push.fill(Pose::zeros());
        self.push_rate.fill(Pose::zeros());
        for (k, pattern) in self.patterns.iter().enumerate() {
            let [value, slope] = sizes(k);
            for ((push, rate), force) in self.push.iter_mut().zip(&mut self.push_rate).zip(pattern) {
                *push += force * value;
                *rate += force * slope;
            }
        }
    }

    /// Where the motion is at the parent, under the moments of the voltages up to there, and the step that would come next (s). The sources go along lines
    /// from those at the start; what these leave of the moments acts halfway.
    pub(crate) fn arrive(
        &mut self,
        (system, weights): (&System, &NormWeights),
        (place, parent): (&InMacroStep, &Snapshot),
        errors: ErrorBudget,
    ) -> Option<(Motion, f64)> {
        let (step, since) = (&place.step, place.since);
        let errors = Self::tolerances((system, weights), step, errors)?;
        let halfway = |(q, end): (&Pose, &Pose)| 0.5 * (q + end);
        let q: Vec<Pose> = step.motion.q.iter().zip(&parent.q).map(halfway).collect();
        self.find_patterns(system, &q);
        let ends = [&step.sources, &parent.sources];
        let rest: Vec<[f64; 2]> = (0..self.pairs.len())
            .map(|k| {
                let volts = ends.map(|sources| self.volts(k, sources));
                let of_line = moments([0.0; 2], since, volts, volts[0].powi(2));
                line([0, 1].map(|i| place.moments[k][i] - of_line[i]), since)
            })
            .collect();
        self.fill_push(|k| rest[k]);
        let ramp = Ramp::new(&system.electrics, ends[0], ends[1], &[], since).pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let mut h = step.first;
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

    /// The tolerances of a macro step, which are relative to how far the motion has gone since its equilibrium.
    fn tolerances(
        (system, weights): (&System, &NormWeights),
        step: &MacroStep,
        errors: ErrorBudget,
    ) -> Option<ErrorBudget> {
        let still = Ramp::new(&system.electrics, &step.sources, &step.sources, &[], 1.0);
        let whole = Bodies::weighed(system, &still, weights).allowed([&step.motion, &step.motion], 1.0)?;
        (step.reach > LEAST_REACH * whole).then(|| errors.of_part(step.reach.min(whole), whole))
    }

    /// Makes a macro step under the expected forces.
    fn fly(&mut self, (system, weights): (&System, &NormWeights), step: Arc<MacroStep>, errors: ErrorBudget) -> Flight {
        let Some(relative) = Self::tolerances((system, weights), &step, errors) else {
            return Flight { end: step.motion.clone(), step, lengths: None, gram: Vec::new(), may: [0.0; 2] };
        };
        self.find_patterns(system, &step.motion.q);
        self.fill_push(|k| step.expected[k].line());
        let ramp = Ramp::new(&system.electrics, &step.sources, &step.sources, &[], step.first)
            .pushed_along(&self.push, &self.push_rate);
        self.motion.copy(&step.motion);
        let (mut h, mut length) = (step.first, 0.0);
        let bodies = &mut Bodies::weighed(system, &ramp, weights);
        let advanced = self.stepper.advance(
            bodies,
            &mut self.motion,
            &mut h,
            Control::Tolerance(relative.shared_step()),
            1,
            &mut |_, taken, _, _| {
                length = taken;
                false
            },
        );
        let may = bodies.allowed([&step.motion, &self.motion], relative.within_step());
        let lengths = may.filter(|_| advanced.is_ok() && length > 0.0).map(|_| [length, h]);
        let gram = match lengths {
            Some(_) => self.products(system),
            None => Vec::new(),
        };
        let rates = match self.sees_rates {
            true => ErrorBudget::of(errors.rates_within_step()).within(step.fastest),
            false => f64::INFINITY,
        };
        Flight { step, lengths, end: self.motion.clone(), gram, may: [may.unwrap_or(0.0), rates] }
    }

    /// Products of the accelerations that the groups make, in the norm of masses; infinite where a gap pulls what has no mass.
    fn products(&self, system: &System) -> Vec<f64> {
        let product = |a: &[Pose], b: &[Pose]| -> f64 {
            let of = |(j, (a, b)): (usize, (&Pose, &Pose))| -> f64 {
                let mass = system.model.mass(j);
                let parts = a.iter().zip(b.iter()).zip(mass.iter());
                parts.filter(|((a, b), _)| **a != 0.0 && **b != 0.0).map(|((a, b), m)| a * b / m).sum()
            };
            a.iter().zip(b).enumerate().map(of).sum()
        };
        self.patterns.iter().flat_map(|a| self.patterns.iter().map(move |b| product(a, b))).collect()
    }
}

impl Flight {
    /// Displacements and rates that points have left out at most, over those that they may.
    pub(crate) fn left_out(&self, since: f64, moments: &[[f64; 2]]) -> f64 {
        let missed: Vec<[f64; 2]> = self
            .step
            .expected
            .iter()
            .zip(moments)
            .map(|(expected, moments)| expected.missed(*moments, since))
            .collect();
        let n = moments.len();
        let part = |order: usize| {
            let product = |i: usize| self.gram[i] * missed[i / n][order] * missed[i % n][order];
            let size = (0..n * n).map(product).sum::<f64>().max(0.0).sqrt();
            // nothing is left out of nothing
            if size == 0.0 { 0.0 } else { size / self.may[1 - order] }
        };
        // a sum: the larger of the two would hide what is not a number
        let size = part(0) + part(1);
        if size.is_nan() { f64::INFINITY } else { size }
    }
}

/// Gaps with one voltage each, without those that have none.
fn pairs_of(electrics: &Electrics) -> Vec<(Vec<usize>, Vec<f64>)> {
    let rows = &electrics.gap_rows;
    let mut pairs: Vec<(Vec<usize>, Vec<f64>)> = Vec::new();
    for gap in 0..rows.nrows() {
        let row: Vec<f64> = rows.row(gap).iter().copied().collect();
        if row.iter().all(|x| *x == 0.0) {
            continue;
        }
        let alike =
            |(_, other): &&mut (Vec<usize>, Vec<f64>)| other.iter().zip(&row).all(|(a, b)| (a - b).abs() <= SAME);
        match pairs.iter_mut().find(alike) {
            Some((gaps, _)) => gaps.push(gap),
            None => pairs.push((vec![gap], row)),
        }
    }
    pairs
}

impl Multirate {
    /// The macro step as it is expected, made unless it is known.
    pub(crate) fn flight(
        &mut self,
        about: (&System, &NormWeights),
        step: &Arc<MacroStep>,
        errors: ErrorBudget,
    ) -> &Flight {
        match self.known.iter().position(|flight| flight.step.start == step.start) {
            Some(place) => &self.known[place],
            None => {
                let flight = self.fly(about, Arc::clone(step), errors);
                self.keep(flight)
            }
        }
    }

    /// Puts a step among the last ones.
    fn keep(&mut self, flight: Flight) -> &Flight {
        if self.known.len() == KEPT {
            self.known.pop_front();
        }
        self.known.push_back(flight);
        &self.known[self.known.len() - 1]
    }

    /// A macro step that begins at the parent, for a point of length `dt` (s).
    pub(crate) fn begin(
        &mut self,
        about: (&System, &NormWeights),
        (dt, parent, token): (f64, &Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<InMacroStep> {
        let zero = vec![[0.0; 2]; self.pairs.len()];
        let at_start = |flight: &Flight| {
            let [length, _] = flight.lengths?;
            let fits = dt * LEAST_POINTS <= length;
            fits.then(|| InMacroStep { step: Arc::clone(&flight.step), since: 0.0, points: 0, moments: zero })
        };
        if parent.pause > 0 || dt * LEAST_POINTS > parent.next_step {
            return None;
        }
        if let Some(known) = self.known.iter().find(|flight| flight.step.start == token) {
            // of another trial of this point
            return at_start(known);
        }
        let step = match &parent.macro_step {
            None => MacroStep {
                start: token,
                motion: Motion { q: parent.q.clone(), v: parent.v.clone() },
                offset: Motion::zeros(parent.q.len()),
                sources: parent.sources.clone(),
                expected: vec![Expected::default(); self.pairs.len()],
                fastest: parent.fastest,
                reach: parent.reach,
                informed: 0,
                first: parent.next_step,
            },
            Some(place) => {
                if is_short(place) {
                    return None;
                }
                let (motion, _) = self.arrive(about, (place, parent), errors)?;
                let mut offset = Motion { q: parent.q.clone(), v: parent.v.clone() };
                offset.add(-1.0, &motion);
                let expected = (0..self.pairs.len())
                    .map(|k| {
                        let [then, now] = [&place.step.sources, &parent.sources].map(|s| self.volts(k, s).powi(2));
                        place.step.expected[k].after(place.moments[k], place.since, then - now)
                    })
                    .collect();
                MacroStep {
                    start: token,
                    motion,
                    offset,
                    sources: parent.sources.clone(),
                    expected,
                    fastest: parent.fastest,
                    reach: parent.reach,
                    informed: 1 + place.step.informed.min(1),
                    first: parent.next_step,
                }
            }
        };
        let flight = self.fly(about, Arc::new(step), errors);
        at_start(self.keep(flight))
    }
}

/// Whether a macro step was not worth its making: the voltages were as two before it suggest for few points alone.
fn is_short(place: &InMacroStep) -> bool {
    place.step.informed == 2 && f64::from(place.points) < LEAST_POINTS
}

/// Largest norms so far of the motion since the equilibrium, displacements and rates, after a state of the parent's.
pub(crate) fn largest_after(system: &System, parent: &Snapshot, motion: &Motion) -> [f64; 2] {
    let away = |(j, q): (usize, &Pose)| {
        let x = q - parent.origin.get(j).copied().unwrap_or_default();
        system.model.mass(j).component_mul(&x).dot(&x)
    };
    let moved = motion.q.iter().enumerate().map(away).sum::<f64>().sqrt();
    let rate = system.model.mass_product(&motion.v, &motion.v).sqrt();
    [parent.reach.max(moved), parent.fastest.max(rate)]
}

/// Points until a macro step may begin after a state of the parent's; `much` was left out of one that the state would lie in.
pub(crate) fn pause_after(parent: &Snapshot, much: bool) -> u32 {
    match &parent.macro_step {
        Some(place) if is_short(place) => PAUSE,
        Some(_) => 0,
        None if much => PAUSE,
        None => parent.pause.saturating_sub(1),
    }
}
