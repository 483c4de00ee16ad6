//! Inputs other than voltages: forces at points, motion of anchors, heat into beams, the motion of the frame.

use super::approach::MaterialPoint;

/// A quantity that is given to a mechanism beside its voltages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// A force along global x (0) or y (1) (N), or a moment about z (2) (N·m), on a point.
    Force {
        /// Where it acts.
        point: MaterialPoint,
        /// Which it is.
        direction: usize,
    },
    /// Displacement of an anchor along global x (0) or y (1) (m), or its rotation about z (2) (rad).
    Motion {
        /// Number of the anchor in [`System::anchors`](super::system::System::anchors).
        anchor: usize,
        /// Which it is.
        direction: usize,
    },
    /// Heat into a beam, spread evenly along it as that of its own current (W).
    Heat {
        /// Index of the heater.
        heater: usize,
    },
    /// Acceleration of the frame along global x (0) or y (1) (m/s²).
    Acceleration {
        /// Which it is.
        axis: usize,
    },
    /// Rate of the frame about z (rad/s).
    Rate,
}

impl Input {
    /// Whether it moves the frame.
    pub(super) fn moves_frame(&self) -> bool {
        matches!(self, Self::Acceleration { .. } | Self::Rate)
    }
}
