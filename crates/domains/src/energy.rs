//! The potential whose gradient the residual is, and with it the energy that an undamped motion keeps.
//!
//! At constant voltages and temperatures, the potential is Π = U(q) − Σ ½·C(q)·V² + contact − load · displacement.
//! V has the potentials of floating conductors, which make Π stationary.
//! Forces and frame motion from sources count among the loads. Kinetic energy plus Π is constant; the energy delivered
//! by the sources is part of −½·C·V².

use super::domain::Domain;
use super::drive::Drive;
use super::system::System;
use bimorph_multibody::forces;
use bimorph_multibody::planar::Pose;

impl System {
    /// Potential Π(q) at a drive (J); see [`crate::energy`].
    pub fn potential(&self, q: &[Pose], drive: &Drive) -> f64 {
        let mut sum = forces::strain_energy(&self.model, q, &drive.rest());
        let volts = self.gap_voltages(q, &drive.volts);
        for g in 0..self.members.len() {
            if volts[g] != 0.0 {
                sum -= 0.5 * self.capacitance(g, q) * volts[g] * volts[g];
            }
        }
        sum += self.contact_energy(q);
        let at = self.at(q);
        for (gap, &volts) in self.members.iter().zip(&*volts) {
            sum += gap.energy(at, volts);
        }
        for load in &self.loads {
            sum += load.energy(at, drive.load);
        }
        sum + self.input_energy(at, drive)
    }

    /// Kinetic energy plus potential (J) of a motion (q, v) at a drive.
    #[inline]
    pub fn energy(&self, q: &[Pose], v: &[Pose], drive: &Drive) -> f64 {
        forces::kinetic_energy(&self.model, v) + self.potential(q, drive)
    }
}
