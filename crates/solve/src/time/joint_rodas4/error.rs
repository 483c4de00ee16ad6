//! Storage for the error of a motion in joint coordinates.

use crate::time::defect::Impulses;
use crate::time::method::Motion;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::planar::Pose;

/// The error, over the coordinates and over the bodies' motions, and storage for a step of it.
#[derive(Debug, Clone)]
pub(super) struct JointDefectEstimate {
    pub(super) error: [Motion; 2],
    /// Energy that the residuals have taken (J).
    pub(super) taken: f64,
    pub(super) room: [Motion; 2],
    pub(super) impulses: Impulses,
    /// Right side over the coordinates, and over the bodies' motions; then what the solve has found.
    pub(super) right: Vec<Four>,
    pub(super) wrench: Vec<Four>,
    /// Forces of dampers.
    pub(super) force: Vec<Pose>,
}

impl JointDefectEstimate {
    /// Storage for so many bodies, without an error.
    pub(super) fn zeros(count: usize) -> Self {
        Self {
            error: [Motion::zeros(count), Motion::zeros(count)],
            taken: 0.0,
            room: [Motion::zeros(count), Motion::zeros(count)],
            impulses: Impulses::zeros(count),
            right: vec![Four::ZERO; count],
            wrench: vec![Four::ZERO; count + 1],
            force: vec![Pose::zeros(); count],
        }
    }
}
