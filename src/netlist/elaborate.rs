//! Runs a resolved program: definitions, loops and subnets become elements of a drawing.

use super::ast::{Element, Expr, Layer, LayerRef, Name, Program, Slot, Statement};
use super::drawing::Drawing;
use super::elements::{self, Argument, Arguments, Instance};
use super::evaluate::PI_SLOT;
use super::rotation::Rotation;
use super::setting::Setting;
use super::sink::{Reported, Sink};
use super::source::Span;
use super::value::{Value, short};
use crate::structure::NodeId;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

/// Subnet instances may nest this deep.
const DEEPEST_INSTANCE: usize = 100;
/// Statements that one netlist may run: loops and recursion end here instead of never.
const MOST_STATEMENTS: usize = 20_000_000;
/// Elements and subnet instances that one netlist may build.
const MOST_ELEMENTS: usize = 1_000_000;

/// A layer's entries, evaluated: its own before its parent's.
pub(crate) type LayerValues<'p> = Rc<Vec<(&'p str, Value)>>;

/// Variables and nodes of the netlist or of one subnet instance.
struct Frame {
    values: Vec<Value>,
    /// Nodes by the name they have here.
    nodes: HashMap<Rc<str>, NodeId>,
    /// Names of the enclosing instances with a point after each.
    prefix: String,
    rotation: Rotation,
    /// What `parent` means here.
    layer: Option<usize>,
}

/// Walks a program. See [`Elaborator::run`].
pub(crate) struct Elaborator<'p> {
    program: &'p Program,
    settings: BTreeMap<&'p str, &'p Setting>,
    pub(super) sink: &'p mut Sink,
    frames: Vec<Frame>,
    layers: Vec<Option<LayerValues<'p>>>,
    drawing: Drawing,
    parameters: Vec<(String, Setting)>,
    statements: usize,
    elements: usize,
    stopped: bool,
}

/// What an elaboration yields.
pub(crate) struct Elaborated {
    pub(crate) drawing: Drawing,
    pub(crate) parameters: Vec<(String, Setting)>,
}

impl<'p> Elaborator<'p> {
    /// Runs `program` with parameters set from outside; errors go to the sink.
    pub(crate) fn run(program: &'p Program, set: &'p [(String, Setting)], sink: &'p mut Sink) -> Elaborated {
        let mut values = vec![Value::Undefined; program.variables];
        values[PI_SLOT.index] = Value::Number(std::f64::consts::PI);
        let frame =
            Frame { values, nodes: HashMap::new(), prefix: String::new(), rotation: Rotation::IDENTITY, layer: None };
        let mut elaborator = Self {
            program,
            settings: set.iter().map(|(name, value)| (name.as_str(), value)).collect(),
            sink,
            frames: vec![frame],
            layers: vec![None; program.layers.len()],
            drawing: Drawing::default(),
            parameters: Vec::new(),
            statements: 0,
            elements: 0,
            stopped: false,
        };
        elaborator.statements(&program.statements);
        Elaborated { drawing: elaborator.drawing, parameters: elaborator.parameters }
    }

    // ---- variables ----

    fn frame(&mut self, slot: Slot) -> &mut Frame {
        let at = if slot.global { 0 } else { self.frames.len() - 1 };
        &mut self.frames[at]
    }

    pub(super) fn variable(&self, slot: Slot) -> &Value {
        let at = if slot.global { 0 } else { self.frames.len() - 1 };
        self.frames[at].values.get(slot.index).unwrap_or(&Value::Failed)
    }

    fn assign(&mut self, slot: Slot, value: Value) {
        if let Some(place) = self.frame(slot).values.get_mut(slot.index) {
            *place = value;
        }
    }

