//! The whole document: its head, and one list for each kind of part. `mechanical` and `electrical` have the tables of fields.

mod electrical;
mod mechanical;

use crate::error::{DocumentError, FIELDS, OTHER_FORMAT, RELATION, UnwritableStructure, VALUE};
use crate::format::{FORMAT, UNITS, VERSION};
use crate::json::{JsonKind, JsonNode};
use crate::place::ValuePath;
use crate::record::{DocumentRecord, ObjectSchema};
use crate::value::{DocumentField, DocumentValue, DocumentWriter, NodeNames, NumberRange};
use bimorph_base::suggest::did_you_mean;
use bimorph_base::{Setting, budget};
use bimorph_structure::{
    Adhesion, AnchorMotion, Beam, BeamGap, CircuitElement, Comb, FacingGas, FilmSlit, Friction, GasLoss, Heater,
    Impact, InsulatingLayer, Link, Load, Mass, Material, Node, NodeId, NodeIndex, OhmicContact, Pad, Perforation,
    PlacedElement, PlateGap, Port, PropertyCurve, Resistor, SolidHeat, SpringDamper, Stop, Structure, Support,
    VoltageSource, Wire, Yield,
};
use std::collections::HashMap;

/// A structure with its source and parameters.
type Origin = (String, Vec<(String, Setting)>, Structure);

/// Fields of the head.
const HEAD: [&str; 6] = ["format", "version", "units", "source", "parameters", AMBIENT.name];

/// Temperature of the surroundings.
const AMBIENT: DocumentField = DocumentField {
    name: "ambient_temperature",
    unit: "K",
    range: NumberRange::Positive,
    about: "Temperature of the surroundings of lumped parts; left out: that of beams, or 300.15",
};

/// A list itself has no unit; its items have their own.
const LIST: DocumentField = DocumentField { name: "", unit: "", range: NumberRange::Any, about: "" };

/// Name of an item, for errors.
trait NamedPart {
    fn part_name(&self) -> &str {
        ""
    }
}

macro_rules! named {
    ($($type:ident)+) => { $(impl NamedPart for $type {
        fn part_name(&self) -> &str {
            &self.name
        }
    })+ };
}

named!(Node Beam Mass Link Support SpringDamper Load Comb PlateGap BeamGap Stop PlacedElement Resistor Wire);
named!(VoltageSource CircuitElement Port);
impl NamedPart for Pad {}
impl NamedPart for Yield {}
impl NamedPart for NodeId {}

/// The lists after that of the nodes, in the order in which they are written.
macro_rules! sections {
    ($($name:ident: $type:ident, $about:literal;)+) => {
        /// Names of the lists.
        const SECTIONS: &[&str] = &["nodes", $(stringify!($name)),+];

        fn write_sections(structure: &Structure, to: &mut DocumentWriter<'_>) -> Result<(), UnwritableStructure> {
            let Structure { nodes, $($name,)+ ambient_temperature: _, index: _ } = structure;
            section("nodes", nodes, to)?;
            $(section(stringify!($name), $name, to)?;)+
            Ok(())
        }

        fn read_sections(root: &JsonNode<'_>) -> Result<Structure, DocumentError> {
            let Some(list) = root.get("nodes") else {
                return Err(ValuePath::Root.fault(FIELDS, root, "the field \"nodes\" is missing: all nodes", ""));
            };
            let at = ValuePath::Field(&ValuePath::Root, "nodes");
            let nodes: Vec<Node> = DocumentValue::read(list, &at, &LIST, &HashMap::new())?;
            let mut names: NodeNames<'_> = HashMap::with_capacity(nodes.len());
            for (k, node) in nodes.iter().enumerate() {
                if names.insert(&node.name, NodeId(k)).is_some() {
                    let message = format!("two nodes have the name \"{}\"", node.name);
                    let item = list.item(k).unwrap_or(list);
                    return Err(ValuePath::Item(&at, k).fault(RELATION, item, message, "give each its own"));
                }
            }
            $(let $name: Vec<$type> = read_section(root, stringify!($name), &names)?;)+
            drop(names);
            let ambient_temperature = read_ambient(root)?;
            Ok(Structure { nodes, $($name,)+ ambient_temperature, index: NodeIndex::default() })
        }

        /// Each list with its description and the schema of its items.
        pub(crate) fn section_schemas() -> Vec<(&'static str, &'static str, String)> {
            let nodes = ("nodes", "All nodes, in the order of every list of results.", Node::schema(&LIST));
            vec![nodes, $((stringify!($name), $about, $type::schema(&LIST))),+]
        }
    };
}

