//! Nodes by name.

use super::node::{Node, NodeId};
use std::collections::HashMap;
use std::sync::OnceLock;

/// A table of node names that is made on first use. It may be stale (nodes can be added to a structure at any time):
/// an answer is checked against the nodes, and a miss is looked up by going through them.
#[derive(Debug, Clone, Default)]
pub struct NodeIndex(OnceLock<HashMap<String, usize>>);

impl NodeIndex {
    /// The node of that full name among `nodes`.
    pub fn find(&self, nodes: &[Node], name: &str) -> Option<NodeId> {
        let table = self.0.get_or_init(|| nodes.iter().enumerate().map(|(i, n)| (n.name.clone(), i)).collect());
        match table.get(name) {
            Some(&at) if nodes.get(at).is_some_and(|n| n.name == name) => Some(NodeId(at)),
            None if table.len() == nodes.len() => None,
            _ => nodes.iter().position(|n| n.name == name).map(NodeId),
        }
    }
}

/// Two structures are equal whatever their indices have seen.
impl PartialEq for NodeIndex {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
