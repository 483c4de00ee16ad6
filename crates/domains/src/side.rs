//! The side to which a part goes where both are alike, by a rule that turns with the drawing.
//!
//! Of the beams whose bending energy in the motion is at least half of the largest, the first of the netlist goes to the left, seen along its drawn
//! direction. Without beams the first gap that changes at least half as much as any closes, and without gaps the first joint with half of the
//! largest strain lengthens or turns to the left.

use super::beam_line::BeamSide;
use super::domain::Domain;
use super::system::System;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::unstressed::{add_stresses, strains};
use nalgebra::Vector3;

/// Fraction of the largest above which a beam, a gap or a joint decides (1).
const DECIDES: f64 = 0.5;
/// Step of the difference that strains of a motion come from.
const STEP: f64 = 1e-6;

impl System {
    /// Forces `r` of stresses in the joints' own frames, which excite whatever bends, shifts or stretches alike in any direction of the drawing.
    /// `length` (m) makes moments and forces comparable.
    #[inline]
    pub fn excite(&self, q: &[Pose], length: f64, r: &mut [Pose]) {
        r.fill(Pose::zeros());
        let stress = |joint: usize| {
            let part = |k: usize| 1.0 + 0.37 * ((joint * k) % 5) as f64;
            Vector3::new(part(3), part(7), length * part(11)) / length
        };
        add_stresses(&self.model, q, stress, r);
    }

    /// The sign with which a `motion` from `q` goes to the side of the rule, and where `sign`·`motion` goes, in words.
    pub fn side(&self, q: &[Pose], motion: &[Pose], sign: f64) -> (f64, String) {
        let bent: Vec<(f64, BeamSide)> =
            self.beams.iter().map(|beam| beam.bending(q, motion, self.model.linear)).collect();
        let most = bent.iter().map(|(energy, _)| *energy).fold(0.0, f64::max);
        if most > 0.0
            && let Some(k) = bent.iter().position(|(energy, _)| *energy >= DECIDES * most)
        {
            let left = if bent[k].1 == BeamSide::Left { 1.0 } else { -1.0 };
            let side = if left * sign > 0.0 { "left" } else { "right" };
            return (left, format!("{} to the {side}", self.beams[k].name));
        }
        let gaps = self.members.iter().map(|gap| -gap.distance_change(self.at(q), motion)).filter(|x| x.is_finite());
        let own = decisive(gaps).unwrap_or_else(|| decisive(self.changes(q, motion)).unwrap_or(1.0));
        let moved = |body: &usize| motion[*body].x.hypot(motion[*body].y);
        let farthest = (0..motion.len()).max_by(|a, b| moved(a).total_cmp(&moved(b)));
        (own.signum(), farthest.map_or(String::new(), |body| self.model.bodies[body].name.to_string()))
    }

    /// The largest strain of each joint in a motion, with its sign.
    fn changes(&self, q: &[Pose], motion: &[Pose]) -> impl Iterator<Item = f64> {
        let moved: Vec<Pose> = q.iter().zip(motion).map(|(q, x)| q + x * STEP).collect();
        let there: Vec<_> = strains(&self.model, &moved).collect();
        let here: Vec<_> = strains(&self.model, q).collect();
        let scale = self.length_scale;
        here.into_iter().zip(there).map(move |(here, there)| {
            let change = there - here;
            let turned = change.z * scale;
            if turned.abs() > change.x.abs().max(change.y.abs()) { turned } else { change.x + change.y }
        })
    }
}

/// The first value of at least half of the largest size.
fn decisive(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    let most = values.iter().map(|x| x.abs()).fold(0.0, f64::max);
    values.into_iter().find(|x| most > 0.0 && x.abs() >= DECIDES * most)
}
