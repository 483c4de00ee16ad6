//! How a netlist places a member of a domain that has an element of its own.

/// An element of a domain, as netlists and layouts need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DomainElement {
    /// As netlists call it.
    pub name: &'static str,
    /// Numbers of nodes that it can have.
    pub nodes: &'static [usize],
    /// How messages write its node list.
    pub node_names: &'static str,
    /// Names of its parameters: zero or positive, and 0 where they are not given.
    pub parameters: &'static [&'static str],
}
