//! The parameters of an element: given in its list, or taken from its layer.

use super::super::diagnostic_sink::{DiagnosticSink, Reported};
use super::super::drawing::StructureBuilder;
use super::super::rotation::Rotation;
use super::super::source::TextSpan;
use super::super::value::{LayerValues, Value, short};
use super::meaning::meaning;
use bimorph_structure::{NodeId, PropertyCurve, ReadFunction};
use std::sync::Arc;

/// A length beyond this is a missing suffix rather than a part of a microsystem (m).
pub(crate) const LONGEST: f64 = 0.1;

/// Parameters that can depend on temperature.
pub(crate) const CURVES: [&str; 9] = [
    "C11",
    "C12",
    "C44",
    "gasconductivity",
    "resistivity",
    "sheetresistance",
    "specificheat",
    "thermalexpansion",
    "thermcond",
];

/// One parameter as given.
#[derive(Debug, Clone)]
pub(crate) struct Argument<'p> {
    pub(crate) name: &'p str,
    pub(crate) value: Value,
    pub(crate) span: TextSpan,
}

/// Given parameters before the layer's entries.
#[derive(Debug, Clone)]
pub(crate) struct Arguments<'p> {
    pub(crate) given: Vec<Argument<'p>>,
    pub(crate) layer: LayerValues<'p>,
    pub(crate) layer_name: Option<&'p str>,
}

/// An element to be built.
#[derive(Debug)]
pub(crate) struct ElementInstance<'p> {
    /// Full name.
    pub(crate) name: String,
    /// True when the netlist gives it no name.
    pub(crate) anonymous: bool,
    pub(crate) model: &'p str,
    /// Place of the model's word.
    pub(crate) span: TextSpan,
    pub(crate) nodes: Vec<NodeId>,
    pub(crate) nodes_span: TextSpan,
    /// Orientation, local to global.
    pub(crate) rotation: Rotation,
    pub(crate) arguments: Arguments<'p>,
}

/// An element being built: what it is, and where it goes.
pub(crate) struct ElementSite<'a, 'p> {
    pub(crate) instance: &'a ElementInstance<'p>,
    pub(crate) drawing: &'a mut StructureBuilder,
    pub(crate) sink: &'a mut DiagnosticSink,
    /// Reads an expression in a string, as SUGAR 2.
    pub(crate) read: ReadFunction,
}

impl ElementSite<'_, '_> {
    /// The element's full name.
    pub(crate) fn name(&self) -> String {
        self.instance.name.clone()
    }

    /// Its node of that index.
    pub(crate) fn node(&self, index: usize) -> NodeId {
        self.instance.nodes[index]
    }

    /// Reports an error at the element.
    pub(crate) fn error(&mut self, code: &'static str, message: String, help: impl Into<String>) -> Reported {
        self.sink.error(code, self.instance.span, message, help)
    }

    fn find(&self, name: &str) -> Option<(&Value, TextSpan)> {
        let arguments = &self.instance.arguments;
        // most names that are as long begin otherwise
        let first = name.as_bytes().first();
        let is = |other: &str| other.len() == name.len() && other.as_bytes().first() == first && other == name;
        let given = arguments.given.iter().find(|a| is(a.name) && a.value != Value::Undefined);
        let layer = || arguments.layer.iter().find(|(n, v)| is(n) && *v != Value::Undefined);
        given.map(|a| (&a.value, a.span)).or_else(|| layer().map(|(_, v)| (v, self.instance.span)))
    }

    /// True when the parameter is given in the element's own list.
    pub(crate) fn is_given(&self, name: &str) -> bool {
        self.instance.arguments.given.iter().any(|a| a.name == name && a.value != Value::Undefined)
    }

    /// The place of a parameter: where it is given, else the element.
    pub(crate) fn span_of(&self, name: &str) -> TextSpan {
        self.find(name).map_or(self.instance.span, |(_, span)| span)
    }

