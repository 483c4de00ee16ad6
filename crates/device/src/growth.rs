//! How fast a motion runs away at fixed voltages, where only the charge of a gap holds it.
//!
//! A plate that is charged beyond a third of its gap is unstable at a fixed voltage and stable at a fixed charge. A circuit that gives it
//! its charge finds the voltage at the end of each step by the derivative of the charge, in which the response of the motion grows as
//! e^(λh) over a step h. With λh above a few the voltage within the step, a straight line, is no longer that of the charge, and the plate comes
//! to stand elsewhere. So steps are bounded by 1/λ.
//!
//! Let s be the response of the motion to a voltage, dominated by the growing motion. Then λ is the positive root of
//! (sᵀMs)·λ² + (sᵀDs)·λ + sᵀKs = 0, with the stiffness K at fixed voltages, the mass M and the damping D. A negative
//! sᵀKs proves K indefinite, without a factorization. Rayleigh's quotient errs by the square of what s has of other
//! motions.

use bimorph_domains::{Drive, System};
use bimorph_multibody::forces;
use bimorph_multibody::planar::Pose;

/// Growth over one step that the circuit may take next (1).
const NEXT: f64 = 1.0;
/// Growth over a step beyond which its result is not used (1).
const MAX: f64 = 3.0;
/// Length of the difference that stands for K·s, as a fraction of the model's length scale (1).
const DIFFERENCE: f64 = 1e-5;

/// Growth rates of the last trials.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Growth {
    /// Rate at the state of the last trial (1/s); 0 where it is stable.
    rate: f64,
    /// Length of the step to it (s).
    step: f64,
    /// ∫λ dt over the accepted states in a row that are unstable (1).
    grown: f64,
}

/// Step bound for the circuit from the growth rate of a step.
pub(super) enum Bound {
    /// The longest next step (s).
    Next(f64),
    /// This step was too long; the longest one (s).
    This(f64),
}

impl Growth {
    /// After a trial over a step (s) to a state with this rate (1/s).
    pub(super) fn tried(&mut self, rate: f64, step: f64) -> Bound {
        (self.rate, self.step) = (rate, step);
        if rate * step > MAX { Bound::This(NEXT / rate) } else { Bound::Next(NEXT / rate) }
    }

    /// After the last trial was accepted: time constant (s) of a motion that the charge alone has held for a long time.
    /// A transit from one stable state to another is shorter, with a growth of e^15 or so.
    pub(super) fn held(&mut self) -> Option<f64> {
        /// Growth beyond any transit (1).
        const HELD: f64 = 40.0;
        self.grown = if self.rate > 0.0 { self.grown + self.rate * self.step } else { 0.0 };
        (self.grown > HELD).then(|| self.rate.recip())
    }
}

/// Storage for a rate, allocated once.
#[derive(Debug, Clone)]
pub(super) struct Difference {
    moved: Vec<Pose>,
    force: [Vec<Pose>; 2],
}

impl Difference {
    /// For so many bodies.
    pub(super) fn new(count: usize) -> Self {
        let zeros = vec![Pose::zeros(); count];
        Self { moved: zeros.clone(), force: [zeros.clone(), zeros] }
    }
}

/// The rate (1/s) at `q` along the response `s` of the motion; 0 where its stiffness at fixed voltages is positive.
pub(super) fn rate_along(
    system: &System,
    drive: &Drive,
    (q, s): (&[Pose], &[Pose]),
    Difference { moved, force }: &mut Difference,
) -> f64 {
    let largest = s.iter().map(|s| s.xy().norm()).fold(0.0, f64::max);
    if largest.is_nan() || largest == 0.0 || largest.is_infinite() {
        return 0.0;
    }
    let scale = DIFFERENCE * system.length_scale / largest;
    for (force, sign) in force.iter_mut().zip([1.0, -1.0]) {
        for ((moved, q), s) in moved.iter_mut().zip(q).zip(s) {
            *moved = q + s * (sign * scale);
        }
        system.residual(moved, drive, force);
    }
    let dot = |x: &[Pose]| s.iter().zip(x).map(|(s, x)| s.dot(x)).sum::<f64>();
    let stiffness = (dot(&force[0]) - dot(&force[1])) / (2.0 * scale);
    if stiffness >= 0.0 || stiffness.is_nan() {
        return 0.0;
    }
    let mass = system.model.mass_product(s, s);
    force[0].fill(Pose::zeros());
    forces::add_damping(&system.model, s, &mut force[0]);
    let damping = dot(&force[0]).max(0.0);
    let root = (damping * damping - 4.0 * mass * stiffness).sqrt();
    if damping + root > 0.0 { -2.0 * stiffness / (damping + root) } else { 0.0 }
}

/// Warning about a port whose charge alone holds the motion.
pub(super) fn held_by_charge(seconds: f64) -> String {
    format!(
        "only the charge holds the mechanism here: at a fixed voltage its motion would grow e-fold in {seconds:.2e} s, and the circuit's \
         steps are kept to that time"
    )
}
