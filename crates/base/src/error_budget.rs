//! The one place that divides a tolerance: what each source of error may use of it, with the reason.
//!
//! A result has errors of its mesh, of its modes and of its steps. Each estimate has been compared with the true error, and where it was found
//! smaller than that, it may use only a part of the tolerance (docs/project/accuracy.md). Everything else asks here and multiplies no tolerance itself.

/// A relative tolerance, and its division.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBudget {
    requested: f64,
}

impl ErrorBudget {
    /// Fraction of the tolerance for estimates of modes by the next term of the dynamic stiffness: they were found smaller than the error, by up to
    /// a factor of 2.9 where short wide beams matter.
    const MODES: f64 = 0.36;
    /// Fraction of the tolerance for estimates by comparison with twice the segments: they were found up to a quarter smaller than the error.
    const COMPARISON: f64 = 0.75;
    /// Fraction of a goal that predictions for meshes that were not run may use.
    const PREDICTION: f64 = 0.9;
    /// Fraction of the tolerance below which the error of a group of beams decides nothing.
    const MINOR: f64 = 0.1;
    /// Remaining error of the first order over the estimate of a comparison, which assumes the second order.
    const FIRST_ORDER: f64 = 1.5;
    /// Fraction of the tolerance for meshes that confirm a choice.
    const CONFIRMATION: f64 = 0.5;
    /// Fraction of the tolerance for permanent strains: the equilibrium after them uses the rest.
    const STRAINS: f64 = 0.25;
    /// Fraction of the tolerance for the mesh of a large motion: its estimate is a difference of two runs.
    const LARGE_MOTION: f64 = 0.6;
    /// Error of the steps of a run, of the error of its mesh by a difference of two, from which on steps may be the reason for it.
    const OF_DIFFERENCE: f64 = 0.25;
    /// Exponent with which a tolerance falls for a smaller error of the steps.
    const PER_ERROR: f64 = 1.0 / 0.6;
    /// Fraction of the tolerance that one step may use: errors of many steps add up.
    const STEP: f64 = 1e-2;
    /// The same for a step that many points share: points with steps of their own would be far nearer.
    const SHARED_STEP: f64 = 1e-3;
    /// Fraction of the tolerance by which points within a step may be off its motion. This does not add up.
    const WITHIN_STEP: f64 = 1e-2;
    /// The same of rates.
    const RATES_WITHIN_STEP: f64 = 0.05;
    /// Least fraction of the tolerance that is left to the steps beside the mesh.
    const LEAST_FOR_STEPS: f64 = 0.35;
    /// Fraction of that for an error that a run propagates. Both errors may have one sign: of 320 runs of random mechanisms one would exceed its tolerance at 0.85, by 4 %.
    const PROPAGATED: f64 = 0.8;
    /// Ratio of the tolerance of a companion run to that of the run.
    const COMPANION: f64 = 10.0;
    /// The sharpest steps of a run that chooses a mesh, of the tolerance: about what the run itself needs whose first steps miss it by as much.
    const STALLED_MESH_RUN: f64 = 0.03;
    /// Loosest tolerance of a companion run, and of a run that chooses a mesh.
    const LOOSEST: [f64; 2] = [0.3, 0.1];
    /// Least ratio of the tolerance of a companion run to that of the run: a nearer one takes much the same steps.
    const LEAST_COMPANION: f64 = 2.0;
    /// Reserve for the error of a run from its difference to a companion that is hardly looser: errors fall slower than tolerances.
    const RESERVE: f64 = 1.2;
    /// Fraction of what the mesh leaves that the next run aims at: the exponent of the error is an estimate.
    const AIM: f64 = 0.7;
    /// Tolerances between a run and its companion up to which single values hold: the companion has ten times the tolerance.
    const AFTER_CONTACT: f64 = 10.0;
    /// Smallest amplitude of a motion with an estimate, in floors of the error of a step: below it an error relative to the amplitude is noise.
    const RESOLVED: f64 = 10.0;
    /// Ratio of the requested tolerance to the sharpest that the steps of a repeated run take.
    const MOST_SHARPER: f64 = 99.0;
    /// Fraction of the tolerance below which the amplitude of a mode is negligible.
    const NEGLIGIBLE_AMPLITUDE: f64 = 0.3;
    /// Fraction of the error that no mesh mends (motion outside the modes, missing rotary inertia) that each mode may add: it stays the largest.
    const UNRESOLVED: f64 = 0.3;
    /// Range of errors that a frequency may have: the sharpest mesh that is sought, and where the phase of a mode is lost.
    const FREQUENCY: [f64; 2] = [1e-8, 0.3];
    /// Ratio of the tolerance of each mesh that is tried in a circuit to that of the one before, where that is too fine.
    const RELAXATION: f64 = 10.0;
    /// How often a tolerance is relaxed so.
    const MAX_RELAXATIONS: i32 = 3;
    /// Fractions of the tolerance for meshes that points of a sweep share, from coarse to fine: each leaves a margin for the other points.
    const SHARED_MESHES: [f64; 3] = [0.6, 0.2, 0.06];
    /// Rotation of a body within a step over the root of the tolerance (rad/√1), from which on a step in joint coordinates solves twice.
    const TURN: f64 = 0.03;
    /// Fraction of the tolerance for the equations of an implicit stage.
    const STAGE: f64 = 1e-2;
    /// Fraction of the tolerance for the statics of a reduced model.
    const REDUCED_STATICS: f64 = 0.3;
    const STATICS_BEYOND: f64 = 0.1;
    /// Ratio of the error of the polynomials of a reduced run to that of the run before, with which it is compared.
    const NEXT_POLYNOMIALS: f64 = 0.3;
    /// Fraction of the tolerance below which singular values, relative to the largest, are left out of a reduced model: for statics, whose
    /// check adds what is lacking, and for motion, which passes through states that no equilibrium has.
    const SINGULAR_VALUES: [f64; 2] = [0.3, 0.02];
    /// Fractions of the tolerance below which a direction without mass adds nothing to a reduced model: of the energy norm of a motion, and of its mass norm. A direction
    /// with mass may matter more than its share, and two runs without it do not show that.
    const NEGLIGIBLE_DIRECTION: [f64; 2] = [0.1, 1e-3];
    /// Fraction of the tolerance for the forces of a field at fewer points.
    const REDUCED_FIELD: f64 = 0.1;
    /// Change of a mass of a file from which it varies.
    const MASS: f64 = 0.02;
    /// Share of the motion after a step of an input from which a file has a mode. Its static directions have what is left out, at
    /// another frequency.
    const SUDDEN_MODE: f64 = 10.0;
    /// Root mean square of a strain of closures that a polynomial model leaves out, over the root of the tolerance (√E): energies go with its square.
    const CLOSURES: f64 = 0.03;
    /// The same for soft coordinates, which may see strains whose energy is small beside that of stiff ones.
    const FINE_CLOSURES: f64 = 0.003;
    /// Fraction of the tolerance below which approaches of electrodes, relative to the largest, are left out of a polynomial model: forces
    /// grow steeply with them.
    const APPROACHES: f64 = 3e-3;
    /// Multiple of the tolerance, of its range, by which a quantity of a circuit may depart from the line of its step. At the default it is
    /// 0.2 %, or 28 points for a cycle of full amplitude, which then stays within 0.5 %.
    const BEND: f64 = 2.0;
    /// The same of a charge. Only its change matters: with even steps the trapezoidal rule keeps that within 0.2 % of its range, with 28
    /// points a cycle. (Without them an oscillator that its own current drives takes 43 points a cycle where it takes 36.)
    const BEND_OF_CHARGES: f64 = 3.6;
    /// Estimates above this multiple of the tolerance are reported: the display has two digits.
    const REPORTED: f64 = 1.05;

