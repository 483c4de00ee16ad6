//! SUGAR netlists: text → tokens → syntax tree → elaborated [`Structure`].
//!
//! [`Bundle`] holds the text of a netlist and of every file it includes, so that nothing after it touches the disk: a
//! bundle can be sent to a server as it is. [`load`] turns a bundle into a structure, or into diagnostics.
//!
//! One module a step: `lexer` makes tokens, `parser`, `statement` and `expression` the tree with all includes in place, `resolve`
//! binds names, `elaborate` and `instance` run definitions, loops and subnets, `elements` builds what they instantiate, `place` walks
//! over the drawing for node positions, and `check` looks for loose ends. docs/netlist.md describes the language.

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
mod suggest;
mod token;
mod value;

pub use bundle::{Bundle, DroppedInclude};
pub use diagnostic::{Diagnostic, Diagnostics, Severity};
pub use setting::Setting;

use crate::structure::Structure;
use ast::{Program, Statement};
use elaborate::Elaborator;
use sink::Sink;
use source::Span;
use std::collections::HashSet;

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

/// A bundle that has been read: parsed, and its names bound. What is drawn depends on the values of parameters too.
#[derive(Debug)]
pub struct Source {
    bundle: Bundle,
    program: Program,
    /// What reading had to say.
    sink: Sink,
}

impl Source {
    /// Reads a bundle. Errors come out with [`Source::load`].
    pub fn new(bundle: &Bundle) -> Self {
        let mut sink = Sink::new(&bundle.root);
        let mut program = parser::parse(bundle, &mut sink);
        if !sink.failed() || program.incomplete {
            resolve::resolve(&mut program, &mut sink);
        }
        Self { bundle: bundle.clone(), program, sink }
    }

    /// Elaborates it with parameters set from outside.
    ///
    /// # Errors
    /// Every error found in one run, those of reading too; warnings are among them.
    pub fn load(&self, set: &[(String, Setting)]) -> Result<Loaded, Diagnostics> {
        let (bundle, program) = (&self.bundle, &self.program);
        let mut sink = self.sink.clone();
        if !sink.failed() || program.incomplete {
            check_settings(program, set, &mut sink);
        }
        if sink.failed() {
            return Err(sink.finish(bundle));
        }
        let mut elaborated = Elaborator::run(program, set, &mut sink);
        elements::upright::settle(&mut elaborated.drawing, &mut sink);
        if !sink.failed() {
            place::place(&mut elaborated.drawing, &mut sink);
            check::check(&elaborated.drawing, &mut sink);
        }
        if sink.failed() {
            return Err(sink.finish(bundle));
        }
        let warnings = sink.finish(bundle);
        Ok(Loaded { structure: elaborated.drawing.structure, parameters: elaborated.parameters, warnings })
    }
}

/// The names of all built-in elements, in the order of docs/netlist.md.
pub fn element_names() -> impl Iterator<Item = &'static str> {
    elements::MODELS.iter().map(|model| model.name)
}

/// Every name set from outside must be a parameter of the netlist.
fn check_settings(program: &Program, set: &[(String, Setting)], sink: &mut Sink) {
    let names = program
        .statements
        .iter()
        .filter_map(|s| if let Statement::Param { name, .. } = s { Some(&*name.name) } else { None });
    let known: Vec<&str> = names.collect();
    let sorted: HashSet<&str> = known.iter().copied().collect();
    for (name, _) in set {
        if sorted.contains(name.as_str()) {
            continue;
        }
        if !sink.suggests() {
            sink.error("E048", Span::NOWHERE, format!("the netlist has no parameter `{name}` to set"), "");
            continue;
        }
        let mut help = match known.as_slice() {
            [] => "the netlist has no `param`".to_owned(),
            names if names.len() <= MOST_LISTED => format!("its parameters are {}", names.join(" ")),
            names => format!("it has {} parameters, {} …", names.len(), names[..MOST_LISTED].join(" ")),
        };
        if let Some(meant) = suggest::nearest(name, known.iter().copied()) {
            help = format!("did you mean `{meant}`? {help}");
        }
        sink.error("E048", Span::NOWHERE, format!("the netlist has no parameter `{name}` to set"), help);
    }
}
