//! Energy loss of the contact between facing beams: [`super::contact_loss`] at each point of the contact's rule that is pressed; and the
//! discrete forces of field and contact over a step ([`super::quotient`]).

use super::contact_loss::Loss;
use super::domain::{Chord, Configuration, Domain};
use super::edge_field::EdgeField;
use super::facing::FacingStretch;
use super::facing_local::{FacingBeams, Local};
use super::facing_side::Deflection;
use super::loss_tangent::LossTangent;
use super::quotient::quotient;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use nalgebra::{Matrix4, Vector4};

/// Forces of z and their derivatives.
pub(super) type Derivatives = (Vector4<f64>, Matrix4<f64>);

impl FacingStretch {
    /// Points of the contact's rule that are pressed: ∂g/∂z, the force (N) and its derivative with the distance (N/m).
    fn pressed(&self, z: &Vector4<f64>) -> impl Iterator<Item = (Vector4<f64>, f64, f64)> {
        let points = if self.apart(z) { &[] } else { self.lobatto() };
        points.iter().filter_map(move |node| {
            let g = self.distance(node, z);
            (g < self.touch).then(|| {
                let (force, slope) = self.piece(node.weight).force(g);
                (Vector4::from(node.shape).component_mul(&self.scale()), force, slope)
            })
        })
    }

    /// Discrete force over z and its derivative with the end of a step of length `h` (s) from `z0` to `z1`: of the field at `volts` (V), and of
    /// the contact with its `loss`.
    fn discrete(&self, [z0, z1]: [&Vector4<f64>; 2], (volts, h): (f64, f64), loss: &Loss) -> Derivatives {
        let (mut first, mut second) = (Vector4::zeros(), Matrix4::zeros());
        let (scale, (gap, closest)) = (self.scale(), self.open());
        let field = if volts == 0.0 { &[] } else { self.gauss() };
        for node in field {
            let (n, m) = (Vector4::from(node.shape).component_mul(&scale), self.measure(node).component_mul(&scale));
            let k = -0.5 * volts * volts * self.strength * self.length * node.weight;
            let plain = matches!(self.edges, EdgeField::None);
            let energy = |g: f64| {
                let d = g.max(closest);
                if plain { k * (1.0 / d + (d - g) / (d * d)) } else { self.across(g, k, closest)[0] }
            };
            let slope = |g: f64| {
                let d = g.max(closest);
                if plain {
                    return (-k / (d * d), if g > closest { 2.0 * k / (d * d * d) } else { 0.0 });
                }
                let [_, first, second] = self.across(g, k, closest);
                (first, second)
            };
            let [g0, g1] = [z0, z1].map(|z| gap + m.dot(z));
            let (force, by_end) = quotient((g0, energy(g0)), (g1, energy(g1)), slope);
            first += n * force;
            second += (n * m.transpose() + m * n.transpose()) * (0.5 * by_end);
        }
        if self.apart(z0) && self.apart(z1) {
            return (first, second);
        }
        for node in self.lobatto() {
            let (n, piece) = (Vector4::from(node.shape).component_mul(&scale), self.piece(node.weight));
            let [g0, g1] = [z0, z1].map(|z| self.distance(node, z));
            if g0.min(g1) >= self.touch {
                continue;
            }
            let slope = |g: f64| {
                let (force, slope) = piece.force(g);
                (-force, -slope)
            };
            let (force, by_end) = quotient((g0, piece.energy(g0)), (g1, piece.energy(g1)), slope);
            let (added, by_rate) = loss.fraction((g0 - g1) / h);
            first += n * (force * (1.0 + added));
            second += n * n.transpose() * (by_end * (1.0 + added) - force * by_rate / h);
        }
        (first, second)
    }
}

/// Rate-dependent part of the force over z of a stretch, and its derivatives with z and with the rate of z; `None`
/// where nothing is in contact.
fn lost(beams: &FacingBeams, local: &Local<'_>, rate: &impl Fn(usize) -> Pose) -> Option<(Derivatives, Matrix4<f64>)> {
    let facing = &local.stretch.facing;
    if facing.apart(&local.z) {
        return None;
    }
    let of = |id: BodyId| if let BodyId::Free(k) = id { rate(k) } else { Pose::zeros() };
    let (zt, mut pressed) = (beams.change(local, of), false);
    let (mut first, mut by_z, mut by_rate) = (Vector4::zeros(), Matrix4::zeros(), Matrix4::zeros());
    for (n, force, slope) in facing.pressed(&local.z) {
        let (added, by_closing) = beams.loss.fraction(-n.dot(&zt));
        let square = n * n.transpose();
        first -= n * (force * added);
        by_z -= square * (slope * added);
        by_rate += square * (force * by_closing);
        pressed = true;
    }
    pressed.then_some(((first, by_z), by_rate))
}