    /// The division of a tolerance.
    pub fn of(tolerance: f64) -> Self {
        Self { requested: tolerance }
    }

    /// The division of a multiple or a fraction of this tolerance.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { requested: factor * self.requested }
    }

    /// The tolerance as requested (1).
    pub fn requested(self) -> f64 {
        self.requested
    }

    /// The tolerance of a quantity of this size, in its unit.
    #[inline]
    pub fn within(self, size: f64) -> f64 {
        self.requested * size
    }

    /// The part of the tolerance that an error of a quantity of this size uses (1); both in one unit.
    #[inline]
    pub fn used(self, error: f64, size: f64) -> f64 {
        error / (self.requested * size)
    }

    /// The scale of a quantity that has a tolerance `own`. An error over the scale and the tolerance is the error over the quantity and `own`.
    pub fn scale(self, quantity: f64, own: f64) -> f64 {
        quantity * own / self.requested
    }

    /// The rotation of a body within a step that counts (rad): an error goes with its square.
    pub fn turn(self) -> f64 {
        Self::TURN * self.requested.sqrt()
    }

    /// Parts of a whole whose relative error is the tolerance, where that of a part h is h⁴ over a coefficient.
    pub fn parts(self, whole: f64, coefficient: f64) -> f64 {
        whole / (coefficient * self.requested).powf(0.25)
    }

    /// The size of which an error, caused by rounding, is the tolerance.
    pub fn size_of(self, error: f64) -> f64 {
        error / self.requested
    }

    /// Whether an error is within the tolerance.
    pub fn holds(self, error: f64) -> bool {
        error <= self.requested
    }

    /// Whether an estimate exceeds the tolerance by more than its display rounds.
    pub fn is_exceeded(self, estimate: f64) -> bool {
        // an estimate that is not a number exceeds every tolerance
        estimate.is_nan() || estimate > Self::REPORTED * self.requested
    }

    /// For an estimate by comparison with twice the segments.
    pub fn comparison(self) -> f64 {
        Self::COMPARISON * self.requested
    }

    /// For the prediction of such an estimate, on a mesh that was not run.
    pub fn predicted_comparison(self) -> f64 {
        Self::PREDICTION * Self::COMPARISON * self.requested
    }

    /// For a prediction.
    pub fn prediction(self) -> f64 {
        Self::PREDICTION * self.requested
    }

    /// Below it the error of a group of beams decides nothing.
    pub fn minor(self) -> f64 {
        Self::MINOR * self.requested
    }

    /// For an estimate of modes.
    pub fn modes(self) -> f64 {
        Self::MODES * self.requested
    }

    /// Remaining error over such an estimate, for a mesh that was chosen for so many times the tolerance.
    pub fn of_modes_estimate(times: f64) -> f64 {
        times * Self::MODES
    }

    /// For the frequency of a mode that contributes to a result with this weight.
    pub fn frequency(self, weight: f64) -> f64 {
        (self.requested / weight.max(f64::MIN_POSITIVE)).clamp(Self::FREQUENCY[0], Self::FREQUENCY[1])
    }

    /// For the estimate of such a frequency, whose tolerance this is.
    pub fn frequency_estimate(self) -> f64 {
        self.modes().max(Self::FREQUENCY[0])
    }

    /// How many times the tolerance the modes may use beside an error that no mesh mends (1).
    pub fn beside(self, error: f64) -> f64 {
        (Self::UNRESOLVED * error / self.requested).max(1.0)
    }

    /// Tolerances for the mesh of a circuit, which takes the first that is not too fine.
    pub fn relaxed(self) -> impl Iterator<Item = Self> {
        (0..=Self::MAX_RELAXATIONS).map(move |k| self.scaled(Self::RELAXATION.powi(k)))
    }

    /// For the meshes that points of a sweep share, from coarse to fine.
    pub fn shared_meshes(self) -> [f64; 3] {
        Self::SHARED_MESHES.map(|fraction| fraction * self.requested)
    }

    /// Remaining error over the estimate of a comparison, for errors of the first order.
    pub fn of_first_order_estimate() -> f64 {
        Self::FIRST_ORDER
    }

    /// For a comparison of errors of the first order.
    pub fn first_order(self) -> f64 {
        self.requested / Self::FIRST_ORDER
    }

    /// For a mesh that confirms a choice.
    pub fn confirmation(self) -> f64 {
        Self::CONFIRMATION * self.requested
    }

    /// For permanent strains.
    pub fn strains(self) -> f64 {
        Self::STRAINS * self.requested
    }

    /// For the mesh of a large motion.
    pub fn large_motion(self) -> f64 {
        Self::LARGE_MOTION * self.requested
    }

    /// For the steps of a run that chooses the mesh of a large motion.
    pub fn mesh_run(self) -> f64 {
        (Self::COMPANION * self.requested).min(Self::LOOSEST[1]).max(self.requested)
    }

    /// The tolerance, of that of such a run.
    pub fn of_mesh_run(self) -> f64 {
        self.requested / self.mesh_run()
    }

    /// The division of the tolerance of the steps of such a run.
    #[must_use]
    pub fn mesh_runs(self) -> Self {
        Self::of(self.mesh_run())
    }

    /// The division for such runs again, whose steps had the division `before` and an error `own`: where their difference makes an error `found` of
    /// the mesh that is too large, and steps may be the reason. Not beyond the requested tolerance, unless a finer mesh did not help: it `stalls`.
    #[must_use]
    pub fn sharper_mesh_runs(self, before: Self, own: f64, (found, stalls): (f64, bool)) -> Option<Self> {
        let goal = self.large_motion();
        let least = if stalls { self.scaled(Self::STALLED_MESH_RUN) } else { self };
        let matters = found > goal && own > Self::OF_DIFFERENCE * found && before.requested > least.requested;
        let aim = Self::of(Self::OF_DIFFERENCE * goal).aim(own);
        matters.then(|| before.scaled(aim.min(1.0).powf(Self::PER_ERROR)).max(least))
    }

    fn max(self, least: Self) -> Self {
        Self::of(self.requested.max(least.requested))
    }

    /// For one step of an integrator.
    pub fn step(self) -> f64 {
        Self::STEP * self.requested
    }

    /// For one step that many points share.
    pub fn shared_step(self) -> f64 {
        Self::SHARED_STEP * self.requested
    }

    /// For a quantity that is a `part` of a whole, relative to the `whole`; both in one unit.
    pub fn of_part(self, part: f64, whole: f64) -> Self {
        Self { requested: self.requested * part / whole }
    }

    /// For what points within a step leave out.
    pub fn within_step(self) -> f64 {
        Self::WITHIN_STEP * self.requested
    }

    /// The same for rates.
    pub fn rates_within_step(self) -> f64 {
        Self::RATES_WITHIN_STEP * self.requested
    }

    /// For the steps of a companion run.
    pub fn companion(self) -> f64 {
        (Self::COMPANION * self.requested).min(Self::LOOSEST[0])
    }

    /// Whether the steps of a companion run differ enough from those of the run.
    pub fn has_companion(self) -> bool {
        self.has_as_companion(Self::of(self.companion()))
    }

    /// The same of steps with this division.
    pub fn has_as_companion(self, looser: Self) -> bool {
        looser.requested >= Self::LEAST_COMPANION * self.requested
    }

    /// Part of the difference between a run and its companion, whose steps have the division `looser`, that bounds the error of the run, if errors are in
    /// proportion to tolerances (1).
    pub fn of_difference_to(self, looser: Self) -> f64 {
        Self::RESERVE / (looser.requested / self.requested - 1.0)
    }

    /// Ratio by which the error of the next run is to differ from this one, where this is the tolerance of the steps.
    pub fn aim(self, error: f64) -> f64 {
        Self::AIM * self.requested / error
    }

    /// For the difference between a run and its companion after a contact, in a signal of this size.
    pub fn after_contact(self, size: f64) -> f64 {
        Self::AFTER_CONTACT * self.requested * size
    }

    /// Smallest amplitude with an estimate, where a step counts the part `floor` of this size at least.
    pub fn resolved(self, floor: f64, size: f64) -> f64 {
        Self::RESOLVED * self.step() * floor * size
    }

    /// The error of a step in what is as small as the part `floor`, which it counts at least.
    pub fn step_at_least(self, floor: f64) -> f64 {
        self.step() * floor
    }

    /// For a run that is repeated because its steps missed the tolerance.
    pub fn sharper_run(self) -> f64 {
        self.requested / Self::COMPANION
    }

    /// The sharpest tolerance that the steps of a repeated run take.
    pub fn sharpest_run(self) -> f64 {
        self.requested / Self::MOST_SHARPER
    }

    /// The amplitude below which a mode is negligible.
    pub fn negligible_amplitude(self) -> f64 {
        Self::NEGLIGIBLE_AMPLITUDE * self.requested
    }

    /// For the equations of an implicit stage, where the steps have this tolerance.
    pub fn stage(self) -> f64 {
        Self::STAGE * self.requested
    }

    /// For the statics of a reduced model.
    pub fn reduced_statics(self) -> f64 {
        Self::REDUCED_STATICS * self.requested
    }

    /// The same beyond a pull-in, where capacitances depend on what is left of gaps.
    pub fn statics_beyond(self) -> f64 {
        Self::STATICS_BEYOND * self.requested
    }

    /// For the polynomials of a reduced run after one with this division.
    #[must_use]
    pub fn next_polynomials(self) -> Self {
        self.scaled(Self::NEXT_POLYNOMIALS)
    }

    /// The singular value below which a reduced model leaves a direction out; `moves`: it is for motion too.
    pub fn singular_value(self, moves: bool, largest: f64) -> f64 {
        Self::SINGULAR_VALUES[usize::from(moves)] * self.requested * largest
    }

    /// Whether a direction that takes these parts of a motion, of its energy norm and of its mass norm (1), is negligible.
    pub fn is_negligible_direction(self, parts: [f64; 2]) -> bool {
        parts.into_iter().zip(Self::NEGLIGIBLE_DIRECTION).all(|(part, least)| part < least * self.requested)
    }

    /// For the forces of a field at fewer points.
    pub fn reduced_field(self) -> f64 {
        Self::REDUCED_FIELD * self.requested
    }

    /// Relative change of a mass below which a file has it constant (1).
    pub fn constant_mass(self) -> f64 {
        Self::MASS * self.requested
    }

    /// Share of the motion after a step of an input below which a file leaves out a mode (1).
    pub fn sudden_mode(self) -> f64 {
        Self::SUDDEN_MODE * self.requested
    }

    /// Strains of closures that a polynomial model leaves out (√E).
    pub fn closures(self) -> f64 {
        Self::CLOSURES * self.requested.sqrt()
    }

    /// The same where soft coordinates see strains that are left out there (√E).
    pub fn fine_closures(self) -> f64 {
        Self::FINE_CLOSURES * self.requested.sqrt()
    }

    /// Approaches of electrodes that it leaves out, in the unit of the largest.
    pub fn approaches(self, largest: f64) -> f64 {
        Self::APPROACHES * self.requested * largest
    }

    /// For the departure of a quantity, over its range, from the line of a step of a circuit.
    pub fn bend(self) -> f64 {
        Self::BEND * self.requested
    }

    /// The same for a charge.
    pub fn bend_of_charges(self) -> f64 {
        Self::BEND_OF_CHARGES * self.requested
    }

    /// The scale of a comparison that fails at this difference. A comparison divides by a part of the scale and allows a part of the tolerance,
    /// both those of [`ErrorBudget::comparison`].
    pub fn scale_of_comparison(self, difference: f64) -> f64 {
        difference / (Self::COMPARISON * Self::COMPARISON * self.requested)
    }

    /// For the steps, beside a mesh with this error: the two are independent, so that their squares add.
    pub fn left_for_steps(self, mesh: Option<f64>) -> f64 {
        match mesh {
            Some(mesh) if mesh <= self.requested => {
                let part = mesh / self.requested;
                (1.0 - part * part).sqrt().max(Self::LEAST_FOR_STEPS) * self.requested
            }
            _ => self.requested,
        }
    }

    /// The part of that for an error which a run propagates. A comparison of two runs needs no such reserve.
    pub fn left_for_propagated(self, mesh: Option<f64>) -> f64 {
        Self::PROPAGATED * self.left_for_steps(mesh)
    }
}

