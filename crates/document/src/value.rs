//! Types of fields: how each is written, read, and described in the schema.

use crate::error::{DocumentError, UnwritableStructure, VALUE};
use crate::json::{JsonKind, JsonNode};
use crate::place::ValuePath;
use bimorph_base::suggest::did_you_mean;
use bimorph_structure::{CircuitKind, ElectrodeShape, Fringe, GapVoltage, Node, NodeId};
use std::collections::HashMap;
use std::fmt::Write;

/// Longest name of a node or an element (bytes).
const LONGEST_NAME: usize = 4096;

/// Range of the numbers of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum NumberRange {
    /// Any finite number; also of fields that are no numbers.
    Any,
    /// Above 0.
    Positive,
    /// 0 or above.
    NonNegative,
    /// Above the first and at most the second.
    Within(f64, f64),
}

impl NumberRange {
    fn holds(self, x: f64) -> bool {
        match self {
            Self::Any => true,
            Self::Positive => x > 0.0,
            Self::NonNegative => x >= 0.0,
            Self::Within(above, most) => x > above && x <= most,
        }
    }

    /// As in "expected a number above 0".
    fn words(self) -> String {
        match self {
            Self::Any => String::new(),
            Self::Positive => " above 0".to_owned(),
            Self::NonNegative => " of at least 0".to_owned(),
            Self::Within(above, most) => format!(" above {above} and at most {most}"),
        }
    }

    /// Keywords of JSON Schema.
    fn keywords(self) -> String {
        match self {
            Self::Any => String::new(),
            Self::Positive => ", \"exclusiveMinimum\": 0".to_owned(),
            Self::NonNegative => ", \"minimum\": 0".to_owned(),
            Self::Within(above, most) => format!(", \"exclusiveMinimum\": {above}, \"maximum\": {most}"),
        }
    }
}

/// A row of the tables of fields.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DocumentField {
    pub(crate) name: &'static str,
    /// Unit of its numbers; empty: it has none.
    pub(crate) unit: &'static str,
    pub(crate) range: NumberRange,
    /// Its meaning, for messages and the schema.
    pub(crate) about: &'static str,
}

/// Nodes by name.
pub(crate) type NodeNames<'d> = HashMap<&'d str, NodeId>;

/// The text being written.
#[derive(Debug)]
pub(crate) struct DocumentWriter<'s> {
    pub(crate) text: String,
    /// Nodes of the structure.
    pub(crate) nodes: &'s [Node],
    /// Name of the element being written, for errors.
    pub(crate) element: String,
}

impl DocumentWriter<'_> {
    /// A separator between items, but before the first.
    pub(crate) fn comma(&mut self) {
        if !self.text.ends_with(['{', '[']) {
            self.text.push_str(", ");
        }
    }

    /// A text in quotes.
    pub(crate) fn quote(&mut self, text: &str) {
        self.text.push('"');
        for character in text.chars() {
            match character {
                '"' => self.text.push_str("\\\""),
                '\\' => self.text.push_str("\\\\"),
                '\n' => self.text.push_str("\\n"),
                '\t' => self.text.push_str("\\t"),
                '\r' => self.text.push_str("\\r"),
                '\0'..'\x20' => {
                    let _ = write!(self.text, "\\u{:04x}", u32::from(character));
                }
                _ => self.text.push(character),
            }
        }
        self.text.push('"');
    }

    /// A finite number with all its bits, in the shortest digits.
    pub(crate) fn number(&mut self, x: f64) {
        let _ = match x.abs() {
            0.0 => write!(self.text, "{}0", if x.is_sign_negative() { "-" } else { "" }),
            1e-3..1e6 => write!(self.text, "{x}"),
            _ => write!(self.text, "{x:e}"),
        };
    }
}

/// A type of fields.
pub(crate) trait DocumentValue: Sized {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure>;

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError>;

    /// Its JSON Schema.
    fn schema(field: &DocumentField) -> String;

    /// The value of a field that is left out; none: it must be there.
    fn left_out() -> Option<Self> {
        None
    }

    /// True where the writer leaves it out.
    fn is_left_out(&self) -> bool {
        false
    }
}

/// The fault of a value of another type.
fn expected(wanted: &str, node: &JsonNode<'_>, at: &ValuePath<'_>, help: impl Into<String>) -> DocumentError {
    at.fault(VALUE, node, format!("expected {wanted}, got {}", node.called()), help)
}

