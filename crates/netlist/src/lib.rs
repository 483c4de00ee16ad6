//! SUGAR netlists, of both languages: text → elements → placed [`Structure`](bimorph_structure::Structure), behind one trait, [`FrontEnd`](bimorph_structure::FrontEnd).
//!
//! [`Bundle`](bimorph_base::Bundle) holds the text of a netlist and of every file it includes, so that nothing after it touches the disk: a
//! bundle can be sent to a server as it is. [`load`] turns a bundle into a structure, or into diagnostics.
//!
//! `foreign` recognizes the language of a file. SUGAR 2, one module a step: `lexer` makes tokens, `parser`, `statement`
//! and `expression` the tree with all includes in place, `resolve` binds names, `elaborate` and `instance` run
//! definitions, loops and subnets. SUGAR 3, which is Lua, is run by `sugar3`. Both front ends build elements with
//! `elements`. A structure as a JSON document is read by `document`. `finish` calls `place` for node positions and `check` for loose ends. docs/reference/netlist.md describes the
//! languages.
//!
//! **Architecture invariant.** Below are [`bimorph_base`], [`bimorph_structure`] and [`bimorph_document`]. Nothing here touches the disk after a
//! bundle is read, nothing solves, and nothing knows bodies or joints.

mod ast;
mod check;
mod diagnostic_sink;
mod document;
mod drawing;
mod elaborate;
mod elements;
mod evaluate;
mod expression;
mod finish;
mod foreign;
mod functions;
mod includes;
mod instance;
mod lexer;
mod parse_setting;
mod parser;
mod place;
mod read;
mod resolve;
mod rotation;
mod source;
mod statement;
mod sugar2;
mod sugar3;
mod token;
mod value;

pub use includes::{DroppedInclude, read_bundle, read_bundle_reporting};
pub use parse_setting::parse_setting;
pub use read::{NetlistSource, beam_places, document, is_program, load};

/// A built-in element as docs/reference/elements.md documents it.
#[derive(Clone, Copy, Debug)]
pub struct ElementDescription {
    /// Its name in netlists.
    pub name: &'static str,
    /// Its node list, such as `[a b]`.
    pub nodes: &'static str,
    /// Its parameters besides the entries of a layer and ox, oy, oz.
    pub parameters: &'static [&'static str],
}

/// All built-in elements.
pub fn element_descriptions() -> impl Iterator<Item = ElementDescription> {
    elements::models().map(|m| ElementDescription { name: m.name, nodes: m.node_names, parameters: m.parameters })
}
