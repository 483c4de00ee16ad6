//! State shared by the functions of a SUGAR 3 netlist.

use super::super::diagnostic_sink::DiagnosticSink;
use super::super::drawing::StructureBuilder;
use super::super::rotation::Rotation;
use super::super::source::TextSpan;
use super::arguments::{LuaNode, number};
use super::sandbox::SandboxProgress;
use bimorph_base::{Bundle, Setting};
use bimorph_structure::NodeId;
use mlua::{Lua, Value};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

/// Scope of names: the netlist itself, or one subnet instance.
#[derive(Debug)]
pub(super) struct NameScope {
    pub(super) nodes: HashMap<String, NodeId>,
    /// Names of the enclosing instances with a point after each.
    pub(super) prefix: String,
    pub(super) rotation: Rotation,
}

/// State shared by the functions of a netlist.
#[derive(Debug)]
pub(super) struct LuaState {
    pub(super) drawing: StructureBuilder,
    pub(super) sink: DiagnosticSink,
    pub(super) scopes: Vec<NameScope>,
    /// Full names of elements so far.
    pub(super) names: HashSet<String>,
    pub(super) elements: usize,
    /// Anonymous elements so far.
    pub(super) anonymous: usize,
    /// The first node with coordinates, and these (m).
    pub(super) first_placed: Option<(NodeId, [f64; 2])>,
    /// Coordinates that were given to nodes (m).
    pub(super) coordinates: HashMap<NodeId, [f64; 2]>,
    /// True once `std2cvt.net` is used: angles are in radians.
    pub(super) radians: bool,
    /// Files read so far, by name.
    pub(super) used: HashSet<String>,
    /// Text of each file, in the order of the sink's.
    pub(super) texts: Vec<Rc<IndexedText>>,
    pub(super) bundle: Arc<Bundle>,
    /// Globals that were read before anything was assigned to them, with their place in the order of reading.
    pub(super) asked: HashMap<String, usize>,
    pub(super) settings: BTreeMap<String, Setting>,
    pub(super) parameters: BTreeMap<usize, (String, Setting)>,
    pub(super) progress: Rc<SandboxProgress>,
    /// True once a message says why the netlist stops.
    pub(super) reported: Cell<bool>,
}

/// A text with the starts of its lines.
#[derive(Debug)]
pub(super) struct IndexedText {
    pub(super) starts: Vec<usize>,
    pub(super) text: String,
}

pub(super) type SharedState = Rc<RefCell<LuaState>>;

impl LuaState {
    /// The place of line `line` (from 1) of file number `file`.
    pub(super) fn line(&self, file: usize, line: usize) -> TextSpan {
        let Some(text) = self.texts.get(file) else { return TextSpan::NOWHERE };
        let Some(&start) = line.checked_sub(1).and_then(|line| text.starts.get(line)) else { return TextSpan::NOWHERE };
        let end = text.starts.get(line).map_or(text.text.len(), |next| next - 1);
        let body = text.text.get(start..end).unwrap_or("");
        let indent = body.len() - body.trim_start().len();
        let at = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
        let file = u16::try_from(file).unwrap_or(u16::MAX);
        TextSpan { file, start: at(start + indent), end: at(start + body.trim_end().len().max(indent)) }
    }

    /// The line of the netlist that is being run.
    pub(super) fn here(&self, lua: &Lua) -> TextSpan {
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
        TextSpan::NOWHERE
    }

    pub(super) fn scope(&mut self) -> &mut NameScope {
        let last = self.scopes.len() - 1;
        &mut self.scopes[last]
    }

    /// The node of that name in the scope at hand, a new one when the name is new.
    pub(super) fn node(&mut self, name: &str, span: TextSpan) -> NodeId {
        if let Some(&id) = self.scope().nodes.get(name) {
            return id;
        }
        let full = format!("{}{name}", self.scope().prefix);
        let id = self.drawing.add_node(full, span);
        self.scope().nodes.insert(name.to_owned(), id);
        self.progress.drawn.set(self.progress.drawn.get() + 1);
        id
    }

    pub(super) fn lua_node(&self, id: NodeId) -> LuaNode {
        LuaNode { id, name: self.drawing.structure.nodes[id.0].name.clone() }
    }

    /// Value of an undefined global from the settings, if there is one.
    pub(super) fn ask(&mut self, name: &str) -> Option<Setting> {
        let order = self.asked.len();
        let order = *self.asked.entry(name.to_owned()).or_insert(order);
        let setting = self.settings.get(name).cloned()?;
        self.parameters.insert(order, (name.to_owned(), setting.clone()));
        Some(setting)
    }

    /// A global that gets its first value: the default of a parameter, if it was read before.
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
pub(super) fn file_number(name: &str) -> Option<usize> {
    name.trim_start_matches('=').strip_prefix("file ")?.parse().ok()
}
