//! Runs a resolved program: definitions, loops and subnets become elements of a drawing.

use super::ast::{Def, Expr, Name, PI_SLOT, Program, Slot, Statement};
use super::diagnostic_sink::{DiagnosticSink, Reported};
use super::drawing::StructureBuilder;
use super::elements::Argument;
use super::rotation::Rotation;
use super::source::TextSpan;
use super::value::{LayerValues, Value, short};
use bimorph_base::Setting;
use bimorph_structure::NodeId;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Blocks, conditions, loops and instances together may nest this deep while running: bounds the stack.
const DEEPEST_RUN: usize = 400;
/// Statements, operators and values that one netlist may run: loops and recursion end here instead of never.
const MAX_STEPS: usize = 30_000_000;
/// Elements and subnet instances that one netlist may build; nodes it may name.
const MAX_ELEMENTS: usize = 300_000;

/// Variables and nodes of the netlist or of one subnet instance.
pub(super) struct EvaluationScope {
    pub(super) values: Vec<Value>,
    /// Nodes by the name they have here.
    pub(super) nodes: FxHashMap<Arc<str>, NodeId>,
    /// Names of the enclosing instances with a point after each.
    pub(super) prefix: Arc<str>,
    pub(super) rotation: Rotation,
    /// Layer that `parent` refers to here.
    pub(super) layer: Option<usize>,
    /// How often each anonymous line was run here.
    pub(super) anonymous: FxHashMap<usize, usize>,
}

/// Walks a program. See [`Elaborator::run`].
pub(crate) struct Elaborator<'p> {
    pub(super) program: &'p Program,
    settings: BTreeMap<&'p str, &'p Setting>,
    pub(super) sink: &'p mut DiagnosticSink,
    pub(super) frames: Vec<EvaluationScope>,
    pub(super) layers: Vec<Option<LayerValues<'p>>>,
    pub(super) drawing: StructureBuilder,
    parameters: Vec<(String, Setting)>,
    /// Variables that were set from outside.
    from_outside: FxHashSet<usize>,
    /// Where each stands in `parameters`.
    parameter_at: FxHashMap<&'p str, usize>,
    /// Full names defined so far, without the anonymous ones: the part before the last point, and the part after it.
    pub(super) names: FxHashSet<(Arc<str>, Arc<str>)>,
    /// Storage of node and parameter lists that are no longer needed.
    pub(super) spare: Vec<(Vec<NodeId>, Vec<Argument<'p>>)>,
    /// Statements and expressions run so far.
    pub(super) steps: usize,
    pub(super) elements: usize,
    depth: usize,
    pub(super) stopped: bool,
}

/// Result of an elaboration.
pub(crate) struct Elaborated {
    pub(crate) drawing: StructureBuilder,
    pub(crate) parameters: Vec<(String, Setting)>,
}

impl<'p> Elaborator<'p> {
    /// Runs `program` with parameters set from outside; errors go to the sink.
    pub(crate) fn run(program: &'p Program, set: &'p [(String, Setting)], sink: &'p mut DiagnosticSink) -> Elaborated {
        let mut values = vec![Value::Undefined; program.variables];
        values[PI_SLOT.index] = Value::Number(std::f64::consts::PI);
        let frame = EvaluationScope {
            values,
            nodes: FxHashMap::default(),
            prefix: Arc::default(),
            rotation: Rotation::IDENTITY,
            layer: None,
            anonymous: FxHashMap::default(),
        };
        let mut elaborator = Self {
            program,
            settings: set.iter().map(|(name, value)| (name.as_str(), value)).collect(),
            sink,
            frames: vec![frame],
            layers: vec![None; program.layers.len()],
            drawing: StructureBuilder::new(),
            parameters: Vec::new(),
            from_outside: FxHashSet::default(),
            parameter_at: FxHashMap::default(),
            names: FxHashSet::default(),
            spare: Vec::new(),
            steps: 0,
            elements: 0,
            depth: 0,
            stopped: false,
        };
        elaborator.statements(&program.statements);
        Elaborated { drawing: elaborator.drawing, parameters: elaborator.parameters }
    }