impl DocumentValue for f64 {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure> {
        if !self.is_finite() {
            return Err(UnwritableStructure::NotFinite { element: to.element.clone(), field: field.name });
        }
        to.number(*self);
        Ok(())
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        _: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        let unit = if field.unit.is_empty() { String::new() } else { format!(" in {}", field.unit) };
        let wanted = format!("a number{}{unit}", field.range.words());
        match node.kind {
            JsonKind::Number(x) if field.range.holds(x) => Ok(x),
            JsonKind::Text(_) => {
                let help = "numbers are in SI units and have no suffix: two micrometres are 2e-6";
                Err(expected(&wanted, node, at, help))
            }
            _ => Err(expected(&wanted, node, at, "")),
        }
    }

    fn schema(field: &DocumentField) -> String {
        format!("{{\"type\": \"number\"{}}}", field.range.keywords())
    }
}

impl DocumentValue for usize {
    fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
        let _ = write!(to.text, "{self}");
        Ok(())
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        _: &DocumentField,
        _: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        /// Beyond this the whole numbers of a double have gaps.
        const MOST: f64 = 9_007_199_254_740_992.0;
        match node.kind {
            JsonKind::Number(x) if x.fract() == 0.0 && (0.0..MOST).contains(&x) => Ok(x as usize),
            _ => Err(expected("a whole number of at least 0", node, at, "")),
        }
    }

    fn schema(_: &DocumentField) -> String {
        "{\"type\": \"integer\", \"minimum\": 0}".to_owned()
    }
}

impl DocumentValue for bool {
    fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
        to.text.push_str(if *self { "true" } else { "false" });
        Ok(())
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        _: &DocumentField,
        _: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        match node.kind {
            JsonKind::Bool(value) => Ok(value),
            _ => Err(expected("true or false", node, at, "")),
        }
    }

    fn schema(_: &DocumentField) -> String {
        "{\"type\": \"boolean\"}".to_owned()
    }
}

/// Names.
impl DocumentValue for String {
    fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
        to.quote(self);
        Ok(())
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        _: &DocumentField,
        _: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        let good = |text: &str| {
            (1..=LONGEST_NAME).contains(&text.len()) && !text.chars().any(|c| c.is_whitespace() || c.is_control())
        };
        match &node.kind {
            JsonKind::Text(text) if good(text) => Ok(text.clone().into_owned()),
            _ => Err(expected("a name of 1 to 4096 bytes without blanks", node, at, "")),
        }
    }

    fn schema(_: &DocumentField) -> String {
        format!("{{\"type\": \"string\", \"minLength\": 1, \"maxLength\": {LONGEST_NAME}, \"pattern\": \"^\\\\S+$\"}}")
    }
}

impl DocumentValue for NodeId {
    fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
        let nodes = to.nodes;
        to.quote(&nodes[self.0].name);
        Ok(())
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        _: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        let JsonKind::Text(name) = &node.kind else {
            return Err(expected("the name of a node", node, at, "nodes are listed in `nodes`"));
        };
        nodes.get(&**name).copied().ok_or_else(|| {
            let help = did_you_mean(name, nodes.keys().copied(), "nodes are listed in `nodes`");
            at.fault(VALUE, node, format!("no node has the name \"{name}\""), help)
        })
    }

    fn schema(_: &DocumentField) -> String {
        "{\"$ref\": \"#/$defs/NodeName\"}".to_owned()
    }
}

impl<T: DocumentValue> DocumentValue for Option<T> {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure> {
        match self {
            Some(value) => value.write(to, field),
            None => {
                to.text.push_str("null");
                Ok(())
            }
        }
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        if node.kind == JsonKind::Null { Ok(None) } else { T::read(node, at, field, nodes).map(Some) }
    }

    fn schema(field: &DocumentField) -> String {
        format!("{{\"anyOf\": [{}, {{\"type\": \"null\"}}]}}", T::schema(field))
    }

    fn left_out() -> Option<Self> {
        Some(None)
    }

    fn is_left_out(&self) -> bool {
        self.is_none()
    }
}

