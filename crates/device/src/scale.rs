//! Scales of a volt and an ampere at a non-electrical port.
//!
//! ngspice's tolerances are made for volts and microamperes: `vntol` is 1 µV and `abstol` 1 pA. A micrometre is shown as a
//! volt and a newton as an ampere, so that displacements are solved to a picometre and forces to a piconewton, and a spring
//! of 1 N/m is a resistor of 1 MΩ. Rotations are scaled by as much as a lever of a millimetre makes of them, which is what
//! CMU found to converge best with displacement across (Iyer, Jing, Fedder, Mukherjee, MSM 2001, pp. 590–593). With these
//! scales a volt times an ampere is 1 µJ at every port that answers with a displacement or rotation, 1 W at every one that
//! answers with a velocity: ports stay reciprocal.

use super::PortKind;

/// Factors of a port.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortScale {
    /// Input for one volt or ampere of the circuit, in the port's own unit.
    pub given: f64,
    /// Volts or amperes of the circuit for one unit of what the port answers.
    pub answered: f64,
}

impl PortScale {
    /// Of a port of this kind. `across`: volts per unit of what lies across it, in place of the default.
    pub fn new(kind: PortKind, across: Option<f64>) -> Self {
        let (given, default) = match kind {
            PortKind::Electrical => return Self { given: 1.0, answered: 1.0 },
            PortKind::Acceleration | PortKind::Rate => {
                return Self { given: 1.0 / across.unwrap_or(1.0), answered: 0.0 };
            }
            // displacements and forces as at a port of the other kind
            PortKind::Displacement => return Self { given: 1.0 / across.unwrap_or(1e6), answered: 1.0 },
            PortKind::Rotation => return Self { given: 1.0 / across.unwrap_or(1e3), answered: 1e3 },
            PortKind::Force => (1.0, 1e6),
            PortKind::Moment => (1e-3, 1e3),
            PortKind::ForceRate => (1.0, 1.0),
            PortKind::MomentRate => (1e-3, 1e-3),
            PortKind::Thermal => (1.0, 1.0),
        };
        Self { given, answered: across.unwrap_or(default) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Work is 1 µJ per volt-ampere with displacements, 1 W with rates, translation and rotation alike.
    #[test]
    fn work_has_one_scale() {
        for (kinds, work) in
            [([PortKind::Force, PortKind::Moment], 1e-6), ([PortKind::ForceRate, PortKind::MomentRate], 1.0)]
        {
            for kind in kinds {
                let scale = PortScale::new(kind, None);
                assert!((scale.given / scale.answered / work - 1.0).abs() < 1e-12, "{kind:?}");
            }
        }
    }

    /// A scale of the line is volts per unit across, on either side.
    #[test]
    fn a_given_scale_is_across() {
        assert_eq!(PortScale::new(PortKind::Force, Some(1e7)), PortScale { given: 1.0, answered: 1e7 });
        assert_eq!(PortScale::new(PortKind::Acceleration, Some(0.1)).given, 10.0);
    }
}