    // ---- variables ----

    fn frame(&mut self, slot: Slot) -> &mut EvaluationScope {
        let at = if slot.global { 0 } else { self.frames.len() - 1 };
        &mut self.frames[at]
    }

    pub(super) fn variable(&self, slot: Slot) -> &Value {
        let at = if slot.global { 0 } else { self.frames.len() - 1 };
        self.frames[at].values.get(slot.index).unwrap_or(&Value::Failed)
    }

    pub(super) fn assign(&mut self, slot: Slot, value: Value) {
        if let Some(place) = self.frame(slot).values.get_mut(slot.index) {
            *place = value;
        }
    }

    pub(super) fn here(&self) -> &EvaluationScope {
        &self.frames[self.frames.len() - 1]
    }

    /// The full name of what has this one in the frame at hand.
    pub(super) fn full(&self, local: &str) -> String {
        let prefix = &self.here().prefix;
        let mut full = String::with_capacity(prefix.len() + local.len());
        full.push_str(prefix);
        full.push_str(local);
        full
    }

    // ---- statements ----

    fn statements(&mut self, statements: &'p [Statement]) {
        for statement in statements {
            if self.stopped {
                return;
            }
            self.statement(statement);
        }
    }

    pub(super) fn nested(&mut self, statements: &'p [Statement]) {
        if self.depth >= DEEPEST_RUN {
            if !std::mem::replace(&mut self.stopped, true) {
                let message = format!("blocks and subnet instances nest more than {DEEPEST_RUN} deep");
                self.sink.error("E052", TextSpan::NOWHERE, message, "look for a subnet that calls itself without end");
            }
            return;
        }
        self.depth += 1;
        self.statements(statements);
        self.depth -= 1;
    }

    fn statement(&mut self, statement: &'p Statement) {
        if !self.may_go_on() {
            return;
        }
        match statement {
            Statement::Param { name, slot, default } => {
                let value = self.parameter(&name.name, name.span, default.as_ref());
                if slot.global && self.settings.contains_key(&*name.name) {
                    self.from_outside.insert(slot.index);
                }
                self.assign(*slot, value);
            }
            Statement::Process(_) | Statement::Subnet(_) => {}
            Statement::Def(def) => {
                let value = self.evaluate(&def.value).unwrap_or(Value::Failed);
                self.keep_setting(def, &value);
                self.assign(def.slot, value);
            }
            Statement::Block(body) => self.nested(body),
            Statement::Element(element) => {
                let _ = self.element(element);
            }
            Statement::For { slot, from, to, body, .. } => self.for_loop(*slot, (from, to), body),
            Statement::If { condition, then, otherwise } => match self.evaluate(condition) {
                Ok(Value::Number(truth)) if truth != 0.0 => self.nested(std::slice::from_ref(then)),
                Ok(Value::Number(_)) => {
                    if let Some(otherwise) = otherwise {
                        self.nested(std::slice::from_ref(otherwise));
                    }
                }
                Ok(other) => {
                    let message = format!("a condition must be a number, this is {}", other.called());
                    self.sink.error("E044", condition.span, message, "");
                }
                Err(Reported) => {}
            },
            Statement::Call(call) => {
                let _ = self.evaluate(call);
            }
        }
    }

    /// Counts a statement; false once the netlist has run or built too much.
    fn may_go_on(&mut self) -> bool {
        bimorph_base::budget::check();
        self.steps += 1;
        let built = self.elements.max(self.drawing.structure.nodes.len());
        if !self.stopped && (self.steps > MAX_STEPS || built > MAX_ELEMENTS) {
            self.stopped = true;
            let message = if built > MAX_ELEMENTS {
                format!("the netlist builds more than {MAX_ELEMENTS} elements or nodes")
            } else {
                format!("the netlist runs more than {MAX_STEPS} steps")
            };
            self.sink.error("E046", TextSpan::NOWHERE, message, "look for a loop or a subnet without end");
        }
        !self.stopped
    }

