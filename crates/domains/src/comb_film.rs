//! Gas that slides between the fingers of a comb: Couette films that are as long as the fingers overlap.
//! ```text
//! force along the approach = N·μ_eff·h/gap·o(u)·u′
//! ```
//! with the overlap o, which ends smoothly, over a gap, where the comb leaves its stator. Slip is in μ_eff (Veijola and Turowski 2001).
//!
//! Reference: T. Veijola, M. Turowski, "Compact damping models for laterally moving microstructures with gas-rarefaction effects",
//! J. Microelectromech. Syst. 10 (2001) 263–273.

use super::approach::{Approach, MaterialPoint};
use super::domain::{Chord, Configuration, Domain};
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::quotient;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use bimorph_structure::GapVoltage;

/// Gas between fingers.
#[derive(Debug, Clone, PartialEq)]
pub struct CombFilm {
    /// The approach of the comb.
    pub approach: Approach,
    /// Drag per overlap (N·s/m²).
    pub sliding: f64,
    /// Overlap as drawn (m).
    pub overlap: f64,
    /// Half width of the blend at its end (m): one finger gap.
    pub blend: f64,
}

impl CombFilm {
    /// Drag at the approach `u` (m) (N·s/m), and its derivative (N·s/m²).
    fn damping(&self, u: f64) -> (f64, f64) {
        let o = self.overlap + u;
        if o >= self.blend {
            return (self.sliding * o, self.sliding);
        }
        if o <= -self.blend {
            return (0.0, 0.0);
        }
        let s = 0.5 * (o / self.blend + 1.0);
        (self.sliding * self.blend * s * s, self.sliding * s)
    }

    /// The force along the approach u that changes at a rate (m/s), and its derivatives with both.
    fn drag(&self, (u, rate): (f64, f64)) -> (f64, f64, f64) {
        let (c, slope) = self.damping(u);
        (c * rate, slope * rate, c)
    }
}

impl FromStructure for CombFilm {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for comb in drawing.structure.combs.iter().filter(|comb| comb.sliding > 0.0) {
            let approach = drawing.approach(comb.a, comb.b, comb.axis);
            let (sliding, overlap, blend) = (comb.sliding, comb.overlap, comb.gap);
            put(&comb.name, None, Self { approach, sliding, overlap, blend });
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { approach: self.approach.moved(to), ..self }
    }
}

impl Domain for CombFilm {
    type Given = f64;

    fn is_gas(&self) -> bool {
        true
    }

    fn gas_damping(&self, at: Configuration<'_>, dq: &[Pose], _: f64) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        self.approach.change(&m, dq).powi(2) * self.damping(m.value).0
    }

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(see);
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        self.approach.add_force(&m, self.drag((m.value, self.approach.rate(&m, rate))).0, r);
    }

    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        self.approach.add_rate_tangent((at.q, at.linear), rate, |now| self.drag(now), to);
        true
    }

    fn add_quotient(&self, chord: &Chord<'_>, _: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        quotient::add_drag(&self.approach, chord, |now| self.drag(now), pattern, r, tangent);
    }
}
