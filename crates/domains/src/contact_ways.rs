//! Whether parts may touch within a step, by bounds of displacements: most steps of most runs are far from contact, which needs no search.
//!
//! A bound b of the way by which displacements close a gap is a norm. Within a step the motion is Hermite's cubic between both ends, so that
//! ```text
//! b(q(x)) ≤ max(b(q₀), b(q₁)) + (4/27)·h·(b(v₀) + b(v₁))
//! ```

use super::domain::Domain;
use super::system::System;
use bimorph_multibody::planar::Pose;

/// The ways of the parts of a system until they touch.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactWays {
    /// Member, its way as drawn (m), and the bounds of displacements (m) and rates (m/s) at the end of the last step.
    ways: Vec<(usize, f64, Option<[f64; 2]>)>,
}

/// Displacements and rates at an end of a step.
pub type StepEnd<'a> = (&'a [Pose], &'a [Pose]);

impl ContactWays {
    /// Of a system.
    pub fn new(system: &System) -> Self {
        let rest = vec![Pose::zeros(); system.bodies()];
        let way = |g| {
            let own = system.touching(g).map(|[touch, _]| system.distance(g, &rest) - touch);
            let sides = || system.members[g].side_room().map(|(_, side)| side.room - side.drawn.abs());
            Some((g, own.or_else(sides)?, None))
        };
        Self { ways: (0..system.members.len()).filter_map(way).collect() }
    }

    /// Bound of the largest part of a way that parts come within a step of length `h` (s) (1), which begins where the last one ended. Below 1 none touches.
    pub fn used(&mut self, system: &System, [before, after]: [StepEnd<'_>; 2], h: f64) -> f64 {
        let used = |(g, way, last): &mut (usize, f64, Option<[f64; 2]>)| {
            let bounds = |(q, v): StepEnd<'_>| [q, v].map(|of| system.members[*g].closing_bound(of));
            let ([start, from], [end, to]) = (last.unwrap_or_else(|| bounds(before)), bounds(after));
            *last = Some([end, to]);
            let most = 0.5 * (start + end) + 0.5 * (start - end).abs();
            (most + h * (from + to)) / way.max(0.0)
        };
        // what is no number must not be lost
        self.ways.iter_mut().map(used).fold(0.0, |most, used| if used <= most { most } else { used })
    }
}
