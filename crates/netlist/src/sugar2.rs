//! SUGAR 2 netlists: parsed and their names bound once, elaborated for each set of parameters.

use super::ast::{Program, Statement};
use super::diagnostic_sink::DiagnosticSink;
use super::elaborate::Elaborator;
use super::finish::finish;
use super::source::TextSpan;
use super::{parser, resolve};
use bimorph_base::suggest::{self, MAX_LISTED};
use bimorph_base::{Bundle, Diagnostics, Setting};
use bimorph_structure::{FrontEnd, LoadedNetlist};
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// A SUGAR 2 netlist that has been parsed.
#[derive(Debug)]
pub(crate) struct Sugar2 {
    bundle: Arc<Bundle>,
    program: Program,
    /// Messages of the parser.
    sink: DiagnosticSink,
}

impl Sugar2 {
    pub(crate) fn new(bundle: &Bundle) -> Self {
        let mut sink = DiagnosticSink::new(&bundle.root);
        let mut program = parser::parse(bundle, &mut sink);
        let parsed = (!sink.failed()).then(|| sink.clone());
        if !sink.failed() || program.incomplete {
            resolve::resolve(&mut program, &mut sink);
        }
        // what a library lacks is in the netlist that uses it
        if let Some(mut parsed) = parsed.filter(|_| sink.failed() && !program.subnets.is_empty())
            && !draws(&program.statements)
        {
            let subnets = program.subnets.len();
            let plural = if subnets == 1 { "" } else { "s" };
            let message = format!("`{}` is a library: it has {subnets} subnet{plural} and draws nothing", bundle.root);
            let help = "name it in `uses` of a netlist that has its layers and variables";
            let span = program.subnets[0].name.span;
            parsed.error("E007", span, message, help);
            sink = parsed;
        }
        Self { bundle: Arc::new(bundle.clone()), program, sink }
    }
}

/// True when statements outside subnets draw an element, or could.
fn draws(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Element(_) => true,
        Statement::Block(body) | Statement::For { body, .. } => draws(body),
        Statement::If { then, otherwise, .. } => {
            draws(std::slice::from_ref(then)) || otherwise.as_ref().is_some_and(|o| draws(std::slice::from_ref(o)))
        }
        _ => false,
    })
}

impl Sugar2 {
    /// Where each beam is drawn, for parameters set from outside; empty where the netlist has errors.
    pub(crate) fn beam_places(&self, set: &[(String, Setting)]) -> Vec<(String, usize)> {
        let mut sink = self.sink.clone();
        if sink.failed() {
            return Vec::new();
        }
        let drawing = Elaborator::run(&self.program, set, &mut sink).drawing;
        sink.lines(&self.bundle, &drawing.beam_spans)
    }
}

impl FrontEnd for Sugar2 {
    fn load(&self, set: &[(String, Setting)]) -> Result<LoadedNetlist, Diagnostics> {
        let (bundle, program) = (&self.bundle, &self.program);
        let mut sink = self.sink.clone();
        if !sink.failed() || program.incomplete {
            check_settings(program, set, &mut sink);
        }
        if sink.failed() {
            return Err(sink.finish(bundle));
        }
        let elaborated = Elaborator::run(program, set, &mut sink);
        finish(elaborated.drawing, elaborated.parameters, sink, bundle)
    }
}

/// Every name set from outside must be a parameter of the netlist.
fn check_settings(program: &Program, set: &[(String, Setting)], sink: &mut DiagnosticSink) {
    let names = program
        .statements
        .iter()
        .filter_map(|s| if let Statement::Param { name, .. } = s { Some(&*name.name) } else { None });
    let known: Vec<&str> = names.collect();
    let sorted: FxHashSet<&str> = known.iter().copied().collect();
    for (name, _) in set {
        if sorted.contains(name.as_str()) {
            continue;
        }
        if !sink.suggests() {
            sink.error("E048", TextSpan::NOWHERE, format!("the netlist has no parameter `{name}` to set"), "");
            continue;
        }
        let mut help = match known.as_slice() {
            [] => "the netlist has no `param`".to_owned(),
            names if names.len() <= MAX_LISTED => format!("its parameters are {}", names.join(" ")),
            names => format!("it has {} parameters, {} …", names.len(), names[..MAX_LISTED].join(" ")),
        };
        if let Some(meant) = suggest::nearest(name, known.iter().copied()) {
            help = format!("did you mean `{meant}`? {help}");
        }
        sink.error("E048", TextSpan::NOWHERE, format!("the netlist has no parameter `{name}` to set"), help);
    }
}

/// A bundle in SUGAR 2, for any content.
pub(crate) fn read(bundle: &Bundle) -> Box<dyn FrontEnd> {
    Box::new(Sugar2::new(bundle))
}