    fn here(&self) -> &Frame {
        &self.frames[self.frames.len() - 1]
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

    fn statement(&mut self, statement: &'p Statement) {
        if !self.may_go_on() {
            return;
        }
        match statement {
            Statement::Param { name, slot, default } => {
                let value = self.parameter(&name.name, name.span, default.as_ref());
                self.assign(*slot, value);
            }
            Statement::Process(_) | Statement::Subnet(_) => {}
            Statement::Def(def) => {
                let value = self.evaluate(&def.value).unwrap_or(Value::Failed);
                self.assign(def.slot, value);
            }
            Statement::Block(body) => self.statements(body),
            Statement::Element(element) => {
                let _ = self.element(element);
            }
            Statement::For { slot, from, to, body, .. } => self.for_loop(*slot, (from, to), body),
            Statement::If { condition, then, otherwise } => match self.evaluate(condition) {
                Ok(Value::Number(truth)) if truth != 0.0 => self.statement(then),
                Ok(Value::Number(_)) => {
                    if let Some(otherwise) = otherwise {
                        self.statement(otherwise);
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

    /// Counts a statement; false once the netlist has run too many.
    fn may_go_on(&mut self) -> bool {
        self.statements += 1;
        if !self.stopped && (self.statements > MOST_STATEMENTS || self.elements > MOST_ELEMENTS) {
            self.stopped = true;
            let message = if self.elements > MOST_ELEMENTS {
                format!("the netlist builds more than {MOST_ELEMENTS} elements")
            } else {
                format!("the netlist runs more than {MOST_STATEMENTS} statements")
            };
            self.sink.error("E046", Span::NOWHERE, message, "look for a loop or a subnet without end");
        }
        !self.stopped
    }

    fn parameter(&mut self, name: &'p str, span: Span, default: Option<&'p Expr>) -> Value {
        let value = match (self.settings.get(name), default) {
            (Some(Setting::Number(x)), _) => Value::Number(*x),
            (Some(Setting::Text(text)), _) => Value::Text(Rc::from(text.as_str())),
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
            Value::Undefined | Value::Failed => return value,
        };
        match self.parameters.iter_mut().find(|(known, _)| known == name) {
            Some((_, old)) => *old = setting,
            None => self.parameters.push((name.to_owned(), setting)),
        }
        value
    }

    fn for_loop(&mut self, slot: Slot, (from, to): (&'p Expr, &'p Expr), body: &'p [Statement]) {
        let (Ok(first), Ok(last)) = (self.whole(from, "a loop bound"), self.whole(to, "a loop bound")) else {
            return self.assign(slot, Value::Failed);
        };
        for k in first..=last {
            if !self.may_go_on() {
                return;
            }
            #[allow(clippy::cast_precision_loss, reason = "bounds are whole numbers that came from doubles")]
            self.assign(slot, Value::Number(k as f64));
            self.statements(body);
        }
    }

    /// The value of an expression that must be a whole number.
    fn whole(&mut self, expr: &'p Expr, what: &str) -> Result<i64, Reported> {
        match self.evaluate(expr)? {
            #[allow(clippy::cast_possible_truncation, reason = "checked to be whole and within 32 bits")]
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

    fn name(&mut self, name: &'p Name) -> Result<Rc<str>, Reported> {
        if name.indices.is_empty() {
            return Ok(Rc::clone(&name.base.name));
        }
        let mut spelled = format!("{}(", name.base.name);
        for (i, index) in name.indices.iter().enumerate() {
            if i > 0 {
                spelled.push(',');
            }
            spelled.push_str(&self.whole(index, "an index")?.to_string());
        }
        spelled.push(')');
        Ok(Rc::from(spelled))
    }

    /// The node of that name in the frame at hand; a new one when the name is new.
    fn node(&mut self, name: &'p Name) -> Result<NodeId, Reported> {
        let local = self.name(name)?;
        if let Some(&id) = self.here().nodes.get(&local) {
            return Ok(id);
        }
        let id = self.drawing.add_node(format!("{}{local}", self.here().prefix), name.span);
        let at = self.frames.len() - 1;
        self.frames[at].nodes.insert(local, id);
        Ok(id)
    }

    // ---- elements ----

    fn element(&mut self, element: &'p Element) -> Result<(), Reported> {
        self.elements += 1;
        let local: Rc<str> = match &element.name {
            Some(name) => self.name(name)?,
            None => Rc::from(format!("anon{}", element.number)),
        };
        let mut nodes = Vec::with_capacity(element.nodes.len());
        for name in &element.nodes {
            nodes.push(self.node(name)?);
        }
        let mut given = Vec::with_capacity(element.parameters.len());
        let mut angles = [0.0; 3];
        let mut failed = false;
        for def in &element.parameters {
            let Ok(value) = self.evaluate(&def.value) else {
                failed = true;
                continue;
            };
            let axis = ["ox", "oy", "oz"].iter().position(|o| **o == *def.name.name);
            match (axis, &value) {
                (Some(axis), Value::Number(angle)) => {
                    angles[axis] = *angle;
                    self.check_angle(&def.name.name, *angle, def.value.span);
                }
                (Some(_), other) => {
                    let message = format!("`{}` must be a number, this is {}", def.name.name, other.called());
                    self.sink.error("E050", def.value.span, message, "");
                    failed = true;
                }
                (None, _) => {
                    given.push(Argument { name: &def.name.name, value, span: def.name.span.to(def.value.span) });
                }
            }
        }
        if failed {
            return Err(Reported);
        }
        let rotation = self.here().rotation.turned(angles[0], angles[1], angles[2]);
        let layer = match element.layer {
            LayerRef::None => None,
            LayerRef::Parent => self.here().layer,
            LayerRef::Layer(index) => Some(index),
        };
        match element.subnet {
            Some(subnet) => self.subnet(element, subnet, &local, &nodes, &given, rotation, layer),
            None => {
                let values = layer.map_or_else(|| Ok(Rc::new(Vec::new())), |layer| self.layer(layer))?;
                let instance = Instance {
                    name: format!("{}{local}", self.here().prefix),
                    model: &element.model.name,
                    span: element.model.span,
                    nodes,
                    nodes_span: element.nodes_span,
                    rotation,
                    arguments: Arguments {
                        given,
                        layer: values,
                        layer_name: layer.map(|l| &*self.program.layers[l].name.name),
                    },
                };
                elements::build(&instance, &mut self.drawing, self.sink)
            }
        }
    }

    fn check_angle(&mut self, name: &str, angle: f64, span: Span) {
        let divides = 360.0 % angle.abs() == 0.0;
        if angle.abs() > std::f64::consts::TAU && (divides || angle.fract() == 0.0) {
            let help = format!("for degrees write `{name}=deg({})`", short(angle));
            let message = format!("angles are in radians; {} looks like degrees", short(angle));
            self.sink.warning("W003", span, message, help);
        }
    }

    /// Values of a layer's entries, evaluated now: a layer may name variables that change along the netlist.
    fn layer(&mut self, index: usize) -> Result<LayerValues<'p>, Reported> {
        if let Some(values) = &self.layers[index] {
            return Ok(Rc::clone(values));
        }
        let program = self.program;
        let mut values = Vec::new();
        let mut next: Option<&'p Layer> = Some(&program.layers[index]);
        while let Some(layer) = next {
            for entry in &layer.entries {
                values.push((&*entry.name.name, self.evaluate(&entry.value)?));
            }
            next = layer.parent.map(|parent| &program.layers[parent]);
        }
        let values = Rc::new(values);
        if program.layers[index].constant {
            self.layers[index] = Some(Rc::clone(&values));
        }
        Ok(values)
    }

    // ---- subnets ----

    #[allow(clippy::too_many_arguments, reason = "the parts of one instance, used once")]
    fn subnet(
        &mut self,
        element: &'p Element,
        index: usize,
        local: &str,
        nodes: &[NodeId],
        given: &[Argument<'p>],
        rotation: Rotation,
        layer: Option<usize>,
    ) -> Result<(), Reported> {
        let subnet = &self.program.subnets[index];
        let model = &*element.model.name;
        if nodes.len() != subnet.nodes.len() {
            let (wanted, got) = (subnet.nodes.len(), nodes.len());
            let names: Vec<&str> = subnet.nodes.iter().map(|n| &*n.base.name).collect();
            let message = format!("subnet `{model}` has {wanted} nodes, {got} given");
            let help = format!("its nodes are [{}]", names.join(" "));
            return Err(self.sink.error("E051", element.nodes_span, message, help));
        }
        if self.frames.len() > DEEPEST_INSTANCE {
            self.stopped = true;
            let message = format!("subnet instances nest more than {DEEPEST_INSTANCE} deep: `{model}` calls itself without end");
            return Err(self.sink.error("E052", element.model.span, message, "end the recursion with an `if`"));
        }
        elements::stray_actuals(model, given, subnet.formals.iter().map(|f| &*f.name.name), self.sink);
        let layer_values = layer.map_or_else(|| Ok(Rc::new(Vec::new())), |layer| self.layer(layer))?;
        let prefix = format!("{}{local}.", self.here().prefix);
        let frame = Frame {
            values: vec![Value::Undefined; subnet.variables],
            nodes: HashMap::with_capacity(2 * nodes.len()),
            prefix,
            rotation,
            layer,
        };
        let instance = frame.prefix.trim_end_matches('.').to_owned();
        self.frames.push(frame);
        let result = self.bind(element, index, nodes, given, &layer_values);
        if result.is_ok() {
            self.sink.calls.push((instance, element.model.span));
            self.statements(&subnet.body);
            self.sink.calls.pop();
        }
        self.frames.pop();
        result
    }

    /// Gives the formal nodes and parameters of a new frame their values: actual, then default, then layer.
    fn bind(
        &mut self,
        element: &'p Element,
        index: usize,
        nodes: &[NodeId],
        given: &[Argument<'p>],
        layer: &LayerValues<'p>,
    ) -> Result<(), Reported> {
        let subnet = &self.program.subnets[index];
        for (formal, id) in subnet.nodes.iter().zip(nodes) {
            let name = self.name(formal)?;
            let at = self.frames.len() - 1;
            self.frames[at].nodes.insert(name, *id);
        }
        for formal in &subnet.formals {
            let name = &*formal.name.name;
            let actual = given.iter().find(|a| a.name == name).map(|a| a.value.clone());
            let mut value = actual.unwrap_or(Value::Undefined);
            if let (Value::Undefined, Some(default)) = (&value, &formal.default) {
                value = self.evaluate(default)?;
            }
            if value == Value::Undefined
                && let Some((_, found)) = layer.iter().find(|(entry, _)| *entry == name)
            {
                value = found.clone();
            }
            if value == Value::Undefined && formal.default.is_none() {
                let message = format!("subnet `{}` needs the parameter `{name}`", element.model.name);
                let help = format!("give `{name}=`, or take it from a layer that has it");
                return Err(self.sink.error("E053", element.model.span, message, help));
            }
            self.assign(formal.slot, value);
        }
        Ok(())
    }
}
