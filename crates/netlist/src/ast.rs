//! The syntax tree of a netlist with all its includes in place.

use super::elements::ElementModel;
use super::source::TextSpan;
use std::sync::Arc;

/// A name with its place.
#[derive(Debug, Clone)]
pub(crate) struct Ident {
    pub(crate) name: Arc<str>,
    pub(crate) span: TextSpan,
}

/// Scope of a variable: the netlist itself or the current subnet instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    pub(crate) global: bool,
    pub(crate) index: usize,
}

impl Slot {
    /// Stands in until names are resolved, and where they cannot be.
    pub(crate) const NONE: Self = Self { global: true, index: usize::MAX };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
}

#[derive(Debug, Clone)]
pub(crate) struct Expr {
    pub(crate) kind: ExprKind,
    pub(crate) span: TextSpan,
}

#[derive(Debug, Clone)]
pub(crate) enum ExprKind {
    Number(f64),
    Text(Arc<str>),
    /// `?`: an argument that may stay open.
    Undefined,
    Variable(Arc<str>, Slot),
    Negate(Box<Expr>),
    Not(Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    Call(Arc<str>, Vec<Expr>),
}

impl Expr {
    /// True when the variable of that slot is named in it.
    pub(crate) fn names(&self, slot: Slot) -> bool {
        match &self.kind {
            ExprKind::Number(_) | ExprKind::Text(_) | ExprKind::Undefined => false,
            ExprKind::Variable(_, own) => *own == slot,
            ExprKind::Negate(operand) | ExprKind::Not(operand) => operand.names(slot),
            ExprKind::Binary(_, left, right) => left.names(slot) || right.names(slot),
            ExprKind::Call(_, arguments) => arguments.iter().any(|argument| argument.names(slot)),
        }
    }
}

/// `ID = expr`.
#[derive(Debug, Clone)]
pub(crate) struct Def {
    pub(crate) name: Ident,
    pub(crate) slot: Slot,
    pub(crate) value: Expr,
}

/// A name with indices: `n`, `n(3)`, `D(1,2)`.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) base: Ident,
    pub(crate) indices: Vec<Expr>,
    pub(crate) span: TextSpan,
}

/// The layer word of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LayerRef {
    /// `*`.
    None,
    /// `parent`: the layer of the instance that is being built.
    Parent,
    /// Index into [`Program::layers`].
    Layer(usize),
}

#[derive(Debug, Clone)]
pub(crate) struct ElementStatement {
    /// The name given.
    pub(crate) name: Option<Name>,
    /// Count of this anonymous line, from 1, in reading order over all files; 0 for one that has a name.
    pub(crate) number: usize,
    /// `anonN`, where N is that count; empty where there is a name.
    pub(crate) unnamed: Arc<str>,
    pub(crate) model: Ident,
    /// The subnet of that name, once resolved; none: a built-in element.
    pub(crate) subnet: Option<usize>,
    /// The built-in element of that name, and whether it takes every parameter that is given.
    pub(crate) built_in: Option<(&'static ElementModel, bool)>,
    /// The layer's name; `*` for none.
    pub(crate) layer_name: Ident,
    pub(crate) layer: LayerRef,
    pub(crate) nodes: Vec<Name>,
    /// The place of the whole node list.
    pub(crate) nodes_span: TextSpan,
    pub(crate) parameters: Vec<Def>,
}

#[derive(Debug, Clone)]
pub(crate) enum Statement {
    Param { name: Ident, slot: Slot, default: Option<Expr> },
    Process(usize),
    Subnet(usize),
    Def(Def),
    Block(Vec<Statement>),
    Element(Box<ElementStatement>),
    For { index: Ident, slot: Slot, from: Expr, to: Expr, body: Vec<Statement> },
    If { condition: Expr, then: Box<Statement>, otherwise: Option<Box<Statement>> },
    Call(Expr),
}

/// `process ID [: ID] = [ … ]`. Entries are the layer's own; its parent's follow by [`LayerDefinition::parent`].
#[derive(Debug, Clone)]
pub(crate) struct LayerDefinition {
    pub(crate) name: Ident,
    pub(crate) parent_name: Option<Ident>,
    pub(crate) parent: Option<usize>,
    pub(crate) entries: Vec<Def>,
    /// True when no entry (of its own or inherited) names a variable: it can be evaluated once.
    pub(crate) constant: bool,
}

/// A formal parameter of a subnet.
#[derive(Debug, Clone)]
pub(crate) struct Formal {
    pub(crate) name: Ident,
    pub(crate) slot: Slot,
    /// Default; none for `x=*`, [`ExprKind::Undefined`] for `x=?`.
    pub(crate) default: Option<Expr>,
}

#[derive(Debug, Clone)]
pub(crate) struct SubnetDefinition {
    pub(crate) name: Ident,
    pub(crate) nodes: Vec<Name>,
    pub(crate) formals: Vec<Formal>,
    pub(crate) body: Vec<Statement>,
    /// Number of variables of an instance, once resolved.
    pub(crate) variables: usize,
}

/// A netlist with all its includes in place, in reading order.
#[derive(Debug, Default)]
pub(crate) struct Program {
    pub(crate) statements: Vec<Statement>,
    pub(crate) layers: Vec<LayerDefinition>,
    pub(crate) subnets: Vec<SubnetDefinition>,
    /// Number of variables of the netlist itself, once resolved.
    pub(crate) variables: usize,
    /// Files whose `ox oy oz` are in degrees, by their numbers.
    pub(crate) degrees: Vec<u16>,
    /// True when an included file is missing: names it would have defined are then unknown.
    pub(crate) incomplete: bool,
}

/// The predefined constant `pi`.
pub(crate) const PI_SLOT: Slot = Slot { global: true, index: 0 };
