//! Binds names to variables, layers and subnets, in the order of the text: a definition must precede its use.
//!
//! A block opens a scope: names first defined inside it end with it, assignments to outer names stay. A definition
//! inside a subnet never touches a variable of the netlist; those can be read there.

use super::ast::{
    Def, ElementStatement, Expr, ExprKind, Ident, LayerDefinition, LayerRef, Name, Program, Slot, Statement,
};
use super::diagnostic_sink::DiagnosticSink;
use super::elements;
use super::functions;
use bimorph_base::suggest::{MAX_LISTED, did_you_mean};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Resolves every name of a program; errors go to the sink.
pub(crate) fn resolve(program: &mut Program, sink: &mut DiagnosticSink) {
    let incomplete = program.incomplete;
    let mut resolver = Resolver {
        sink,
        scopes: vec![BTreeMap::new()],
        globals: 0,
        locals: None,
        layers: BTreeMap::new(),
        subnets: BTreeMap::new(),
        unknown: BTreeSet::new(),
        incomplete,
        beside: Vec::new(),
        layers_used: 0,
    };
    let pi = resolver.define(&Arc::from("pi"));
    debug_assert_eq!(pi, super::ast::PI_SLOT);
    let mut statements = std::mem::take(&mut program.statements);
    // A subnet may be used before its text (SUGAR has no such rule, but no other meaning either) unless an element of
    // that name is built in.
    for (index, subnet) in program.subnets.iter().enumerate() {
        if elements::model(&subnet.name.name).is_none() {
            resolver.subnets.entry(Arc::clone(&subnet.name.name)).or_insert(index);
        }
    }
    resolver.statements(&mut statements, program);
    program.statements = statements;
    program.variables = resolver.globals;
}

struct Resolver<'a> {
    sink: &'a mut DiagnosticSink,
    scopes: Vec<BTreeMap<Arc<str>, Slot>>,
    globals: usize,
    /// Number of variables of the subnet at hand; none outside subnets.
    locals: Option<usize>,
    layers: BTreeMap<Arc<str>, usize>,
    subnets: BTreeMap<Arc<str>, usize>,
    /// Names already reported while an include is missing: one message each is enough then.
    unknown: BTreeSet<Arc<str>>,
    incomplete: bool,
    /// Parameters of the list at hand, for the message that they do not see each other.
    beside: Vec<Arc<str>>,
    /// Number of variables used, to detect constant layers.
    layers_used: usize,
}

