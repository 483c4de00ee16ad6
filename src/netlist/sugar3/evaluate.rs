//! Runs a SUGAR 3 netlist.

use super::super::bundle::{Bundle, MOST_INCLUDES};
use super::super::drawing::Drawing;
use super::super::elements;
use super::super::front::FrontEnd;
use super::super::rotation::Rotation;
use super::super::setting::Setting;
use super::super::sink::Sink;
use super::super::source::Span;
use super::super::{Loaded, finish, suggest};
use super::arguments::{LuaNode, number};
use super::builtins;
use super::sandbox::{Limit, Progress, sandbox};
use super::translate::translate;
use crate::budget;
use crate::structure::NodeId;
use mlua::{ChunkMode, Lua, Value};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;

/// Libraries of SUGAR 3 that are built in.
const BUILT_IN: [&str; 7] =
    ["std.net", "std2.net", "stdlib.net", "std2cvt.net", "xformstack.lua", "relpos.lua", "subnetize.lua"];
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
    bundle: Bundle,
}

impl Sugar3 {
    pub(crate) fn new(bundle: &Bundle) -> Self {
        Self { bundle: bundle.clone() }
    }
}

/// Where names of one scope live: the netlist itself, or one subnet instance.
#[derive(Debug)]
pub(super) struct Scope {
    pub(super) nodes: HashMap<String, NodeId>,
    /// Names of the enclosing instances with a point after each.
    pub(super) prefix: String,
    pub(super) rotation: Rotation,
}

/// What the functions of a netlist work on.
#[derive(Debug)]
pub(super) struct State {
    pub(super) drawing: Drawing,
    pub(super) sink: Sink,
    pub(super) scopes: Vec<Scope>,
    /// Full names of elements so far.
    pub(super) names: HashSet<String>,
    pub(super) elements: usize,
    /// Anonymous elements so far.
    pub(super) anonymous: usize,
    /// The first node with coordinates, and these [m].
    pub(super) first_placed: Option<(NodeId, [f64; 2])>,
    /// True once `std2cvt.net` is used: angles are in radians.
    pub(super) radians: bool,
    /// Files read so far, by name.
    used: HashSet<String>,
    /// Text of each file, in the order of the sink's.
    texts: Vec<Rc<Text>>,
    bundle: Rc<Bundle>,
    /// Globals that were read before anything was assigned to them, with their place in the order of reading.
    asked: HashMap<String, usize>,
    settings: BTreeMap<String, Setting>,
    parameters: BTreeMap<usize, (String, Setting)>,
    pub(super) progress: Rc<Progress>,
    /// True once a message says why the netlist stops.
    pub(super) told: Cell<bool>,
}

/// A text with the starts of its lines.
#[derive(Debug)]
struct Text {
    starts: Vec<usize>,
    text: String,
}

pub(super) type Shared = Rc<RefCell<State>>;

impl State {
    /// The place of line `line` (from 1) of file number `file`.
    fn line(&self, file: usize, line: usize) -> Span {
        let Some(text) = self.texts.get(file) else { return Span::NOWHERE };
        let Some(&start) = line.checked_sub(1).and_then(|line| text.starts.get(line)) else { return Span::NOWHERE };
        let end = text.starts.get(line).map_or(text.text.len(), |next| next - 1);
        let body = text.text.get(start..end).unwrap_or("");
        let indent = body.len() - body.trim_start().len();
        let at = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
        let file = u16::try_from(file).unwrap_or(u16::MAX);
        Span { file, start: at(start + indent), end: at(start + body.trim_end().len().max(indent)) }
    }

    /// The line of the netlist that is being run.
    pub(super) fn here(&self, lua: &Lua) -> Span {
        for level in 1..6 {
            let found = lua.inspect_stack(level, |debug| {
                let source = debug.source().source.map(|name| name.into_owned());
                (source.as_deref().and_then(file_number), debug.current_line())
            });
            match found {
                Some((Some(file), Some(line))) => return self.line(file, line),
                Some(_) => {}
                None => break,
            }
        }
        Span::NOWHERE
    }

