//! Elements that mean something to one domain alone.

use super::node::NodeId;
use serde::{Deserialize, Serialize};

/// An element of a domain's own: where it is, and the numbers that it was given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlacedElement {
    /// Which element it is, as netlists call it.
    pub element: String,
    /// Full element name.
    pub name: String,
    /// Its nodes.
    pub nodes: Vec<NodeId>,
    /// Direction of its local x axis (rad).
    pub angle: f64,
    /// Its parameters, in the order in which the domain lists them (SI).
    pub values: Vec<f64>,
}
