//! With what the field closes a gap.

use super::capacitor::Capacitance;
use super::facing_ends;
use super::gap::Gap;
use super::system::System;
use crate::multibody::Model;
use crate::multibody::planar::Pose;

impl System {
    /// The mean load with which voltage closes a gap between facing beams, less that of contact [N/m], and the least distance [m]; none for
    /// other gaps.
    pub fn line_load(&self, gap: usize, q: &[Pose], volts: f64) -> Option<(f64, f64)> {
        let Gap::Facing { ends, side, facing } = &self.gaps[gap] else { return None };
        let z = facing_ends::values(self.model.linear, ends, *side, q);
        let force = facing.at(&z).gradient * (-0.5 * volts * volts) + facing.contact(&z).0;
        Some(((force[0] + force[2]).abs() / facing.length, facing.closest(&z).0))
    }

    /// Force with which `volts` [V] pull the two sides of a gap together, ½V²·∂C/∂u, u the approach of both ends alike [N]; 0 of
    /// a stop.
    pub fn pull(&self, gap: usize, q: &[Pose], volts: f64) -> f64 {
        let slope = match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => capacitor.at(approach.value(q, self.model.linear)).slope,
            Gap::Facing { ends, side, facing } => {
                let gradient = facing.at(&facing_ends::values(self.model.linear, ends, *side, q)).gradient;
                -(gradient[0] + gradient[2])
            }
            Gap::Stop { .. } => 0.0,
        };
        0.5 * volts * volts * slope
    }

    /// Change of [`Self::pull`] with a change `dq` of the configuration and `dv` [V] of the voltage [N].
    pub fn pull_slope(&self, gap: usize, q: &[Pose], volts: f64, dq: &[Pose], dv: f64) -> f64 {
        let (slope, change) = match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => {
                let m = approach.measure(q, self.model.linear);
                let (da, db) = (Model::pose(dq, approach.a.body), Model::pose(dq, approach.b.body));
                let along = m.gradient.fixed_rows::<3>(0).dot(&da) + m.gradient.fixed_rows::<3>(3).dot(&db);
                let Capacitance { slope, curvature, .. } = capacitor.at(m.value);
                (slope, curvature * along)
            }
            Gap::Facing { ends, side, facing } => {
                let c = facing.at(&facing_ends::values(self.model.linear, ends, *side, q));
                let dz = c.hessian * facing_ends::changes(self.model.linear, ends, *side, q, dq);
                (-(c.gradient[0] + c.gradient[2]), -(dz[0] + dz[2]))
            }
            Gap::Stop { .. } => return 0.0,
        };
        volts * slope * dv + 0.5 * volts * volts * change
    }
}
