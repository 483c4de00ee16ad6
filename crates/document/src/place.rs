//! The path of a value inside a document, built on the stack and written in an error alone.

use crate::error::DocumentError;
use crate::json::JsonNode;

/// A value's place: the way to it from the root.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ValuePath<'p> {
    /// The whole document.
    Root,
    /// A field of an object.
    Field(&'p ValuePath<'p>, &'p str),
    /// An item of a list.
    Item(&'p ValuePath<'p>, usize),
}

impl ValuePath<'_> {
    /// As in `$.beams[3].length`.
    fn text(&self) -> String {
        match self {
            Self::Root => "$".to_owned(),
            Self::Field(parent, name) => format!("{}.{name}", parent.text()),
            Self::Item(parent, index) => format!("{}[{index}]", parent.text()),
        }
    }

    /// The fault of a value here.
    pub(crate) fn fault(
        &self,
        code: &'static str,
        node: &JsonNode<'_>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> DocumentError {
        DocumentError { path: self.text(), span: node.span, code, message: message.into(), help: help.into() }
    }
}
