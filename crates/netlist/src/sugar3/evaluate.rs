//! Runs a SUGAR 3 netlist.

use super::super::diagnostic_sink::DiagnosticSink;
use super::super::drawing::StructureBuilder;
use super::super::elements;
use super::super::finish::finish;
use super::super::rotation::Rotation;
use super::super::source::TextSpan;
use super::builtins;
use super::files::run;
use super::sandbox::{SandboxLimit, SandboxProgress, sandbox};
use super::state::{LuaState, NameScope, SharedState, file_number};
use bimorph_base::budget;
use bimorph_base::suggest;
use bimorph_base::{Bundle, Setting};
use bimorph_structure::{Fringe, FrontEnd, LoadedNetlist};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

/// Names that SUGAR 3's Lua has and netlists here have not, for help.
const ABSENT: [&str; 14] = [
    "os",
    "io",
    "string",
    "table",
    "coroutine",
    "debug",
    "package",
    "require",
    "load",
    "dofile",
    "loadstring",
    "pcall",
    "setmetatable",
    "collectgarbage",
];

/// A SUGAR 3 netlist. It is run anew for each set of parameters.
#[derive(Debug)]
pub(crate) struct Sugar3 {
    bundle: Arc<Bundle>,
}

impl Sugar3 {
    pub(crate) fn new(bundle: &Bundle) -> Self {
        Self { bundle: Arc::new(bundle.clone()) }
    }
}

impl FrontEnd for Sugar3 {
    fn load(&self, set: &[(String, Setting)]) -> Result<LoadedNetlist, bimorph_base::Diagnostics> {
        let bytes: usize = self.bundle.files.values().map(String::len).sum();
        let progress = Rc::new(SandboxProgress::default());
        let state = LuaState {
            drawing: StructureBuilder::default(),
            sink: DiagnosticSink::new(&self.bundle.root),
            scopes: vec![NameScope { nodes: HashMap::new(), prefix: String::new(), rotation: Rotation::IDENTITY }],
            names: HashSet::new(),
            elements: 0,
            anonymous: 0,
            first_placed: None,
            coordinates: HashMap::new(),
            radians: false,
            used: HashSet::from([self.bundle.root.clone()]),
            texts: Vec::new(),
            bundle: Arc::clone(&self.bundle),
            asked: HashMap::new(),
            settings: set.iter().cloned().collect(),
            parameters: BTreeMap::new(),
            progress: Rc::clone(&progress),
            reported: Cell::new(false),
        };
        let shared = Rc::new(RefCell::new(state));
        // what Lua itself holds beside what it is limited to
        budget::lay_out(4 * bytes);
        let outcome = sandbox(bytes, &progress).and_then(|lua| {
            builtins::install(&lua, &shared)?;
            let ran = run(&lua, &shared, &self.bundle.root);
            if let Err(error) = ran {
                report_error(&shared, &progress, &error);
            }
            Ok(())
        });
        let mut state = shared.borrow_mut();
        if let Err(error) = outcome {
            state.sink.error("E046", TextSpan::NOWHERE, format!("Lua does not start: {error}"), "");
        }
        unasked(&mut state, set);
        let parameters = std::mem::take(&mut state.parameters).into_values().collect();
        let mut drawing = std::mem::take(&mut state.drawing);
        for gap in &mut drawing.structure.beam_gaps {
            gap.law.get_or_insert(Fringe::Sugar);
        }
        for comb in &mut drawing.structure.combs {
            comb.law.get_or_insert(Fringe::None);
        }
        for plate in &mut drawing.structure.plate_gaps {
            plate.law.get_or_insert(Fringe::None);
        }
        finish(drawing, parameters, state.sink.clone(), &self.bundle)
    }
}

/// Puts what Lua says into words of a netlist, with its place.
fn report_error(shared: &SharedState, progress: &SandboxProgress, error: &mlua::Error) {
    let mut state = shared.borrow_mut();
    if state.reported.get() {
        return;
    }
    let mut cause = error;
    while let mlua::Error::CallbackError { cause: inner, .. } = cause {
        cause = inner;
    }
    let (syntax, text) = match cause {
        mlua::Error::SyntaxError { message, .. } => (true, message.clone()),
        mlua::Error::RuntimeError(message) => (false, message.clone()),
        other => (false, other.to_string()),
    };
    let text = text.lines().next().unwrap_or("").to_owned();
    let (mut span, text) = split_place(&state, &text);
    if let Some((file, line)) = progress.at.borrow_mut().take() {
        span = file_number(&file).map_or(span, |file| state.line(file, line));
    }
    let memory = matches!(cause, mlua::Error::MemoryError(_)) || text.contains("not enough memory");
    let (code, message, help) = match progress.met.get() {
        Some(SandboxLimit::Instructions) => {
            ("E046", "the netlist runs too many instructions".to_owned(), "look for a loop without end")
        }
        Some(SandboxLimit::Time) => {
            ("E046", "the netlist runs too long without drawing anything".to_owned(), "look for a loop without end")
        }
        None if memory => (
            "E046",
            "the netlist takes too much memory".to_owned(),
            "look for a table or a string that grows without end",
        ),
        None if syntax => ("E071", text, ""),
        None if let Some(name) = called_nothing(&text) => {
            if builtins::OWN.contains(&name) {
                let help = format!("write `element {{…; model=\"{name}\"}}`");
                state.sink.error("E055", span, format!("`{name}` is no function"), help);
            } else {
                elements::unknown(&mut state.sink, name, span, []);
            }
            return;
        }
        None => {
            let absent = ABSENT.iter().any(|name| text.contains(&format!("'{name}'")));
            let help =
                if absent { "netlists have no access to files or the system, and none of Lua's libraries" } else { "" };
            ("E072", text, help)
        }
    };
    state.sink.error(code, span, message, help);
}

/// The name of a global that was called and is nothing, unless it is one of Lua's libraries.
fn called_nothing(text: &str) -> Option<&str> {
    let name = text.strip_prefix("attempt to call a nil value (global '")?.strip_suffix("')")?;
    (!ABSENT.contains(&name)).then_some(name)
}

/// The place that a message of Lua's begins with, "file 2:13: …", and the rest of it.
fn split_place(state: &LuaState, text: &str) -> (TextSpan, String) {
    let parsed = || {
        let rest = text.strip_prefix("file ")?;
        let (file, rest) = rest.split_once(':')?;
        let (line, rest) = rest.split_once(':')?;
        Some((state.line(file.parse().ok()?, line.parse().ok()?), rest.trim_start().to_owned()))
    };
    parsed().unwrap_or((TextSpan::NOWHERE, text.to_owned()))
}

/// Reports settings that the netlist never reads.
fn unasked(state: &mut LuaState, set: &[(String, Setting)]) {
    let known: Vec<String> = state.parameters.values().map(|(name, _)| name.clone()).collect();
    for (name, _) in set.iter().filter(|(name, _)| !known.contains(name)) {
        let listed = match known.as_slice() {
            [] => "a parameter is a global that is read before it is set: `w = w or 2u`; there is none".to_owned(),
            names => format!("its parameters are {}", names.join(" ")),
        };
        let help = match suggest::nearest(name, known.iter().map(String::as_str)) {
            Some(meant) => format!("did you mean `{meant}`? {listed}"),
            None => listed,
        };
        if !state.sink.failed() {
            state.sink.error("E048", TextSpan::NOWHERE, format!("the netlist has no parameter `{name}` to set"), help);
        }
    }
}