fn write_list<T: DocumentValue>(
    items: &[T],
    to: &mut DocumentWriter<'_>,
    field: &DocumentField,
) -> Result<(), UnwritableStructure> {
    to.text.push('[');
    for item in items {
        to.comma();
        item.write(to, field)?;
    }
    to.text.push(']');
    Ok(())
}

fn read_list<T: DocumentValue>(
    node: &JsonNode<'_>,
    at: &ValuePath<'_>,
    field: &DocumentField,
    nodes: &NodeNames<'_>,
) -> Result<Vec<T>, DocumentError> {
    let JsonKind::List(items) = &node.kind else { return Err(expected("a list", node, at, "")) };
    items.iter().enumerate().map(|(k, item)| T::read(item, &ValuePath::Item(at, k), field, nodes)).collect()
}

impl<T: DocumentValue> DocumentValue for Vec<T> {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure> {
        write_list(self, to, field)
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        read_list(node, at, field, nodes)
    }

    fn schema(field: &DocumentField) -> String {
        format!("{{\"type\": \"array\", \"items\": {}}}", T::schema(field))
    }
}

impl<T: DocumentValue, const N: usize> DocumentValue for [T; N] {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure> {
        write_list(self, to, field)
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        let items = read_list(node, at, field, nodes)?;
        items.try_into().map_err(|_| expected(&format!("a list of {N}"), node, at, ""))
    }

    fn schema(field: &DocumentField) -> String {
        let items = T::schema(field);
        format!("{{\"type\": \"array\", \"items\": {items}, \"minItems\": {N}, \"maxItems\": {N}}}")
    }
}

/// A number (V), or the two nodes between which it lies.
impl DocumentValue for GapVoltage {
    fn write(&self, to: &mut DocumentWriter<'_>, field: &DocumentField) -> Result<(), UnwritableStructure> {
        match self {
            Self::Fixed(volts) => volts.write(to, field),
            Self::Nodes(a, b) => [*a, *b].write(to, field),
        }
    }

    fn read(
        node: &JsonNode<'_>,
        at: &ValuePath<'_>,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<Self, DocumentError> {
        match node.kind {
            JsonKind::Number(volts) => Ok(Self::Fixed(volts)),
            JsonKind::List(_) => <[NodeId; 2]>::read(node, at, field, nodes).map(|[a, b]| Self::Nodes(a, b)),
            _ => Err(expected("a number in V, or the names of two nodes", node, at, "")),
        }
    }

    fn schema(field: &DocumentField) -> String {
        format!("{{\"anyOf\": [{}, {}]}}", f64::schema(field), <[NodeId; 2]>::schema(field))
    }
}

/// Kinds of circuit elements by their words.
const CIRCUIT_KINDS: [(&str, CircuitKind); 7] = [
    ("resistor", CircuitKind::Resistor),
    ("capacitor", CircuitKind::Capacitor),
    ("inductor", CircuitKind::Inductor),
    ("voltage_source", CircuitKind::VoltageSource),
    ("current_source", CircuitKind::CurrentSource),
    ("op_amp", CircuitKind::OpAmp),
    ("amplifier", CircuitKind::Amplifier),
];

/// A type whose values are words of a list.
macro_rules! words {
    ($type:ty, $words:expr) => {
        impl DocumentValue for $type {
            fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
                let word = $words.iter().find(|(_, value)| value == self).map_or("", |(word, _)| word);
                to.quote(word);
                Ok(())
            }

            fn read(
                node: &JsonNode<'_>,
                at: &ValuePath<'_>,
                _: &DocumentField,
                _: &NodeNames<'_>,
            ) -> Result<Self, DocumentError> {
                let word = if let JsonKind::Text(text) = &node.kind { &**text } else { "" };
                let found = $words.iter().find(|(other, _)| *other == word).map(|(_, value)| *value);
                let words = $words.map(|(word, _)| format!("\"{word}\"")).join(", ");
                found.ok_or_else(|| expected(&format!("one of {words}"), node, at, ""))
            }

            fn schema(_: &DocumentField) -> String {
                format!("{{\"enum\": [{}]}}", $words.map(|(word, _)| format!("\"{word}\"")).join(", "))
            }
        }
    };
}

words!(Fringe, Fringe::NAMES);
words!(ElectrodeShape, ElectrodeShape::NAMES);
words!(CircuitKind, CIRCUIT_KINDS);