impl Resolver<'_> {
    fn lookup(&self, name: &str) -> Option<Slot> {
        self.scopes.iter().rev().find_map(|scope| scope.get(name)).copied()
    }

    /// The variable that a definition of `name` here sets: an existing one or a new one.
    fn define(&mut self, name: &Arc<str>) -> Slot {
        let known = self.lookup(name).filter(|slot| self.locals.is_none() || !slot.global);
        known.unwrap_or_else(|| self.fresh(name))
    }

    fn fresh(&mut self, name: &Arc<str>) -> Slot {
        let count = self.locals.as_mut().unwrap_or(&mut self.globals);
        let index = *count;
        *count += 1;
        let slot = Slot { global: self.locals.is_none(), index };
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(Arc::clone(name), slot);
        }
        slot
    }

    fn scoped(&mut self, inside: impl FnOnce(&mut Self)) {
        self.scopes.push(BTreeMap::new());
        inside(self);
        self.scopes.pop();
    }

    fn statements(&mut self, statements: &mut [Statement], program: &mut Program) {
        for statement in statements {
            bimorph_base::budget::check();
            self.statement(statement, program);
        }
    }

    fn statement(&mut self, statement: &mut Statement, program: &mut Program) {
        match statement {
            Statement::Param { name, slot, default } => {
                if let Some(value) = default {
                    self.expression(value);
                }
                *slot = self.define(&name.name);
            }
            Statement::Process(index) => self.process(*index, program),
            Statement::Subnet(index) => self.subnet(*index, program),
            Statement::Def(def) => self.def(def),
            Statement::Block(body) => self.scoped(|r| r.statements(body, program)),
            Statement::Element(element) => self.element(element),
            Statement::For { index, slot, from, to, body } => {
                self.expression(from);
                self.expression(to);
                *slot = self.define(&index.name);
                self.scoped(|r| r.statements(body, program));
            }
            Statement::If { condition, then, otherwise } => {
                self.expression(condition);
                self.statement(then, program);
                if let Some(otherwise) = otherwise {
                    self.statement(otherwise, program);
                }
            }
            Statement::Call(call) => self.expression(call),
        }
    }

    fn def(&mut self, def: &mut Def) {
        self.expression(&mut def.value);
        def.slot = self.define(&def.name.name);
    }

    /// Values of a parameter list: they see what stands outside the list, not each other.
    fn list(&mut self, defs: &mut [Def]) {
        self.beside = defs.iter().map(|def| Arc::clone(&def.name.name)).collect();
        for def in defs {
            // a word stands for itself, unless a variable has its name
            if elements::is_word(&def.name.name)
                && let ExprKind::Variable(word, _) = &def.value.kind
                && self.lookup(word).is_none()
            {
                def.value.kind = ExprKind::Text(Arc::clone(word));
            }
            self.expression(&mut def.value);
        }
        self.beside.clear();
    }

    fn process(&mut self, index: usize, program: &mut Program) {
        let mut layer = program.layers[index].clone();
        self.misspelt_entries(&layer, program);
        let before = self.layers_used;
        self.list(&mut layer.entries);
        layer.constant = before == self.layers_used;
        if let Some(parent) = &layer.parent_name {
            match self.layers.get(&parent.name) {
                Some(&found) => {
                    layer.parent = Some(found);
                    layer.constant &= program.layers[found].constant;
                }
                None => self.unknown_layer(parent),
            }
        }
        self.layers.insert(Arc::clone(&layer.name.name), index);
        program.layers[index] = layer;
    }

    /// Warns of entries that nothing reads and that look like a slip of one that is read.
    fn misspelt_entries(&mut self, layer: &LayerDefinition, program: &Program) {
        for entry in &layer.entries {
            let name = &*entry.name.name;
            let formal = || program.subnets.iter().flat_map(|s| &s.formals).any(|f| *f.name.name == *name);
            if let Some(meant) = elements::meant_entry(name)
                && !formal()
            {
                let message = format!("nothing reads `{name}` of the layer `{}`: ignored", layer.name.name);
                self.sink.warning("W004", entry.name.span, message, format!("did you mean `{meant}`?"));
            }
        }
    }

    fn subnet(&mut self, index: usize, program: &mut Program) {
        let mut subnet = program.subnets[index].clone();
        // Known inside its own body already: subnets may call themselves.
        self.subnets.insert(Arc::clone(&subnet.name.name), index);
        self.locals = Some(0);
        self.scopes.push(BTreeMap::new());
        for name in &mut subnet.nodes {
            self.name(name);
        }
        for formal in &mut subnet.formals {
            if let Some(value) = &mut formal.default {
                self.expression(value);
            }
            formal.slot = self.define(&formal.name.name);
        }
        self.scoped(|r| r.statements(&mut subnet.body, program));
        self.scopes.pop();
        subnet.variables = self.locals.take().unwrap_or(0);
        program.subnets[index] = subnet;
    }

    fn element(&mut self, element: &mut ElementStatement) {
        element.subnet = self.subnets.get(&element.model.name).copied();
        if element.subnet.is_none() && self.locals.is_none() {
            // Inside subnets this waits until an instance is built, since libraries hold subnets that are never
            // instantiated.
            self.model(&element.model);
        }
        element.layer = match (&*element.layer_name.name, self.locals.is_some()) {
            ("*", _) => LayerRef::None,
            ("parent", true) => LayerRef::Parent,
            (name, _) => match self.layers.get(name) {
                Some(&index) => LayerRef::Layer(index),
                None => {
                    self.unknown_layer(&element.layer_name);
                    LayerRef::None
                }
            },
        };
        if let Some(name) = &mut element.name {
            self.name(name);
        }
        for node in &mut element.nodes {
            self.name(node);
        }
        self.list(&mut element.parameters);
    }

    fn model(&mut self, model: &Ident) {
        if elements::model(&model.name).is_none() && self.first(&model.name) {
            let most = if self.sink.suggests() { usize::MAX } else { 0 };
            let known = self.subnets.keys().map(|k| &**k).take(most);
            elements::unknown(self.sink, &model.name, model.span, known);
        }
    }

    fn name(&mut self, name: &mut Name) {
        for index in &mut name.indices {
            self.expression(index);
        }
    }

    fn unknown_layer(&mut self, layer: &Ident) {
        if !self.first(&layer.name) {
            return;
        }
        let suggests = self.sink.suggests();
        let known = self.layers.keys().map(|k| &**k);
        let mut help = if suggests { did_you_mean(&layer.name, known, "") } else { String::new() };
        if help.is_empty() && suggests {
            help = match &*layer.name {
                "parent" => "`parent` is known inside subnets only".into(),
                _ if self.incomplete => "it may be defined in the file that cannot be found".into(),
                _ if self.layers.is_empty() => "define it with `process`, or include a process file with `uses`".into(),
                _ => format!("the layers are {}", listed(self.layers.keys())),
            };
        }
        self.sink.error("E031", layer.span, format!("unknown process layer `{}`", layer.name), help);
    }

    /// False when an include is missing and this name was reported before.
    fn first(&mut self, name: &Arc<str>) -> bool {
        !self.incomplete || self.unknown.insert(Arc::clone(name))
    }

    fn expression(&mut self, expr: &mut Expr) {
        match &mut expr.kind {
            ExprKind::Number(_) | ExprKind::Text(_) | ExprKind::Undefined => {}
            ExprKind::Variable(name, slot) => {
                self.layers_used += 1;
                match self.lookup(name) {
                    Some(found) => *slot = found,
                    None if self.first(name) && !self.sink.suggests() => {
                        self.sink.error("E030", expr.span, format!("undefined variable `{name}`"), "");
                    }
                    None if self.first(name) => {
                        let known: BTreeSet<&str> = self.scopes.iter().flat_map(|s| s.keys().map(|k| &**k)).collect();
                        let otherwise = "a variable must be defined above its first use";
                        let help = if self.beside.contains(name) {
                            format!("the parameters of one list do not see each other: define `{name}` above")
                        } else {
                            did_you_mean(name, known, otherwise)
                        };
                        self.sink.error("E030", expr.span, format!("undefined variable `{name}`"), help);
                    }
                    None => {}
                }
            }
            ExprKind::Negate(operand) | ExprKind::Not(operand) => self.expression(operand),
            ExprKind::Binary(_, left, right) => {
                self.expression(left);
                self.expression(right);
            }
            ExprKind::Call(name, arguments) => {
                for argument in arguments {
                    self.expression(argument);
                }
                if !functions::NAMES.contains(&&**name) {
                    let otherwise = format!("the functions are {}", functions::NAMES.join(" "));
                    let help = did_you_mean(name, functions::NAMES.iter().copied(), &otherwise);
                    self.sink.error("E032", expr.span, format!("unknown function `{name}`"), help);
                }
            }
        }
    }
}

fn listed<'a>(names: impl Iterator<Item = &'a Arc<str>>) -> String {
    names.take(MAX_LISTED).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}
