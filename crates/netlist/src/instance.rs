//! Elements and subnet instances: parameters evaluated, layers looked up, frames opened.

use super::ast::{ElementStatement, LayerDefinition, LayerRef};
use super::diagnostic_sink::Reported;
use super::drawing::{ELEMENT_BYTES, Fact, NAME_COPIES};
use super::elaborate::{Elaborator, EvaluationScope};
use super::elements::{self, Argument, Arguments, ElementInstance};
use super::rotation::Rotation;
use super::source::TextSpan;
use super::value::{LayerValues, Value};
use bimorph_base::budget;
use bimorph_structure::NodeId;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::sync::Arc;

/// Nodes of an instance that room is made for at first, at most.
const MAX_INITIAL_CAPACITY: usize = 32;
/// Subnet instances may nest this deep.
const DEEPEST_INSTANCE: usize = 100;

/// A subnet instance to be built.
#[derive(Clone, Copy)]
struct SubnetCall<'a, 'p> {
    element: &'p ElementStatement,
    /// Index of the subnet.
    subnet: usize,
    /// The instance's name where it is called.
    local: &'a str,
    nodes: &'a [NodeId],
    given: &'a [Argument<'p>],
    rotation: Rotation,
    layer: Option<usize>,
}

impl<'p> Elaborator<'p> {
    pub(super) fn element(&mut self, element: &'p ElementStatement) -> Result<(), Reported> {
        self.elements += 1;
        let local: Arc<str> = match &element.name {
            Some(name) => {
                let local = self.name(name)?;
                let prefix = Arc::clone(&self.here().prefix);
                budget::lay_out(ELEMENT_BYTES + NAME_COPIES * (prefix.len() + local.len()));
                if !self.names.insert((prefix, Arc::clone(&local))) {
                    let message = format!("there is an element `{}` already", self.full(&local));
                    self.sink.warning(
                        "W007",
                        name.span,
                        message,
                        "give each its own name, so that results can be distinguished",
                    );
                }
                local
            }
            None => {
                budget::lay_out(ELEMENT_BYTES + NAME_COPIES * self.here().prefix.len());
                self.anonymous(element.number, &element.unnamed)
            }
        };
        let (mut nodes, mut given) = self.spare.pop().unwrap_or_default();
        nodes.clear();
        given.clear();
        for name in &element.nodes {
            nodes.push(self.node(name)?);
        }
        let (mut angles, mut turned) = ([0.0; 3], [false; 3]);
        let mut failed = false;
        let degrees = self.in_degrees(element.model.span.file);
        for def in &element.parameters {
            let Ok(value) = self.evaluate(&def.value) else {
                failed = true;
                continue;
            };
            let axis = ["ox", "oy", "oz"].iter().position(|o| **o == *def.name.name);
            match (axis, &value) {
                (Some(_), Value::Number(angle)) if !angle.is_finite() => {
                    let message = format!("`{}` must be a finite number, this is {angle}", def.name.name);
                    self.sink.error("E050", def.value.span, message, "");
                    failed = true;
                }
                (Some(axis), _) if std::mem::replace(&mut turned[axis], true) => {}
                (Some(axis), Value::Number(angle)) => {
                    angles[axis] = if degrees { angle.to_radians() } else { *angle };
                    if !degrees {
                        self.check_angle(*angle, def.value.span);
                    }
                    // it turns a subnet's instance, and is a parameter besides where the subnet has one of that name
                    if let Some(subnet) = element.subnet {
                        let value = match (degrees, self.in_degrees(self.program.subnets[subnet].name.span.file)) {
                            (true, false) => Value::Number(angle.to_radians()),
                            (false, true) => Value::Number(angle.to_degrees()),
                            _ => value,
                        };
                        given.push(Argument { name: &def.name.name, value, span: def.name.span.to(def.value.span) });
                    }
                }
                (Some(_), other) => {
                    let message = format!("`{}` must be a number, this is {}", def.name.name, other.called());
                    self.sink.error("E050", def.value.span, message, "");
                    failed = true;
                }
                (None, _) => {
                    if let (None, Value::Number(angle), true) =
                        (element.subnet, &value, elements::turns(&def.name.name))
                    {
                        self.check_angle(*angle, def.value.span);
                    }
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
            Some(subnet) => {
                let call = SubnetCall { element, subnet, local: &local, nodes: &nodes, given: &given, rotation, layer };
                let result = self.subnet(&call);
                self.spare.push((nodes, given));
                result
            }
            None => {
                let values = layer.map_or_else(|| Ok(Arc::default()), |layer| self.layer(layer))?;
                let instance = ElementInstance {
                    name: self.full(&local),
                    anonymous: element.name.is_none(),
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
                let (drawing, sink, read) = (&mut self.drawing, &mut *self.sink, super::sugar2::read);
                let result = match element.built_in {
                    Some(known) => elements::build_as(known, &instance, drawing, sink, read),
                    None => elements::build(&instance, drawing, sink, read),
                };
                self.spare.push((instance.nodes, instance.arguments.given));
                result
            }
        }
    }

    /// The name of an anonymous line; where a loop comes to it again in one instance, `anonN(2)`, `anonN(3)` and so on.
    fn anonymous(&mut self, number: usize, first: &Arc<str>) -> Arc<str> {
        let at = self.frames.len() - 1;
        let run = &mut self.frames[at].anonymous;
        match run.get_mut(&number) {
            Some(count) => {
                *count += 1;
                Arc::from(format!("{first}({count})"))
            }
            None => {
                run.insert(number, 1);
                Arc::clone(first)
            }
        }
    }

    /// True when the file writes `ox oy oz` in degrees.
    fn in_degrees(&self, file: u16) -> bool {
        self.program.degrees.contains(&file)
    }

    fn check_angle(&mut self, angle: f64, span: TextSpan) {
        let divides = 360.0 % angle.abs() == 0.0;
        if angle.abs() > std::f64::consts::TAU && (divides || angle.fract() == 0.0) {
            self.drawing.note_number(Fact::Degrees, span, angle);
        }
    }

    /// Values of a layer's entries, evaluated now: a layer may name variables that change along the netlist.
    fn layer(&mut self, index: usize) -> Result<LayerValues<'p>, Reported> {
        if let Some(values) = &self.layers[index] {
            return Ok(Arc::clone(values));
        }
        let program = self.program;
        let mut values = Vec::new();
        let mut next: Option<&'p LayerDefinition> = Some(&program.layers[index]);
        while let Some(layer) = next {
            budget::check();
            budget::lay_out(layer.entries.len() * size_of::<(&str, Value)>());
            for entry in &layer.entries {
                values.push((&*entry.name.name, self.evaluate(&entry.value)?));
            }
            next = layer.parent.map(|parent| &program.layers[parent]);
        }
        let values: LayerValues<'p> = Arc::new(values.into());
        if program.layers[index].constant {
            self.layers[index] = Some(Arc::clone(&values));
        }
        Ok(values)
    }

    // ---- subnets ----

    fn subnet(&mut self, call: &SubnetCall<'_, 'p>) -> Result<(), Reported> {
        let SubnetCall { element, nodes, given, layer, .. } = *call;
        let subnet = &self.program.subnets[call.subnet];
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
            let message =
                format!("subnet instances nest more than {DEEPEST_INSTANCE} deep: `{model}` calls itself without end");
            let help = if elements::model(model).is_some() {
                format!("remove this subnet: the element `{model}` is built in")
            } else {
                "end the recursion with an `if`".to_owned()
            };
            return Err(self.sink.error("E052", element.model.span, message, help));
        }
        elements::stray_actuals(model, given, subnet.formals.iter().map(|f| &*f.name.name), self.sink);
        let layer_values = layer.map_or_else(|| Ok(Arc::default()), |layer| self.layer(layer))?;
        let mut prefix = self.full(call.local);
        prefix.push('.');
        let frame = EvaluationScope {
            values: vec![Value::Undefined; subnet.variables],
            nodes: FxHashMap::with_capacity_and_hasher(
                (nodes.len() + subnet.body.len()).min(MAX_INITIAL_CAPACITY),
                FxBuildHasher,
            ),
            prefix: Arc::from(prefix),
            rotation: call.rotation,
            layer,
            anonymous: FxHashMap::default(),
        };
        let instance = frame.prefix.trim_end_matches('.').to_owned();
        self.frames.push(frame);
        let result = self.bind(call, &layer_values);
        if result.is_ok() {
            self.sink.instances.push(instance);
            self.nested(&subnet.body);
            self.sink.instances.pop();
        }
        self.frames.pop();
        result
    }

    /// Gives the formal nodes and parameters of a new frame their values: actual, then default, then layer.
    fn bind(&mut self, call: &SubnetCall<'_, 'p>, layer: &LayerValues<'p>) -> Result<(), Reported> {
        let SubnetCall { element, nodes, given, .. } = *call;
        let subnet = &self.program.subnets[call.subnet];
        for (formal, id) in subnet.nodes.iter().zip(nodes) {
            let name = self.name(formal)?;
            let at = self.frames.len() - 1;
            self.frames[at].nodes.insert(name, *id);
        }
        for formal in &subnet.formals {
            budget::check();
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
