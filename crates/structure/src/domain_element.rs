//! Elements of the netlist language that belong to one domain alone.
//!
//! Front ends know them from this table: they keep the place and the parameters of such an element, see
//! [`PlacedElement`](crate::PlacedElement), and the domain reads them.

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

impl DomainElement {
    /// A damper between a node and the ground, along the element's axes and about z.
    pub const DASHPOT: Self =
        Self { name: "dashpot2d", nodes: &[1], node_names: "[n]", parameters: &["bx", "by", "brz"] };

    /// All of them, in the order in which messages list them.
    pub const ALL: &'static [Self] = &[Self::DASHPOT];
}
