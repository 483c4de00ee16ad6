//! Two rows of beams that face each other: the field and the contact of [`super::facing`], stretch by stretch, over the bodies
//! of the segments that both are cut into.

use super::approach::MaterialPoint;
use super::contact::touching_distance;
use super::contact_loss::{Loss, fall_at_pull_in};
use super::domain::{Chord, Configuration, Domain};
use super::edge_field::EdgeField;
use super::facing::FacingStretch;
use super::facing_field::FieldForces;
pub use super::facing_local::FacingBeams;
use super::facing_local::SIGNS;
use super::facing_loss;
use super::facing_side::{Flank, Opening, back};
use super::facing_stretches::{CubicStretch, side, stretches};
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::point_law::PointLaw;
use bimorph_multibody::batch::everywhere;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Model, Pattern};
use bimorph_structure::{BeamRows, GapVoltage};
use nalgebra::{Vector2, Vector4};

impl FromStructure for FacingBeams {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        let drawn = &drawing.structure.beam_gaps;
        if drawn.is_empty() {
            return;
        }
        let beams = BeamRows::new(drawing.structure);
        let anchored = drawing.structure.anchored();
        for gap in drawn {
            let normal = gap.angle + gap.side * std::f64::consts::FRAC_PI_2;
            let frame = Opening { axis: Vector2::new(normal.cos(), normal.sin()), side: gap.side };
            let [a, b, c, d] = gap.nodes;
            let sides = [[a, b], [c, d]].map(|nodes| side(&beams, drawing, gap, nodes));
            let cut = stretches(&sides);
            let fixed = [c, d].iter().all(|node| anchored[node.0]);
            let (factor, edges) = EdgeField::of(gap, fixed, drawing.chord);
            let facing = FacingStretch {
                length: gap.length,
                gap: gap.gap,
                strength: gap.permittivity * gap.height * factor,
                edges,
                insulation: gap.insulation,
                height: gap.height,
                touch: gap.touch.unwrap_or(touching_distance(gap.gap)),
                chord: drawing.chord,
                alone: cut.len() == 1,
            };
            let stretches = cut.into_iter().map(|cut| CubicStretch {
                facing: FacingStretch { length: cut.length, ..facing },
                segments: cut.segments,
                weights: cut.weights,
            });
            let (stretches, loss) = (stretches.collect(), Loss::new(&gap.impact));
            put(&gap.name, Some(&gap.voltage), Self::new(frame, sides, stretches, loss));
        }
    }

    fn moved(mut self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        for station in self.sides.iter_mut().flat_map(|side| &mut side.stations) {
            station.point = to(station.point);
        }
        let sides = self.sides.map(|side| Flank::new(side.stations, side.yields));
        Self::new(self.frame, sides, self.stretches, self.loss)
    }
}

impl FacingBeams {
    /// Field at a voltage and contact, added to nothing.
    fn pull_at<'a>(&'a self, at: Configuration<'a>, volts: f64) -> FieldForces<'a> {
        FieldForces {
            beams: self,
            at,
            factor: -0.5 * volts * volts,
            contact: true,
            r: None,
            tangent: None,
            apart: None,
        }
    }
}

