//! Nodes of a drawing.

use serde::{Deserialize, Serialize};

/// Index of a node in [`Structure::nodes`](crate::Structure::nodes).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NodeId(pub usize);

/// A named point of the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Full name, with the names of the enclosing subnet instances ("bankA.b1.t", "x1(1)").
    pub name: String,
    /// Drawn position x, y (m).
    pub position: [f64; 2],
    /// True when a mechanical element touches the node.
    pub mechanical: bool,
    /// True when an electrical element or a port touches the node.
    pub electrical: bool,
}
