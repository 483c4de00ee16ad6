//! SUGAR netlists, of both languages: text → elements → placed [`Structure`], behind one trait, [`FrontEnd`].
//!
//! [`Bundle`] holds the text of a netlist and of every file it includes, so that nothing after it touches the disk: a
//! bundle can be sent to a server as it is. [`load`] turns a bundle into a structure, or into diagnostics.
//!
//! `foreign` tells the languages apart. SUGAR 2, one module a step: `lexer` makes tokens, `parser`, `statement` and `expression` the tree with all includes in place, `resolve`
//! binds names, `elaborate` and `instance` run definitions, loops and subnets. SUGAR 3, which is Lua, is run by `sugar3`. What both
//! instantiate is built by `elements`; `place` walks over the drawing for node positions, and `check` looks for loose ends.
//! docs/netlist.md describes the languages.

mod ast;
mod bundle;
mod check;
mod diagnostic;
mod drawing;
mod elaborate;
mod elements;
mod evaluate;
mod expression;
mod foreign;
mod front;
mod functions;
mod instance;
mod lexer;
mod parser;
mod place;
mod resolve;
mod rotation;
mod setting;
mod sink;
mod source;
mod statement;
mod sugar2;
mod sugar3;
mod suggest;
mod token;
mod value;

pub use bundle::{Bundle, DroppedInclude};
pub use diagnostic::{Diagnostic, Diagnostics, Severity};
pub use front::FrontEnd;
pub use setting::Setting;

use crate::structure::Structure;
use drawing::Drawing;
use sink::Sink;

/// Longer lists of names are cut in messages.
const MOST_LISTED: usize = 40;

/// What a netlist elaborates to.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The drawing.
    pub structure: Structure,
    /// Parameters of the netlist with the values they took, in order of appearance.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings.
    pub warnings: Diagnostics,
}

/// Parses and elaborates a bundle with parameters set from outside.
///
/// # Errors
/// Every error found in one run; warnings are among them.
pub fn load(bundle: &Bundle, set: &[(String, Setting)]) -> Result<Loaded, Diagnostics> {
    Source::new(bundle).load(set)
}

/// A drawing that has been read, in whichever language it is.
#[derive(Debug)]
pub struct Source {
    front: Box<dyn FrontEnd>,
}

impl Source {
    /// Reads a bundle. Errors come out with [`Source::load`].
    pub fn new(bundle: &Bundle) -> Self {
        Self { front: front::read(bundle) }
    }

    /// What another front end has read.
    pub fn from_front(front: Box<dyn FrontEnd>) -> Self {
        Self { front }
    }

    /// Draws it with parameters set from outside.
    ///
    /// # Errors
    /// Every error found in one run, those of reading too; warnings are among them.
    pub fn load(&self, set: &[(String, Setting)]) -> Result<Loaded, Diagnostics> {
        self.front.load(set)
    }
}

/// A bundle in SUGAR 2, whatever it looks like.
fn read(bundle: &Bundle) -> sugar2::Sugar2 {
    sugar2::Sugar2::new(bundle)
}

/// What every front end of netlists does with the elements that it has built: members out of the plane, positions, loose ends.
fn finish(
    mut drawing: Drawing,
    parameters: Vec<(String, Setting)>,
    mut sink: Sink,
    bundle: &Bundle,
) -> Result<Loaded, Diagnostics> {
    elements::upright::settle(&mut drawing, &mut sink);
    if !sink.failed() {
        place::place(&mut drawing, &mut sink);
    }
    if !sink.failed() {
        check::finite(&drawing, &mut sink);
    }
    if !sink.failed() {
        check::check(&drawing, &mut sink);
    }
    if sink.failed() {
        return Err(sink.finish(bundle));
    }
    let warnings = sink.finish(bundle);
    Ok(Loaded { structure: drawing.structure, parameters, warnings })
}

/// The names of all built-in elements, in the order of docs/netlist.md.
pub fn element_names() -> impl Iterator<Item = &'static str> {
    elements::MODELS.iter().map(|model| model.name)
}