    pub(super) fn scope(&mut self) -> &mut Scope {
        let last = self.scopes.len() - 1;
        &mut self.scopes[last]
    }

    /// The node of that name in the scope at hand, a new one when the name is new.
    pub(super) fn node(&mut self, name: &str, span: Span) -> (NodeId, bool) {
        if let Some(&id) = self.scope().nodes.get(name) {
            return (id, false);
        }
        let full = format!("{}{name}", self.scope().prefix);
        let id = self.drawing.add_node(full, span);
        self.scope().nodes.insert(name.to_owned(), id);
        self.progress.drawn.set(self.progress.drawn.get() + 1);
        (id, true)
    }

    pub(super) fn lua_node(&self, id: NodeId) -> LuaNode {
        LuaNode { id, name: self.drawing.structure.nodes[id.0].name.clone() }
    }

    /// A global that has no value yet: what was set from outside, if it was.
    pub(super) fn ask(&mut self, name: &str) -> Option<Setting> {
        let order = self.asked.len();
        let order = *self.asked.entry(name.to_owned()).or_insert(order);
        let setting = self.settings.get(name).cloned()?;
        self.parameters.insert(order, (name.to_owned(), setting.clone()));
        Some(setting)
    }

    /// A global that gets its first value: the default of a parameter, if it was asked for before.
    pub(super) fn assign(&mut self, name: &str, value: &Value) {
        let Some(&order) = self.asked.get(name) else { return };
        let setting = match (number(value), value) {
            (Some(x), _) => Setting::Number(x),
            (None, Value::String(text)) => Setting::Text(text.to_string_lossy()),
            _ => return,
        };
        self.parameters.entry(order).or_insert((name.to_owned(), setting));
    }
}

/// The number of the file that a chunk of that name was made from.
fn file_number(name: &str) -> Option<usize> {
    name.trim_start_matches('=').strip_prefix("file ")?.parse().ok()
}

impl FrontEnd for Sugar3 {
    fn load(&self, set: &[(String, Setting)]) -> Result<Loaded, super::super::Diagnostics> {
        let bytes: usize = self.bundle.files.values().map(String::len).sum();
        let progress = Rc::new(Progress::default());
        let state = State {
            drawing: Drawing::default(),
            sink: Sink::new(&self.bundle.root),
            scopes: vec![Scope { nodes: HashMap::new(), prefix: String::new(), rotation: Rotation::IDENTITY }],
            names: HashSet::new(),
            elements: 0,
            anonymous: 0,
            first_placed: None,
            radians: false,
            used: HashSet::from([self.bundle.root.clone()]),
            texts: Vec::new(),
            bundle: Rc::new(self.bundle.clone()),
            asked: HashMap::new(),
            settings: set.iter().cloned().collect(),
            parameters: BTreeMap::new(),
            progress: Rc::clone(&progress),
            told: Cell::new(false),
        };
        let shared = Rc::new(RefCell::new(state));
        // what Lua itself holds beside what it is limited to
        budget::lay_out(4 * bytes);
        let outcome = sandbox(bytes, &progress).and_then(|lua| {
            builtins::install(&lua, &shared)?;
            let ran = run(&lua, &shared, &self.bundle.root);
            if let Err(error) = ran {
                tell(&shared, &progress, &error);
            }
            Ok(())
        });
        let mut state = shared.borrow_mut();
        if let Err(error) = outcome {
            state.sink.error("E046", Span::NOWHERE, format!("Lua does not start: {error}"), "");
        }
        unasked(&mut state, set);
        let parameters = std::mem::take(&mut state.parameters).into_values().collect();
        finish(std::mem::take(&mut state.drawing), parameters, state.sink.clone(), &self.bundle)
    }
}