    /// A number, if it is given or the layer has it.
    pub(crate) fn number(&mut self, name: &str) -> Result<Option<f64>, Reported> {
        match self.find(name) {
            None => Ok(None),
            Some((Value::Number(x), _)) if x.is_finite() => Ok(Some(*x)),
            Some((Value::Curve(curve), span)) if CURVES.contains(&name) => {
                let curve = Arc::clone(curve);
                self.at_ambient(name, &curve, span).map(Some)
            }
            Some((value, span)) => {
                let what = if let Value::Number(x) = value { short(*x) } else { value.called().to_owned() };
                let help = match value {
                    Value::Curve(_) => format!("what can depend on temperature: {}", CURVES.join(" ")),
                    _ => String::new(),
                };
                let message = format!("`{name}` ({}) must be a finite number, this is {what}", meaning(name));
                Err(self.sink.error("E050", span, message, help))
            }
        }
    }

    /// A property against temperature, if it is given so. That of the expansion may have any sign, others are positive.
    pub(super) fn curve(&mut self, name: &str) -> Result<Option<PropertyCurve>, Reported> {
        let Some((Value::Curve(curve), span)) = self.find(name) else { return Ok(None) };
        let curve = Arc::clone(curve);
        let ambient = self.at_ambient(name, &curve, span)?;
        if ambient <= 0.0 && name != "thermalexpansion" {
            return Err(self.out_of_range(name, ambient, "positive at ambient temperature"));
        }
        let lowest = curve.table.iter().find(|point| point[1] <= 0.0);
        if let Some([temperature, value]) = lowest.filter(|_| name != "thermalexpansion") {
            let message = format!(
                "{} must be positive, the table has {} at {} K",
                self.of_layer(name),
                short(*value),
                short(*temperature)
            );
            return Err(self.sink.error("E060", span, message, ""));
        }
        Ok(Some(PropertyCurve::clone(&curve)))
    }

    /// A curve's value at ambient temperature.
    fn at_ambient(&mut self, name: &str, curve: &PropertyCurve, span: TextSpan) -> Result<f64, Reported> {
        if let Some(fault) = curve.fault() {
            let message = format!("{}: {fault}", self.of_layer(name));
            return Err(self.sink.error("E060", span, message, "give pairs of a temperature [K] and a value"));
        }
        let ambient = self.number_or("ambienttemperature", 0.0)?;
        self.covered(name, curve, ambient, "ambient temperature", span)?;
        Ok(curve.at(ambient)[0])
    }

    /// Refuses a table that does not reach a temperature (K).
    pub(super) fn covered(
        &mut self,
        name: &str,
        curve: &PropertyCurve,
        temperature: f64,
        which: &str,
        span: TextSpan,
    ) -> Result<(), Reported> {
        let Some([low, high]) = curve.range().filter(|_| !curve.covers(temperature)) else { return Ok(()) };
        let message = format!(
            "the table of {} goes from {} to {} K and does not cover the {which} of {} K",
            self.of_layer(name),
            short(low),
            short(high),
            short(temperature)
        );
        let help = match temperature {
            0.0 => "give `ambienttemperature=`: without it, temperatures are rises from 0 K",
            _ => "add points to the table",
        };
        Err(self.sink.error("E060", span, message, help))
    }

    /// A parameter with its meaning and the layer of the element.
    fn of_layer(&self, name: &str) -> String {
        let layer = self.instance.arguments.layer_name.filter(|_| !self.is_given(name));
        let layer = layer.map_or_else(String::new, |layer| format!(" of the layer `{layer}`"));
        format!("`{name}` ({}){layer}", meaning(name))
    }

    /// A number with a value for when it is absent.
    pub(crate) fn number_or(&mut self, name: &str, otherwise: f64) -> Result<f64, Reported> {
        Ok(self.number(name)?.unwrap_or(otherwise))
    }

    /// A number that must be there.
    pub(crate) fn required(&mut self, name: &str) -> Result<f64, Reported> {
        match self.number(name)? {
            Some(x) => Ok(x),
            None => Err(self.missing(name)),
        }
    }

    /// One of the words that a parameter can be, if it is given or the layer has it.
    pub(crate) fn word<T: Copy>(&mut self, name: &str, words: &[(&str, T)]) -> Result<Option<T>, Reported> {
        let Some((value, span)) = self.find(name) else { return Ok(None) };
        let found = match value {
            Value::Text(text) => words.iter().find(|(word, _)| **word == **text),
            _ => None,
        };
        if let Some((_, meant)) = found {
            return Ok(Some(*meant));
        }
        let this = match value {
            Value::Text(text) => format!("`{text}`"),
            other => other.called().to_owned(),
        };
        let message = format!("`{name}` ({}) is {this}", meaning(name));
        let listed: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        Err(self.sink.error("E050", span, message, format!("give one of {}", listed.join(", "))))
    }