impl Domain for FacingBeams {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.sides.iter().flat_map(|side| &side.stations).map(|station| station.point.body).for_each(see);
    }

    fn pairs(&self, mut see: impl FnMut(BodyId, BodyId)) {
        for stretch in &self.stretches {
            let ids = [0, 1].map(|side| self.points(stretch, side).map(|point| point.body));
            let ids = [ids[0][0], ids[0][1], ids[1][0], ids[1][1]];
            for (i, a) in ids.iter().enumerate() {
                ids[..i].iter().for_each(|b| see(*a, *b));
            }
        }
    }

    fn add_force(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) {
        self.add_force_finding_apart(at, volts, r);
    }

    fn add_force_finding_apart(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) -> bool {
        if volts == 0.0 && self.surely_apart(at) {
            return true;
        }
        let mut apart = true;
        if !self.tiles.is_empty() {
            everywhere(FieldForces { r: Some(r), apart: Some(&mut apart), ..self.pull_at(at, volts) });
            return apart;
        }
        self.along(at, |local| {
            let open = local.stretch.facing.apart(&local.z);
            apart &= open;
            if volts != 0.0 || !open {
                self.add(local, local.stretch.facing.load(&local.z, volts), r);
            }
        });
        apart
    }

    fn add_force_change(&self, at: Configuration<'_>, volts: f64, change: f64, r: &mut [Pose]) {
        let factor = -volts * change;
        if !self.tiles.is_empty() {
            return everywhere(FieldForces { factor, contact: false, r: Some(r), ..self.pull_at(at, volts) });
        }
        self.along(at, |local| {
            let first = local.stretch.facing.gradient(&local.z) * factor;
            self.add(local, first, r);
        });
    }

    fn add_tangent(&self, at: Configuration<'_>, volts: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        if !self.tiles.is_empty() {
            return everywhere(FieldForces { tangent: Some((pattern, tangent)), ..self.pull_at(at, volts) });
        }
        self.along(at, |local| {
            if let Some(both) = local.stretch.facing.load_and_stiffness(&local.z, volts) {
                self.add_stiffness(local, both, pattern, tangent);
            }
        });
    }

    fn add_force_and_tangent(
        &self,
        at: Configuration<'_>,
        volts: f64,
        pattern: &Pattern,
        sums: (&mut [Pose], &mut BodyMatrix),
    ) {
        self.add_force_and_tangent_finding_apart(at, volts, pattern, sums);
    }

    fn add_force_and_tangent_finding_apart(
        &self,
        at: Configuration<'_>,
        volts: f64,
        pattern: &Pattern,
        (r, tangent): (&mut [Pose], &mut BodyMatrix),
    ) -> bool {
        if volts == 0.0 && self.surely_apart(at) {
            return true;
        }
        let mut apart = true;
        if !self.tiles.is_empty() {
            everywhere(FieldForces {
                r: Some(r),
                tangent: Some((pattern, tangent)),
                apart: Some(&mut apart),
                ..self.pull_at(at, volts)
            });
            return apart;
        }
        self.along(at, |local| {
            apart &= local.stretch.facing.apart(&local.z);
            if let Some(both) = local.stretch.facing.load_and_stiffness(&local.z, volts) {
                self.add(local, both.0, r);
                self.add_stiffness(local, both, pattern, tangent);
            }
        });
        apart
    }

    fn load_points(&self, at: Configuration<'_>, volts: f64, mut lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        self.along(at, |local| {
            let first = local.stretch.facing.load(&local.z, volts);
            for side in self.moving() {
                let first = back(&local.stretch.weights[side], first) * SIGNS[side];
                for (end, point) in self.points(local.stretch, side).into_iter().enumerate() {
                    lever(*point, self.frame.axis * -first[2 * end]);
                }
            }
        });
    }

    fn capacitance(&self, at: Configuration<'_>) -> f64 {
        self.sum(at, |local| local.stretch.facing.capacitance(&local.z))
    }

    fn capacitance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        self.sum(at, |local| local.stretch.facing.gradient(&local.z).dot(&self.change(local, |id| Model::pose(dq, id))))
    }

    fn pull(&self, at: Configuration<'_>) -> f64 {
        let mut sum = Vector4::zeros();
        self.along(at, |local| sum += local.stretch.facing.gradient(&local.z));
        -(sum[0] + sum[2])
    }

    fn pull_and_change(&self, at: Configuration<'_>, dq: &[Pose]) -> (f64, f64) {
        let (mut sum, mut change) = (Vector4::zeros(), Vector4::zeros());
        self.along(at, |local| {
            let c = local.stretch.facing.at(&local.z);
            sum += c.gradient;
            change += c.hessian * self.change(local, |id| Model::pose(dq, id));
        });
        (-(sum[0] + sum[2]), -(change[0] + change[2]))
    }

    fn add_shape_force(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) -> f64 {
        let (mut begin, mut size) = (0.0, 0.0);
        self.along(at, |local| {
            let CubicStretch { facing, segments, .. } = local.stretch;
            let first = local.stretch.facing.load(&local.z, volts);
            let load = (first[0] + first[2]) / facing.length;
            let bent = |s: f64| -> f64 {
                (0..2).map(|side| self.sides[side].bent(segments[side], begin + s * facing.length, load)).sum()
            };
            let change = facing.shape_force(&local.z, volts, bent);
            size += change[0].abs() + change[2].abs();
            self.add(local, change, r);
            begin += facing.length;
        });
        size
    }

    fn is_electrostatic(&self) -> bool {
        true
    }

    /// The smallest along the beams.
    fn distance(&self, at: Configuration<'_>) -> f64 {
        let mut least = f64::INFINITY;
        self.closest(at, |_, distance, _| least = distance);
        least
    }

    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let mut change = 0.0;
        self.closest(at, |local, _, weights| change = weights.dot(&self.change(local, |id| Model::pose(dq, id))));
        change
    }

    fn touching(&self) -> Option<[f64; 2]> {
        let facing = &self.stretches.first()?.facing;
        Some([facing.touch, facing.least()])
    }

    fn closing_bound(&self, q: &[Pose]) -> f64 {
        self.bound(q)
    }

    fn surely_apart(&self, at: Configuration<'_>) -> bool {
        let Some(facing) = self.stretches.first().map(|stretch| &stretch.facing) else { return true };
        facing.gap - self.bound(at.q) >= facing.touch
    }

    fn bearing(&self, at: Configuration<'_>) -> f64 {
        if self.surely_apart(at) {
            return 0.0;
        }
        self.sum(at, |local| {
            let force = local.stretch.facing.contact(&local.z).0;
            force[0].abs() + force[2].abs()
        })
    }

    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        self.sum(at, |local| {
            if local.stretch.facing.apart(&local.z) {
                return 0.0;
            }
            let (force, stiffness) = local.stretch.facing.contact(&local.z);
            let change = stiffness * self.change(local, |id| Model::pose(dq, id));
            force[0].signum() * change[0] + force[2].signum() * change[2]
        })
    }

    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        if self.surely_apart(at) {
            return 0.0;
        }
        self.sum(at, |local| local.stretch.facing.contact_energy(&local.z))
    }

    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        if self.surely_apart(at) {
            return 0.0;
        }
        self.sum(at, |local| match local.stretch.facing.apart(&local.z) {
            true => 0.0,
            false => local.stretch.facing.contact(&local.z).0.dot(&self.change(local, |id| Model::pose(dq, id))),
        })
    }

    fn loss(&self) -> Option<Loss> {
        Some(self.loss)
    }

    fn set_loss(&mut self, loss: Loss) {
        self.loss = loss;
    }

    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        self.add_force_change(at, 1.0, -1.0, r);
        self.stretches.first().map_or(0.0, |first| fall_at_pull_in(first.facing.gap, first.facing.touch))
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        facing_loss::add(self, at, rate, r);
    }

    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        facing_loss::add_tangent(self, at, rate, to)
    }

    fn add_quotient(&self, chord: &Chord<'_>, volts: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        facing_loss::add_quotient(self, chord, volts, pattern, r, tangent);
    }

    /// Those of the field, then those of the contact, stretch by stretch; none along chords, whose forces do not derive from an energy.
    fn point_laws(&self) -> Vec<PointLaw> {
        if self.stretches.iter().any(|stretch| stretch.facing.chord) {
            return Vec::new();
        }
        self.stretches.iter().flat_map(|stretch| stretch.facing.point_laws(self.loss.coefficient())).collect()
    }

    fn point_approaches(&self, at: Configuration<'_>, mut put: impl FnMut(f64)) {
        self.along(at, |local| {
            let facing = &local.stretch.facing;
            facing.gauss().iter().chain(facing.lobatto()).for_each(|node| put(facing.approach(node, &local.z)));
        });
    }
}