sections! {
    beams: Beam, "Flexible beams.";
    masses: Mass, "Plates and lumped masses.";
    links: Link, "Rigid links.";
    supports: Support, "Anchors, guides and other supports.";
    pads: Pad, "Pads of anchors whose sizes are given.";
    springs: SpringDamper, "Lumped springs and dampers.";
    loads: Load, "Dead loads.";
    combs: Comb, "Comb drives.";
    plate_gaps: PlateGap, "Lumped parallel plates.";
    beam_gaps: BeamGap, "Facing beams.";
    stops: Stop, "Stops.";
    placed: PlacedElement, "Elements that belong to one domain alone.";
    resistors: Resistor, "Resistors.";
    wires: Wire, "Conductors without resistance.";
    voltage_sources: VoltageSource, "Voltage sources.";
    electrical_grounds: NodeId, "Nodes at electrical ground.";
    circuit: CircuitElement, "The circuit around the mechanism; its resistors and voltage sources are also in the lists above.";
    yields: Yield, "Heated beams that can yield.";
    ports: Port, "Electrical ports, in the order of every list of port values.";
}

/// The objects of the schema.
pub(crate) fn object_schemas() -> Vec<ObjectSchema> {
    macro_rules! of {
        ($($type:ident)+) => { vec![$($type::object_schema()),+] };
    }
    of!(Node Material SolidHeat PropertyCurve Beam Heater GasLoss Mass Link Support AnchorMotion Pad SpringDamper Load Yield
        Impact InsulatingLayer FacingGas Perforation FilmSlit Comb PlateGap BeamGap OhmicContact Adhesion Friction Stop PlacedElement
        Resistor Wire VoltageSource CircuitElement Port)
}

fn section<T: DocumentValue + NamedPart>(
    name: &'static str,
    items: &[T],
    to: &mut DocumentWriter<'_>,
) -> Result<(), UnwritableStructure> {
    if items.is_empty() && name != "nodes" {
        return Ok(());
    }
    to.text.push_str(",\n  \"");
    to.text.push_str(name);
    to.text.push_str("\": [");
    for (k, item) in items.iter().enumerate() {
        budget::check();
        to.text.push_str(if k > 0 { ",\n    " } else { "\n    " });
        to.element.clear();
        to.element.push_str(item.part_name());
        item.write(to, &LIST)?;
    }
    to.text.push_str(if items.is_empty() { "]" } else { "\n  ]" });
    Ok(())
}

fn read_section<T: DocumentValue>(
    root: &JsonNode<'_>,
    name: &'static str,
    nodes: &NodeNames<'_>,
) -> Result<Vec<T>, DocumentError> {
    let at = ValuePath::Field(&ValuePath::Root, name);
    root.get(name).map_or(Ok(Vec::new()), |list| DocumentValue::read(list, &at, &LIST, nodes))
}

/// The text of a structure with its origin.
pub(crate) fn write(
    source: &str,
    parameters: &[(String, Setting)],
    structure: &Structure,
) -> Result<String, UnwritableStructure> {
    let nodes = &structure.nodes;
    let mut names = HashMap::with_capacity(nodes.len());
    if let Some(twice) = nodes.iter().find(|node| names.insert(node.name.as_str(), ()).is_some()) {
        return Err(UnwritableStructure::SameName(twice.name.clone()));
    }
    let mut to = DocumentWriter { text: String::new(), nodes, element: String::new() };
    to.text += &format!("{{\n  \"format\": \"{FORMAT}\",\n  \"version\": {VERSION},\n  \"units\": \"{UNITS}\"");
    if !source.is_empty() {
        to.text.push_str(",\n  \"source\": ");
        to.quote(source);
    }
    if !parameters.is_empty() {
        to.text.push_str(",\n  \"parameters\": {");
        for (name, value) in parameters {
            to.comma();
            to.quote(name);
            to.text.push_str(": ");
            match value {
                Setting::Text(text) => to.quote(text),
                Setting::Number(x) => {
                    name.clone_into(&mut to.element);
                    x.write(&mut to, &DocumentField { name: "parameters", ..LIST })?;
                }
            }
        }
        to.text.push('}');
    }
    if let Some(temperature) = structure.ambient_temperature {
        to.text += &format!(",\n  \"{}\": ", AMBIENT.name);
        to.element.clear();
        temperature.write(&mut to, &AMBIENT)?;
    }
    write_sections(structure, &mut to)?;
    to.text.push_str("\n}\n");
    Ok(to.text)
}