/// See [`super::domain::Domain::add_loss`].
pub(super) fn add(beams: &FacingBeams, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
    if !beams.loss.is_dissipative() || beams.surely_apart(at) {
        return;
    }
    beams.along(at, |local| {
        if let Some(((first, _), _)) = lost(beams, local, rate) {
            beams.add(local, first, r);
        }
    });
}

/// See [`super::domain::Domain::add_loss_tangent`]. That the rates of z change with rotations is left out: beside the damping over a step it is
/// as small as the rotation over a step.
pub(super) fn add_tangent(
    beams: &FacingBeams,
    at: Configuration<'_>,
    rate: &impl Fn(usize) -> Pose,
    to: &mut LossTangent<'_>,
) -> bool {
    let mut acts = false;
    if beams.loss.is_dissipative() && !beams.surely_apart(at) {
        beams.along(at, |local| {
            if let Some((force, by_rate)) = lost(beams, local, rate) {
                beams.add_stiffness(local, force, to.pattern, to.stiffness);
                beams.add_stiffness(local, (Vector4::zeros(), by_rate), to.pattern, to.damping);
                acts = true;
            }
        });
    }
    acts
}

/// See [`super::domain::Domain::add_quotient`].
pub(super) fn add_quotient(
    beams: &FacingBeams,
    chord: &Chord<'_>,
    volts: f64,
    pattern: &Pattern,
    r: &mut [Pose],
    tangent: &mut BodyMatrix,
) {
    let law = |facing: &FacingStretch, z: [&Vector4<f64>; 2]| facing.discrete(z, (volts, chord.h), &beams.loss);
    along_chord(beams, chord, law, pattern, r, tangent);
}

/// Adds the discrete forces of a law of the stretches, and the symmetric part of their tangent. `law` has z at both ends of the step and gives
/// the force over z with its derivative.
pub(super) fn along_chord(
    beams: &FacingBeams,
    chord: &Chord<'_>,
    law: impl Fn(&FacingStretch, [&Vector4<f64>; 2]) -> Derivatives,
    pattern: &Pattern,
    r: &mut [Pose],
    tangent: &mut BodyMatrix,
) {
    let mut walks = chord.at.map(|at| beams.walks(at));
    for stretch in &beams.stretches {
        let [start, middle, end] = walks.each_mut().map(|walks| beams.local(stretch, walks));
        let (first, second) = law(&stretch.facing, [&start.z, &end.z]);
        if first == Vector4::zeros() && second == Matrix4::zeros() {
            continue;
        }
        let ends = [0, 1].map(|side| {
            let points = beams.points(stretch, side);
            [0, 1].map(|i| {
                let mut end: Deflection = middle.ends[side][i];
                end.gradient.z *= chord.sinc(points[i].body);
                end.bend *= 0.5;
                end
            })
        });
        let local = Local { stretch, z: middle.z, ends: [&ends[0], &ends[1]] };
        beams.add(&local, first, r);
        beams.add_stiffness(&local, (first, second), pattern, tangent);
    }
}

#[cfg(test)]
mod tests {
    use super::super::contact_loss::Loss;
    use super::*;
    use bimorph_structure::Impact;

    /// Under every law of the fringe field the discrete force does the work of the potential over a step, and its derivative is that with the end of the
    /// step (differences of 1e-6 of the gap).
    #[test]
    fn discrete_forces_do_the_work_of_every_law() {
        let loss = Loss::new(&Impact { restitution: Some(1.0), speed: None });
        for edges in [
            EdgeField::None,
            EdgeField::Parallel { factor: 0.65 / 2e-6, inverse: 1.0 / 2e-6 },
            EdgeField::between_bars(2e-6, 1e-6, 2e-6),
        ] {
            let f = FacingStretch {
                length: 100e-6,
                gap: 2e-6,
                strength: 8.854e-12 * 2e-6,
                edges,
                insulation: None,
                height: 2e-6,
                touch: 0.1e-6,
                chord: false,
                alone: true,
            };
            let (z0, z1) = (Vector4::new(-0.3e-6, 4e-3, 0.2e-6, -6e-3), Vector4::new(-1.9e-6, 1e-3, -1.85e-6, 5e-3));
            let (force, tangent) = f.discrete([&z0, &z1], (7.0, 1e-6), &loss);
            let energy = |z: &Vector4<f64>| -24.5 * f.capacitance(z) + f.contact_energy(z);
            let done = energy(&z1) - energy(&z0);
            assert!((force.dot(&(z1 - z0)) / done - 1.0).abs() < 1e-12, "{edges:?}");
            for i in 0..4 {
                let step = if i % 2 == 0 { 2e-12 } else { 2e-8 };
                let at = |sign: f64| {
                    let mut z = z1;
                    z[i] += sign * step;
                    f.discrete([&z0, &z], (7.0, 1e-6), &loss).0
                };
                let column = (at(1.0) - at(-1.0)) / (2.0 * step);
                assert!((column - tangent.column(i)).norm() < 1e-5 * column.norm(), "{edges:?} {i}");
            }
        }
    }
}
