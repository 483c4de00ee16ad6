//! Shapes that moving anchors excite.
//!
//! A motion of anchors d(t) has the static shape r·d(t), with r that of the unit displacement, and beside it a motion u with
//!
//! ```text
//! M·ü + C·u̇ + K·u = −M·r·d̈
//! ```
//!
//! Where d varies slowly, u is −K⁻¹·M·r·d̈. A jump of the rate ḋ by Δ is a sudden velocity: the mode x, with xᵀMx = 1, begins to swing with the
//! amplitude xᵀMr·Δ/ω. The amplitudes of a beam's modes then fall with the third power of their number.

use super::super::transient::TransientOptions;
use super::signal_amplitudes::reach;
use bimorph_domains::InputWaveform;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix};

/// An anchor that moves in a run.
struct MovedAnchor<'a> {
    /// Its place among the anchors, and its body.
    anchor: usize,
    held: usize,
    /// Along x or y, or about z.
    direction: usize,
    wave: &'a InputWaveform,
}

/// The anchors that move in a run.
fn moved<'a>(model: &'a CompiledModel, options: &'a TransientOptions<'_>) -> impl Iterator<Item = MovedAnchor<'a>> {
    let system = &model.parts.system;
    options.motions.iter().filter_map(|(name, wave)| {
        let (anchor, direction) = system.anchor_source(name).and_then(|source| system.anchor_input(source))?;
        let BodyId::Free(held) = system.anchors[anchor].point.body else { return None };
        Some(MovedAnchor { anchor, held, direction, wave })
    })
}

/// The factor of the stiffness of a run in which anchors move; none for a floating part.
pub(super) fn factored(
    model: &CompiledModel,
    options: &TransientOptions<'_>,
    stiffness: &BodyMatrix,
) -> Option<BodyMatrix> {
    if options.motions.is_empty() {
        return None;
    }
    let of = &model.parts.system.model;
    let mut factor = stiffness.clone();
    of.project_matrix(&mut factor);
    factor.factor(&of.pattern).ok()?;
    Some(factor)
}

/// A motion of an anchor whose rate jumps.
pub(super) struct SuddenAnchorMotion {
    /// The static shape of the anchor's unit displacement, less modes.
    left: Vec<Pose>,
    /// Jump of the rate (m/s or rad/s).
    jump: f64,
    /// Farthest displacement from the start (m or rad).
    farthest: f64,
}

impl SuddenAnchorMotion {
    /// Those of a run.
    pub(super) fn of_run(model: &CompiledModel, options: &TransientOptions<'_>, factor: &BodyMatrix) -> Vec<Self> {
        let system = &model.parts.system;
        let one = |MovedAnchor { anchor, held, direction, wave }: MovedAnchor<'_>| {
            let anchor = &system.anchors[anchor];
            let (arm, k) = (anchor.point.arm, anchor.stiffness[direction]);
            let mut left = vec![Pose::zeros(); system.bodies()];
            left[held] =
                [Pose::new(k, 0.0, -arm.y * k), Pose::new(0.0, k, arm.x * k), Pose::new(0.0, 0.0, k)][direction];
            system.model.project(&mut left);
            factor.solve(&system.model.pattern, &mut left);
            system.model.project(&mut left);
            // the anchor itself moves as it must
            left[held] = Pose::zeros();
            let (jump, farthest) = (wave.jump_of_rate(), (wave.farthest() - wave.at(0.0)[0]).abs());
            Some(Self { left, jump, farthest }).filter(|sudden| sudden.jump > 0.0)
        };
        moved(model, options).filter_map(one).collect()
    }

    /// Amplitude of the mode `x` with xᵀMx = 1 (m·√kg); takes it out of what is left.
    pub(super) fn take_mode(&mut self, model: &CompiledModel, x: &[Pose], omega: f64) -> f64 {
        let share = model.parts.system.model.mass_product(x, &self.left);
        for (left, x) in self.left.iter_mut().zip(x) {
            *left -= x * share;
        }
        share.abs() * self.swing(omega)
    }

    /// The rest of the shape, as it swings beyond `omega` (rad/s).
    pub(super) fn beyond(&self, omega: f64) -> Vec<Pose> {
        self.left.iter().map(|left| left * self.swing(omega)).collect()
    }

    /// How far a motion of unit share swings: no farther than the anchor goes.
    fn swing(&self, omega: f64) -> f64 {
        (self.jump / omega.max(f64::MIN_POSITIVE)).min(self.farthest)
    }
}

/// `way +=` the shapes that moving anchors excite: those of the inertia forces of the whole mechanism moving with them, as large as the motion of
/// each anchor.
pub(super) fn add_driven(model: &CompiledModel, options: &TransientOptions<'_>, factor: &BodyMatrix, way: &mut [Pose]) {
    let system = &model.parts.system;
    for MovedAnchor { anchor, held, direction, wave } in moved(model, options) {
        let mut amplitude = (wave.farthest() - wave.at(0.0)[0]).abs();
        let mut x = vec![Pose::zeros(); system.bodies()];
        let about = system.model.bodies[held].center + system.anchors[anchor].point.arm;
        for (k, (x, body)) in x.iter_mut().zip(&system.model.bodies).enumerate() {
            let arm = body.center - about;
            let moved = [Pose::x(), Pose::y(), Pose::new(-arm.y, arm.x, 1.0)][direction];
            *x = system.model.mass(k).component_mul(&moved);
        }
        if direction == 2 {
            amplitude *= model.structure.extent();
        }
        system.model.project(&mut x);
        factor.solve(&system.model.pattern, &mut x);
        system.model.project(&mut x);
        let size = reach(model, &x);
        if size > 0.0 && size.is_finite() {
            way.iter_mut().zip(&x).for_each(|(way, x)| *way += x * (amplitude / size));
        }
    }
}
