//! Quantities of a system's gaps, by number.

use super::domain::{Domain, SideContact};
use super::member::Member;
use super::stick_point::StickPoint;
use super::system::System;
use bimorph_multibody::planar::Pose;

/// Largest penetration at the start of a step that may end beyond the law of contact, of the largest that the law knows
/// (1). A contact that is really pressed beyond it gets there in smaller steps.
const PRESSED_BEFORE: f64 = 0.5;

impl System {
    /// Capacitance of a gap (F).
    #[inline]
    pub fn capacitance(&self, gap: usize, q: &[Pose]) -> f64 {
        self.members[gap].capacitance(self.at(q))
    }

    /// Change of a gap's capacitance with a change `dq` of the configuration (F).
    #[inline]
    pub fn capacitance_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        self.members[gap].capacitance_change(self.at(q), dq)
    }

    /// Distance left in a gap (m): overlap of a comb, gap of plates, smallest gap of facing beams, way left to the nearer side of
    /// a stop.
    #[inline]
    pub fn distance(&self, gap: usize, q: &[Pose]) -> f64 {
        self.members[gap].distance(self.at(q))
    }

    /// Change of a gap's distance with a change `dq` of the configuration (m).
    #[inline]
    pub fn distance_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        self.members[gap].distance_change(self.at(q), dq)
    }

    /// Force with which `volts` (V) pull the two sides of a gap together, ½V²·∂C/∂u, u the approach of both ends alike (N); 0 of
    /// a stop.
    #[inline]
    pub fn pull(&self, gap: usize, q: &[Pose], volts: f64) -> f64 {
        0.5 * volts * volts * self.members[gap].pull(self.at(q))
    }

    /// Change of [`Self::pull`] with a change `dq` of the configuration and `dv` (V) of the voltage (N).
    #[inline]
    pub fn pull_slope(&self, gap: usize, q: &[Pose], volts: f64, dq: &[Pose], dv: f64) -> f64 {
        let (slope, change) = self.members[gap].pull_and_change(self.at(q), dq);
        volts * slope * dv + 0.5 * volts * volts * change
    }

    /// Force with which the two sides of a gap bear on each other (N).
    #[inline]
    pub fn bearing(&self, gap: usize, q: &[Pose]) -> f64 {
        self.members[gap].bearing(self.at(q))
    }

    /// Change of [`Self::bearing`] with a change `dq` of the configuration (N).
    #[inline]
    pub fn bearing_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        self.members[gap].bearing_change(self.at(q), dq)
    }

    /// `r +=` the change of a gap's forces by the shape that beams take within segments under the load along them; the sum of the
    /// changes' sizes (N).
    #[inline]
    pub fn add_shape_force(&self, gap: usize, q: &[Pose], volts: f64, r: &mut [Pose]) -> f64 {
        self.members[gap].add_shape_force(self.at(q), volts, r)
    }

    /// Calls `put` with the approaches of the points of a member (m), see [`Domain::point_approaches`].
    #[inline]
    pub fn point_approaches(&self, member: usize, q: &[Pose], put: impl FnMut(f64)) {
        self.members[member].point_approaches(self.at(q), put);
    }

    /// Distance at which the parts of a gap touch, and the least one that its law of contact knows (m); none: they never do.
    #[inline]
    pub fn touching(&self, gap: usize) -> Option<[f64; 2]> {
        self.members[gap].touching()
    }

    /// Remaining travel of a gap until it is closed completely (m): its distance; for a stop, the travel and, beyond
    /// it, the largest penetration.
    #[inline]
    pub fn clearance(&self, gap: usize, q: &[Pose]) -> f64 {
        self.members[gap].clearance(self.at(q))
    }

    /// True when a gap is so far closed that its contact force acts.
    #[inline]
    pub fn touches(&self, gap: usize, q: &[Pose]) -> bool {
        self.touching(gap).is_some_and(|[touch, _]| self.distance(gap, q) < touch)
            || self.side_contact(gap, q).is_some_and(|side| side.left < side.touch)
    }

    /// The sides of a comb's fingers; none of other gaps, and where no finger faces another.
    #[inline]
    pub fn side_contact(&self, gap: usize, q: &[Pose]) -> Option<SideContact> {
        self.members[gap].side_contact(self.at(q))
    }

    /// Way left until the sides of a comb's fingers touch (m), whether they overlap or not; infinite of other gaps.
    #[inline]
    pub fn side_way(&self, gap: usize, q: &[Pose]) -> f64 {
        self.members[gap]
            .side_room()
            .map_or(f64::INFINITY, |(across, side)| side.room - (side.drawn + across.value(q, self.model.linear)).abs())
    }

    /// Change of the distance left between those sides with a change `dq` of the configuration (m).
    #[inline]
    pub fn side_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        self.members[gap].side_change(self.at(q), dq)
    }

    /// True where the way between two configurations leads through the contact of fingers at their sides, which changes the distance left by more than
    /// `part` of what `of` makes of both.
    #[inline]
    pub fn sides_leap(&self, [from, to]: [&[Pose]; 2], part: f64, of: impl Fn(f64, f64) -> f64) -> bool {
        (0..self.members.len()).any(|gap| {
            let (Some(a), Some(b)) = (self.side_contact(gap, from), self.side_contact(gap, to)) else { return false };
            a.left.min(b.left) < a.touch && (a.left - b.left).abs() > part * of(a.left, b.left)
        })
    }

    /// Scale of the force balance where parts touch (N): the largest contact force. At a contact with almost no load, and up to a thousandth of
    /// the touching distance before one, a thousandth of the attraction there. 0 where nothing touches. `volts` of each gap.
    #[inline]
    pub fn contact_scale(&self, q: &[Pose], volts: &[f64]) -> f64 {
        let of = |(g, (gap, volts)): (usize, (&Member, &f64))| {
            let bearing = gap.bearing(self.at(q));
            // contact begins so softly that Newton's method may come to a stand on its open side
            let near = || gap.touching().is_some_and(|[touch, _]| gap.distance(self.at(q)) < (1.0 + 1e-3) * touch);
            let sides = || gap.side_contact(self.at(q)).is_some_and(|side| side.left < (1.0 + 1e-3) * side.touch);
            if bearing > 0.0 || near() || sides() { bearing.max(1e-3 * self.pull(g, q, *volts).abs()) } else { 0.0 }
        };
        self.members.iter().zip(&*self.gap_voltages(q, volts)).enumerate().map(of).fold(0.0, f64::max)
    }

    /// The first gap that is closed beyond the range of its law of contact, with the distance that is left and the least one of that law (m).
    #[inline]
    pub fn overrun(&self, q: &[Pose]) -> Option<(usize, [f64; 2])> {
        (0..self.members.len()).find_map(|g| {
            if let Some(side) = self.side_contact(g, q) {
                return (side.left < side.least).then_some((g, [side.left, side.least]));
            }
            let [_, least] = self.touching(g)?;
            if self.members[g].surely_apart(self.at(q)) {
                return None;
            }
            let left = self.distance(g, q);
            (left < least).then_some((g, [left, least]))
        })
    }

    /// The part of a member that friction holds at rest.
    #[inline]
    pub(super) fn stick_point(&self, member: usize, q: &[Pose]) -> Option<StickPoint> {
        self.members[member].stick_point(self.at(q))
    }

    /// True where friction holds parts at rest: equilibria have a history.
    #[inline]
    pub fn sticks(&self) -> bool {
        self.members.iter().any(Domain::sticks)
    }

    /// Energy stored where parts touch (J).
    #[inline]
    pub fn contact_energy(&self, q: &[Pose]) -> f64 {
        self.members.iter().map(|gap| gap.contact_energy(self.at(q))).sum()
    }

    /// Work of the contact forces at `q` over a small change `dq`, each gap's taken positive (J).
    #[inline]
    pub fn contact_work(&self, q: &[Pose], dq: &[Pose]) -> f64 {
        self.members.iter().map(|gap| gap.contact_work(self.at(q), dq).abs()).sum()
    }

    /// The largest change of a contact distance with a change `dq` at the end of a step from `before` to `q`. It is
    /// relative to the penetration, of at least `least` (m) (1), and infinite where the step exceeds the law of
    /// contact.
    #[inline]
    pub fn contact_change(&self, [before, q]: [&[Pose]; 2], dq: &[Pose], least: f64) -> f64 {
        let change = |gap: &Member| {
            let (at, sides) = (self.at(q), |q| gap.side_contact(self.at(q)));
            let ([touch, allowed], after, start) = match (gap.touching(), sides(q)) {
                (Some(law), _) => (law, gap.distance(at), gap.distance(self.at(before))),
                (None, Some(side)) => {
                    ([side.touch, side.least], side.left, sides(before).map_or(f64::INFINITY, |side| side.left))
                }
                (None, None) => return None,
            };
            let (pressed, most) = (touch - after, touch - allowed);
            if pressed > most && touch - start < PRESSED_BEFORE * most {
                return Some(f64::INFINITY);
            }
            let slope = || if gap.touching().is_some() { gap.distance_change(at, dq) } else { gap.side_change(at, dq) };
            (pressed > 0.0).then(|| slope().abs() / pressed.max(least))
        };
        // a sum that includes NaN is NaN
        self.members.iter().filter_map(change).fold(0.0, |most, one| if one <= most { most } else { one })
    }
}
