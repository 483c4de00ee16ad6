//! Failures of methods, and the methods that work instead: each test asserts both sides with measured figures.
//! docs/project/stability.md describes them, and examples/stability_pictures draws the measurements.

// the pictures use tracks and times that no test reads
#![allow(dead_code)]

pub(crate) mod bank;
pub(crate) mod buckled;
pub(crate) mod four_bar;
pub(crate) mod frame;
pub(crate) mod inconsistent;
#[path = "../rcr/mechanism.rs"]
pub(crate) mod mechanism;
pub(crate) mod no_pivot;
pub(crate) mod squeezer;
pub(crate) mod steps;
pub(crate) mod stiffness;
pub(crate) mod straight_arms;
pub(crate) mod symbolic;
pub(crate) mod units;