/// Runs a file of the bundle.
fn run(lua: &Lua, shared: &Shared, name: &str) -> mlua::Result<()> {
    let (number, text) = {
        let state = shared.borrow();
        (state.texts.len(), state.bundle.files.get(name).cloned().unwrap_or_default())
    };
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let translated = translate(&text);
    {
        let mut state = shared.borrow_mut();
        if number > 0 {
            state.sink.files.push(name.to_owned());
        }
        state.texts.push(Rc::new(Text { starts, text }));
        if let Err(found) = &translated {
            let at = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
            let file = u16::try_from(number).unwrap_or(u16::MAX);
            let span = Span { file, start: at(found.start), end: at(found.end) };
            state.sink.error("E071", span, found.message.clone(), found.help);
            state.told.set(true);
        }
    }
    let Ok(code) = translated else { return Err(mlua::Error::runtime("told")) };
    lua.load(code).set_name(format!("=file {number}")).set_mode(ChunkMode::Text).exec()
}

/// `use("FILE")`: a library of SUGAR 3's, or a file of the bundle, once.
pub(super) fn use_file(lua: &Lua, shared: &Shared, name: &str) -> mlua::Result<()> {
    let span = shared.borrow().here(lua);
    let stopped = || Err(mlua::Error::runtime("told"));
    {
        let mut state = shared.borrow_mut();
        if BUILT_IN.contains(&name) {
            state.radians |= name == "std2cvt.net";
            drop(state);
            return if name == "stdlib.net" { builtins::install_short(lua, shared) } else { Ok(()) };
        }
        if state.used.contains(name) {
            if name == state.bundle.root {
                state.sink.error("E022", span, format!("`{name}` includes itself"), "remove this line");
                state.told.set(true);
                return stopped();
            }
            return Ok(());
        }
        if !state.bundle.files.contains_key(name) {
            let help = "it is looked for in this file's folder, the working directory and the include folders";
            state.sink.error("E021", span, format!("cannot find the file `{name}`"), help);
            state.told.set(true);
            return stopped();
        }
        if state.used.len() > MOST_INCLUDES {
            state.sink.error("E024", span, format!("more than {MOST_INCLUDES} included files"), "");
            state.told.set(true);
            return stopped();
        }
        state.used.insert(name.to_owned());
    }
    let sugar2 = |line: &str| ["process ", "uses ", "param "].iter().any(|word| line.trim_start().starts_with(word));
    if shared.borrow().bundle.files[name].lines().any(sugar2) {
        let mut state = shared.borrow_mut();
        let message = format!("`{name}` is a SUGAR 2 file, this is a SUGAR 3 netlist");
        state.sink.error("E071", span, message, "use the process file of SUGAR 3: `p1 = material {h=2u, …}`");
        state.told.set(true);
        return stopped();
    }
    run(lua, shared, name)
}

/// Puts what Lua says into words of a netlist, with its place.
fn tell(shared: &Shared, progress: &Progress, error: &mlua::Error) {
    let mut state = shared.borrow_mut();
    if state.told.get() {
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
        Some(Limit::Instructions) => {
            ("E046", "the netlist runs too many instructions".to_owned(), "look for a loop without end")
        }
        Some(Limit::Time) => {
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
fn split_place(state: &State, text: &str) -> (Span, String) {
    let parsed = || {
        let rest = text.strip_prefix("file ")?;
        let (file, rest) = rest.split_once(':')?;
        let (line, rest) = rest.split_once(':')?;
        Some((state.line(file.parse().ok()?, line.parse().ok()?), rest.trim_start().to_owned()))
    };
    parsed().unwrap_or((Span::NOWHERE, text.to_owned()))
}

/// Reports settings that the netlist never asked for.
fn unasked(state: &mut State, set: &[(String, Setting)]) {
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
            state.sink.error("E048", Span::NOWHERE, format!("the netlist has no parameter `{name}` to set"), help);
        }
    }
}
