//! Which gaps of a system touch, how far each is from where it could not be closed further, and the energy in contacts.

use super::contact::TOUCH;
use super::facing_ends;
use super::gap::Gap;
use super::system::System;
use crate::multibody::planar::Pose;

impl System {
    /// Distance at which the parts of a gap touch, and the least one that its law of contact knows [m]; none: they never do.
    pub fn touching(&self, gap: usize) -> Option<[f64; 2]> {
        match &self.gaps[gap] {
            Gap::Single { contact, .. } => contact.map(|c| [c.touch, c.least()]),
            Gap::Facing { facing, .. } => Some([facing.touch, facing.least()]),
            Gap::Stop { stop, .. } => Some([0.0, stop.least()]),
        }
    }

    /// What is left of a gap until it could not be closed further [m]: its distance; of a stop the way and, beyond it, what a touch
    /// takes.
    pub fn room(&self, gap: usize, q: &[Pose]) -> f64 {
        let left = self.distance(gap, q);
        if matches!(self.gaps[gap], Gap::Stop { .. }) { left.max(0.0) + TOUCH } else { left }
    }

    /// True when a gap is so far closed that its contact force acts.
    pub fn touches(&self, gap: usize, q: &[Pose]) -> bool {
        self.touching(gap).is_some_and(|[touch, _]| self.distance(gap, q) < touch)
    }

    /// The first gap that is closed beyond the range of its law of contact, with the distance that is left [m].
    pub fn overrun(&self, q: &[Pose]) -> Option<(usize, f64)> {
        (0..self.gaps.len()).find_map(|g| {
            let [_, least] = self.touching(g)?;
            let left = self.distance(g, q);
            (left < least).then_some((g, left))
        })
    }

    /// Energy stored where parts touch [J].
    pub fn contact_energy(&self, q: &[Pose]) -> f64 {
        let of = |(g, gap): (usize, &Gap)| match gap {
            Gap::Single { contact: None, .. } => 0.0,
            Gap::Single { contact: Some(contact), .. } => contact.energy(self.distance(g, q)),
            Gap::Facing { ends, side, facing } => {
                facing.contact_energy(&facing_ends::values(self.model.linear, ends, *side, q))
            }
            Gap::Stop { approach, ways, stop } => {
                let u = approach.value(q, self.model.linear);
                let side = |way: Option<f64>, u: f64| way.map_or(0.0, |w| stop.energy(w - u));
                side(ways[0], u) + side(ways[1], -u)
            }
        };
        self.gaps.iter().enumerate().map(of).sum()
    }

    /// Work of the contact forces at `q` over a small change `dq`, each gap's taken positive [J].
    pub fn contact_work(&self, q: &[Pose], dq: &[Pose]) -> f64 {
        let of = |(g, gap): (usize, &Gap)| match gap {
            Gap::Single { contact: None, .. } => 0.0,
            Gap::Single { contact: Some(contact), .. } => {
                let force = contact.force(self.distance(g, q)).0;
                if force == 0.0 { 0.0 } else { force * self.distance_slope(g, q, dq) }
            }
            Gap::Facing { ends, side, facing } => {
                let force = facing.contact(&facing_ends::values(self.model.linear, ends, *side, q)).0;
                if force.x == 0.0 && force.z == 0.0 {
                    0.0
                } else {
                    force.dot(&facing_ends::changes(self.model.linear, ends, *side, q, dq))
                }
            }
            Gap::Stop { stop, .. } => {
                let force = stop.force(self.distance(g, q)).0;
                if force == 0.0 { 0.0 } else { force * self.distance_slope(g, q, dq) }
            }
        };
        self.gaps.iter().enumerate().map(|gap| of(gap).abs()).sum()
    }
}
