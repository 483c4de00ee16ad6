//! The squeeze film between facing beams: strips that follow the gap along the beams ([`super::squeeze_film`]).
//!
//! The gas flows out across the height of the beams. Each point of the field's rule has the damping per length of a strip as wide as the beams
//! are high, times β of the whole rectangle for the flow at its ends: exact for parallel beams.

use super::approach::MaterialPoint;
use super::domain::{Chord, Configuration, Domain};
use super::facing::FacingStretch;
use super::facing_local::{FacingBeams, Local};
use super::facing_loss::{Derivatives, along_chord};
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::point_law::PointLaw;
use super::squeeze_film::SqueezeFilm;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Model, Pattern};
use bimorph_structure::GapVoltage;
use nalgebra::{Matrix4, Vector4};

/// Gas between two rows of beams.
#[derive(Debug, Clone, PartialEq)]
pub struct FacingFilm {
    /// The beams.
    pub beams: FacingBeams,
    /// c per length (N·s/m²), as that of a gap of 1 m.
    pub film: SqueezeFilm,
    /// Force of the ambient pressure per length (N/m).
    pub ambient: f64,
}

impl FacingFilm {
    /// Force over z where it is `z` and changes at `rate`, with its derivatives with both.
    fn drag(&self, facing: &FacingStretch, z: &Vector4<f64>, rate: &Vector4<f64>) -> (Derivatives, Matrix4<f64>) {
        let (mut first, mut by_z, mut by_rate) = (Vector4::zeros(), Matrix4::zeros(), Matrix4::zeros());
        for node in facing.gauss() {
            let n = Vector4::from(node.shape).component_mul(&facing.scale());
            let film = self.film.part(facing.length * node.weight);
            let ((c, slope), opening) = (film.damping(facing.distance(node, z)), n.dot(rate));
            first += n * (c * opening);
            let square = n * n.transpose();
            by_z += square * (slope * opening);
            by_rate += square * c;
        }
        ((first, by_z), by_rate)
    }

    /// The same of a stretch at a configuration, with the rate of each body.
    fn drag_at(&self, local: &Local<'_>, rate: &impl Fn(usize) -> Pose) -> (Derivatives, Matrix4<f64>) {
        let of = |id: BodyId| if let BodyId::Free(k) = id { rate(k) } else { Pose::zeros() };
        self.drag(&local.stretch.facing, &local.z, &self.beams.change(local, of))
    }
}

impl FromStructure for FacingFilm {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        let mut drawn = drawing.structure.beam_gaps.iter();
        if drawn.all(|gap| gap.gas.is_none()) {
            return;
        }
        let mut gaps = drawing.structure.beam_gaps.iter();
        FacingBeams::lay(drawing, |name, _, beams| {
            let gap = gaps.next().and_then(|gap| Some((gap, gap.gas.as_ref()?)));
            if let Some((gap, gas)) = gap {
                let film = SqueezeFilm::new(gas, gap.gap, gap.touch).part(1.0 / gap.length);
                put(name, None, Self { beams, film, ambient: gas.pressure * gap.height });
            }
        });
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { beams: self.beams.moved(to), ..self }
    }
}

impl Domain for FacingFilm {
    type Given = f64;

    fn is_gas(&self) -> bool {
        true
    }

    fn film_pressure(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose) -> f64 {
        let of = |id: BodyId| if let BodyId::Free(k) = id { rate(k) } else { Pose::zeros() };
        let mut most = 0.0f64;
        self.beams.along(at, |local| {
            let (facing, zt) = (&local.stretch.facing, self.beams.change(local, of));
            for node in facing.gauss() {
                let opening = Vector4::from(node.shape).component_mul(&facing.scale()).dot(&zt);
                most = most.max((self.film.damping(facing.distance(node, &local.z)).0 * opening).abs());
            }
        });
        most / self.ambient
    }

    fn gas_damping(&self, at: Configuration<'_>, dq: &[Pose], _: f64) -> f64 {
        self.beams.sum(at, |local| {
            let rate = self.beams.change(local, |id| Model::pose(dq, id));
            self.drag(&local.stretch.facing, &local.z, &rate).0.0.dot(&rate)
        })
    }

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.beams.bodies(see);
    }

    fn pairs(&self, see: impl FnMut(BodyId, BodyId)) {
        self.beams.pairs(see);
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        self.beams.along(at, |local| self.beams.add(local, self.drag_at(local, rate).0.0, r));
    }

    /// That the rates of z change with rotations is left out, as in the loss of contact.
    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        self.beams.along(at, |local| {
            let (force, by_rate) = self.drag_at(local, rate);
            self.beams.add_stiffness(local, force, to.pattern, to.stiffness);
            self.beams.add_stiffness(local, (Vector4::zeros(), by_rate), to.pattern, to.damping);
        });
        true
    }

    fn point_laws(&self) -> Vec<PointLaw> {
        let of = |facing: &FacingStretch| {
            let (film, drawn, length) = (self.film, facing.gap, facing.length);
            facing.gauss().iter().map(move |node| PointLaw {
                law: None,
                loss: 0.0,
                film: Some((drawn, film.part(length * node.weight))),
            })
        };
        self.beams.stretches.iter().flat_map(|stretch| of(&stretch.facing)).collect()
    }

    fn point_approaches(&self, at: Configuration<'_>, mut put: impl FnMut(f64)) {
        self.beams.along(at, |local| {
            let facing = &local.stretch.facing;
            facing.gauss().iter().for_each(|node| put(facing.approach(node, &local.z)));
        });
    }

    /// Its work over a step is never negative: c at the middle of the step times the mean rate.
    fn add_quotient(&self, chord: &Chord<'_>, _: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let law = |facing: &FacingStretch, [z0, z1]: [&Vector4<f64>; 2]| {
            let ((first, by_z), by_rate) = self.drag(facing, &((z0 + z1) * 0.5), &((z1 - z0) / chord.h));
            (first, by_z * 0.5 + by_rate / chord.h)
        };
        along_chord(&self.beams, chord, law, pattern, r, tangent);
    }
}