#[cfg(test)]
mod tests {
    //! The parts of a tolerance are within it, and what the mesh leaves is never nothing.
    use super::*;

    #[test]
    fn parts_are_within_the_whole() {
        for tolerance in [1e-12, 1e-3, 0.5] {
            let budget = ErrorBudget::of(tolerance);
            let parts = [budget.comparison(), budget.predicted_comparison(), budget.prediction(), budget.modes()];
            let more =
                [budget.first_order(), budget.confirmation(), budget.strains(), budget.large_motion(), budget.step()];
            assert!(parts.iter().chain(&more).all(|part| *part > 0.0 && budget.holds(*part)));
            assert!(budget.predicted_comparison() < budget.comparison());
            assert!(budget.mesh_run() >= tolerance);
            assert!(!budget.is_exceeded(1.04 * tolerance) && budget.is_exceeded(1.06 * tolerance));
            assert!(budget.is_exceeded(f64::NAN) && !budget.holds(f64::NAN));
            for mesh in [None, Some(0.0), Some(0.5 * tolerance), Some(tolerance), Some(2.0 * tolerance)] {
                let left = budget.left_for_steps(mesh);
                assert!(left >= 0.29 * tolerance && left <= tolerance, "{mesh:?}: {left}");
            }
        }
    }
}