    fn parameter(&mut self, name: &'p str, span: TextSpan, default: Option<&'p Expr>) -> Value {
        let value = match (self.settings.get(name), default) {
            (Some(Setting::Number(x)), _) => Value::Number(*x),
            (Some(Setting::Text(text)), _) => Value::Text(Arc::from(text.as_str())),
            (None, Some(default)) => self.evaluate(default).unwrap_or(Value::Failed),
            (None, None) => {
                let help = format!("give it from outside: `--set {name}=VALUE`");
                self.sink.error("E045", span, format!("the parameter `{name}` has no default and was not set"), help);
                Value::Failed
            }
        };
        let setting = match &value {
            Value::Number(x) => Setting::Number(*x),
            Value::Text(text) => Setting::Text(text.to_string()),
            Value::Curve(_) | Value::Undefined | Value::Failed => return value,
        };
        match self.parameter_at.entry(name) {
            Entry::Occupied(at) => self.parameters[*at.get()].1 = setting,
            Entry::Vacant(at) => {
                at.insert(self.parameters.len());
                self.parameters.push((name.to_owned(), setting));
            }
        }
        value
    }

    /// Warns of a definition that replaces what was set from outside by something else.
    fn keep_setting(&mut self, def: &Def, value: &Value) {
        let set = def.slot.global && self.from_outside.contains(&def.slot.index);
        if !set || value == self.variable(def.slot) || def.value.names(def.slot) {
            return;
        }
        let name = &def.name.name;
        let message = format!("the parameter `{name}` was set from outside, and this line replaces its value");
        self.sink.warning("W023", def.name.span, message, format!("write `param {name} = …` in place of this line"));
    }

    fn for_loop(&mut self, slot: Slot, (from, to): (&'p Expr, &'p Expr), body: &'p [Statement]) {
        let (Ok(first), Ok(last)) = (self.whole(from, "a loop bound"), self.whole(to, "a loop bound")) else {
            return self.assign(slot, Value::Failed);
        };
        for k in first..=last {
            if !self.may_go_on() {
                return;
            }
            self.assign(slot, Value::Number(k as f64));
            self.nested(body);
        }
    }

    /// The value of an expression that must be a whole number.
    fn whole(&mut self, expr: &'p Expr, what: &str) -> Result<i64, Reported> {
        match self.evaluate(expr)? {
            Value::Number(x) if x.fract() == 0.0 && x.abs() <= f64::from(i32::MAX) => Ok(x as i64),
            Value::Number(x) => {
                let message = format!("{what} must be a whole number, this is {}", short(x));
                Err(self.sink.error("E047", expr.span, message, "use `round`, `floor` or `ceil`"))
            }
            other => {
                let message = format!("{what} must be a whole number, this is {}", other.called());
                Err(self.sink.error("E047", expr.span, message, ""))
            }
        }
    }

    // ---- names ----

    pub(super) fn name(&mut self, name: &'p Name) -> Result<Arc<str>, Reported> {
        if name.indices.is_empty() {
            return Ok(Arc::clone(&name.base.name));
        }
        let mut spelled = format!("{}(", name.base.name);
        for (i, index) in name.indices.iter().enumerate() {
            if i > 0 {
                spelled.push(',');
            }
            spelled.push_str(&self.whole(index, "an index")?.to_string());
        }
        spelled.push(')');
        Ok(Arc::from(spelled))
    }

    /// The node of that name in the frame at hand; a new one when the name is new.
    pub(super) fn node(&mut self, name: &'p Name) -> Result<NodeId, Reported> {
        let local = self.name(name)?;
        if let Some(&id) = self.here().nodes.get(&local) {
            return Ok(id);
        }
        let id = self.drawing.add_node(self.full(&local), name.span);
        let at = self.frames.len() - 1;
        self.frames[at].nodes.insert(local, id);
        Ok(id)
    }
}