/// Source, parameters and structure of a text.
pub(crate) fn read(root: &JsonNode<'_>) -> Result<Origin, DocumentError> {
    let at = ValuePath::Root;
    let JsonKind::Object(fields) = &root.kind else {
        return Err(at.fault(VALUE, root, format!("expected an object, got {}", root.called()), ""));
    };
    check_head(root)?;
    let known = || HEAD.iter().chain(SECTIONS).copied();
    if let Some((name, value)) = fields.iter().find(|(name, _)| !known().any(|other| other == *name)) {
        let help = did_you_mean(name, known(), &format!("it has {}", known().collect::<Vec<_>>().join(", ")));
        return Err(ValuePath::Field(&at, name).fault(FIELDS, value, "unknown field", help));
    }
    let source = match root.get("source").map(|node| (node, &node.kind)) {
        None => String::new(),
        Some((_, JsonKind::Text(text))) => text.clone().into_owned(),
        Some((node, _)) => {
            let message = format!("expected the name of a file, got {}", node.called());
            return Err(ValuePath::Field(&at, "source").fault(VALUE, node, message, ""));
        }
    };
    Ok((source, read_parameters(root)?, read_sections(root)?))
}

/// Format, version and units, before anything that depends on them.
fn check_head(root: &JsonNode<'_>) -> Result<(), DocumentError> {
    let at = ValuePath::Root;
    let head = |name: &'static str, good: &dyn Fn(&JsonKind<'_>) -> bool, wanted: &str, help: &str| {
        let Some(node) = root.get(name) else {
            let message = format!("the field \"{name}\" is missing: expected {wanted}");
            return Err(at.fault(OTHER_FORMAT, root, message, help));
        };
        if good(&node.kind) {
            return Ok(());
        }
        let message = format!("expected {wanted}, got {}", node.called());
        Err(ValuePath::Field(&at, name).fault(OTHER_FORMAT, node, message, help))
    };
    let is_text = |kind: &JsonKind<'_>, wanted: &str| matches!(kind, JsonKind::Text(text) if text == wanted);
    let converted = "`bimorph convert FILE --out model.json` writes one from a netlist or a layout";
    head("format", &|kind| is_text(kind, FORMAT), &format!("\"{FORMAT}\""), converted)?;
    let readable = |kind: &JsonKind<'_>| matches!(kind, JsonKind::Number(x) if x.fract() == 0.0 && (1.0..=f64::from(VERSION)).contains(x));
    let newer = "a newer program wrote it: update this one, or convert the source with this one";
    head("version", &readable, &format!("a version from 1 to {VERSION}"), newer)?;
    let metres = "numbers are in m, kg, s, A, K and units derived from them; convert them first";
    head("units", &|kind| is_text(kind, UNITS), &format!("\"{UNITS}\""), metres)
}

fn read_ambient(root: &JsonNode<'_>) -> Result<Option<f64>, DocumentError> {
    let at = ValuePath::Field(&ValuePath::Root, AMBIENT.name);
    root.get(AMBIENT.name).map(|node| f64::read(node, &at, &AMBIENT, &HashMap::new())).transpose()
}

/// The schema of the temperature of the surroundings, with its name and description.
pub(crate) fn ambient_schema() -> (&'static str, String, String) {
    (AMBIENT.name, format!("{} ({})", AMBIENT.about, AMBIENT.unit), f64::schema(&AMBIENT))
}

fn read_parameters(root: &JsonNode<'_>) -> Result<Vec<(String, Setting)>, DocumentError> {
    let Some(node) = root.get("parameters") else { return Ok(Vec::new()) };
    let at = ValuePath::Field(&ValuePath::Root, "parameters");
    let JsonKind::Object(fields) = &node.kind else {
        return Err(at.fault(VALUE, node, format!("expected an object, got {}", node.called()), ""));
    };
    let settings = fields.iter().map(|(name, value)| match &value.kind {
        JsonKind::Number(x) => Ok((name.clone().into_owned(), Setting::Number(*x))),
        JsonKind::Text(text) => Ok((name.clone().into_owned(), Setting::Text(text.clone().into_owned()))),
        _ => {
            let message = format!("expected a number or a text, got {}", value.called());
            Err(ValuePath::Field(&at, name).fault(VALUE, value, message, ""))
        }
    });
    settings.collect()
}
