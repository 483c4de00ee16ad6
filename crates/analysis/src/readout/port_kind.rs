//! Kinds of ports: their inputs and outputs.

use serde::{Deserialize, Serialize};

/// Kind of a port, with what is given to it and what it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum PortKind {
    /// Voltage; current and charge.
    #[default]
    Electrical,
    /// Force; displacement.
    Force,
    /// Moment; rotation.
    Moment,
    /// Force; velocity.
    ForceRate,
    /// Moment; rate of rotation.
    MomentRate,
    /// Heat; rise above ambient.
    Thermal,
    /// Acceleration of the frame; nothing.
    Acceleration,
    /// Rate of the frame; nothing.
    Rate,
    /// Displacement of an anchor; its force.
    Displacement,
    /// Rotation of an anchor; its moment.
    Rotation,
}

impl PortKind {
    /// Every kind, in the order of its number on the wire.
    pub const ALL: [Self; 10] = [
        Self::Electrical,
        Self::Force,
        Self::Moment,
        Self::ForceRate,
        Self::MomentRate,
        Self::Thermal,
        Self::Acceleration,
        Self::Rate,
        Self::Displacement,
        Self::Rotation,
    ];

    /// The input and its unit.
    pub fn given(self) -> (&'static str, &'static str) {
        match self {
            Self::Electrical => ("voltage", "V"),
            Self::Force | Self::ForceRate => ("force", "N"),
            Self::Moment | Self::MomentRate => ("moment", "N·m"),
            Self::Thermal => ("heat", "W"),
            Self::Acceleration => ("acceleration", "m/s²"),
            Self::Rate => ("rate", "rad/s"),
            Self::Displacement => ("displacement", "m"),
            Self::Rotation => ("rotation", "rad"),
        }
    }

    /// The output and its unit; empty for an inertial port.
    pub fn answered(self) -> (&'static str, &'static str) {
        match self {
            Self::Electrical => ("current", "A"),
            Self::Force => ("displacement", "m"),
            Self::Moment => ("rotation", "rad"),
            Self::ForceRate => ("velocity", "m/s"),
            Self::MomentRate => ("rate of rotation", "rad/s"),
            Self::Thermal => ("rise", "K"),
            Self::Acceleration | Self::Rate => ("nothing", ""),
            Self::Displacement => ("force", "N"),
            Self::Rotation => ("moment", "N·m"),
        }
    }

    /// Whether the flow is given and the answer is what lies across the port: mechanical and thermal ports.
    pub fn given_flow(self) -> bool {
        match self {
            Self::Electrical | Self::Acceleration | Self::Rate | Self::Displacement | Self::Rotation => false,
            Self::Force | Self::Moment | Self::ForceRate | Self::MomentRate | Self::Thermal => true,
        }
    }
}