    /// The error for a parameter that is not there.
    pub(crate) fn missing(&mut self, name: &str) -> Reported {
        let message = format!("`{}` needs `{name}` ({})", self.instance.model, meaning(name));
        let help = match self.instance.arguments.layer_name {
            Some(layer) => format!("give `{name}=` here or in the layer `{layer}`"),
            None => format!("give `{name}=`"),
        };
        self.error("E053", message, help)
    }

    /// A positive number, if there is one.
    pub(crate) fn positive_if_any(&mut self, name: &str) -> Result<Option<f64>, Reported> {
        let Some(x) = self.number(name)? else { return Ok(None) };
        if x <= 0.0 {
            return Err(self.out_of_range(name, x, "positive"));
        }
        self.check_size(name, x);
        Ok(Some(x))
    }

    /// A positive number that must be there.
    pub(crate) fn positive(&mut self, name: &str) -> Result<f64, Reported> {
        match self.positive_if_any(name)? {
            Some(x) => Ok(x),
            None => Err(self.missing(name)),
        }
    }

    /// A number that is not negative, with a value for when it is absent.
    pub(crate) fn non_negative_or(&mut self, name: &str, otherwise: f64) -> Result<f64, Reported> {
        let x = self.number_or(name, otherwise)?;
        if x < 0.0 {
            return Err(self.out_of_range(name, x, "zero or positive"));
        }
        self.check_size(name, x);
        Ok(x)
    }

    /// The error for a number that cannot be.
    pub(super) fn out_of_range(&mut self, name: &str, x: f64, wanted: &str) -> Reported {
        let span = self.span_of(name);
        let message = format!("`{name}` ({}) must be {wanted}, this is {}", meaning(name), short(x));
        let help = if name == "l" && x < 0.0 {
            "a part that runs the other way has its length, and `oz` half a turn on"
        } else {
            ""
        };
        self.sink.error("E060", span, message, help)
    }

    /// Warns of lengths that can only be a missing suffix.
    fn check_size(&mut self, name: &str, x: f64) {
        if x > LONGEST && meaning(name).ends_with("[m]") {
            let span = self.span_of(name);
            let message = format!("`{name}` is {} m long", short(x));
            let help = if x < 1e5 {
                format!("lengths are in metres: micrometres are written `{}u`", short(x))
            } else {
                "lengths are in metres: check the suffix".to_owned()
            };
            self.sink.warning("W005", span, message, help);
        }
    }

    /// Warns of an element between two ends whose ends are one node.
    pub(super) fn warn_of_coincident_ends(&mut self) {
        if self.node(0) == self.node(1) {
            let node = &self.drawing.structure.nodes[self.node(0).0].name;
            let message = format!("`{}` does nothing: both its ends are the node `{node}`", self.instance.name);
            self.sink.warning("W006", self.instance.span, message, "give it two nodes");
        }
    }

    /// The direction of the local x axis (rad).
    ///
    /// # Errors
    /// It leaves the drawing plane.
    pub(crate) fn direction(&mut self, rotation: Rotation) -> Result<f64, Reported> {
        if rotation.x_in_plane() {
            return Ok(rotation.angle());
        }
        let message = format!("`{}` leaves the drawing plane", self.instance.name);
        Err(self.error("E061", message, "models are planar (x, y, rotation about z): turn it with `oz` only"))
    }

    /// +1 when the local y axis lies to the left of x, −1 when it is mirrored.
    ///
    /// # Errors
    /// It leaves the drawing plane.
    pub(crate) fn side(&mut self) -> Result<f64, Reported> {
        match self.instance.rotation.side() {
            Some(side) if side != 0 => Ok(f64::from(side)),
            _ => {
                let message = format!("the gap of `{}` does not lie in the drawing plane", self.instance.name);
                Err(self.error("E061", message, "models are planar (x, y, rotation about z): turn it with `oz` only"))
            }
        }
    }

    /// A local in-plane vector in global coordinates (m).
    pub(crate) fn global(&self, v: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.instance.rotation.apply([v[0], v[1], 0.0]);
        [x, y]
    }
}
