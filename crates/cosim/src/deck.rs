//! A deck around the device of a netlist: the mechanism as one `A` line, the netlist's own circuit as SPICE lines.
//!
//! Every electrical node that the circuit or a port touches and whose potential acts on the mechanism is a port of the device
//! ([`Structure::without_circuit`]); the rest of the circuit stands beside it. Ports of the netlist are held at a voltage by a source
//! each, as they are in every analysis, unless the netlist's circuit touches them and no voltage is given.

use super::printed::{prints, scale};
use super::spice_names::{SpiceNames, swept};
use bimorph_structure::{CircuitElement, CircuitKind, NodeId, Structure};
use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;
use thiserror::Error;

/// Gain that stands for an ideal operational amplifier (1).
const IDEAL_GAIN: f64 = 1e6;

/// Content of the deck beside the netlist.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DeckSpec {
    /// The netlist as the `.model` line names it.
    pub file: String,
    /// Netlist parameters and options of the model, as words of the `.model` line.
    pub model: Vec<String>,
    /// Voltages of ports (V).
    pub ports: Vec<(String, f64)>,
    /// Signals shown as voltages.
    pub signals: Vec<String>,
    /// Analyses, as SPICE writes them (`.tran 1u 1m`).
    pub analyses: Vec<String>,
    /// Waveforms of sources and ports, by name, in SPICE syntax (`PULSE(0 4 1u 1u)`).
    pub drives: Vec<(String, String)>,
    /// The source or port that has an amplitude of 1 in small-signal analyses; none: the first.
    pub source: Option<String>,
}

/// Why there is no deck.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DeckError {
    /// The mechanism has no electrical side.
    #[error("no potential acts on the mechanism: it has no gap, comb or heated beam between electrical nodes")]
    NothingElectrical,
    /// There is neither a circuit nor a port.
    #[error("nothing drives the mechanism: draw a `Vsrc`, another element of a circuit, or a `port`")]
    NothingDrives,
    /// No ground.
    #[error("no node is at electrical ground; draw `eground * [NODE] []`")]
    NoGround,
    /// An element without its value.
    #[error("`{name}` has no value; give `{parameter}=`")]
    NoValue {
        /// The element.
        name: String,
        /// The parameter.
        parameter: &'static str,
    },
    /// A name that the netlist does not have.
    #[error("there is no {what} `{name}`; there is {available}")]
    Unknown {
        /// The missing file.
        what: &'static str,
        /// The name.
        name: String,
        /// The names there are.
        available: String,
    },
    /// A port or a drive that is given twice.
    #[error("--{what}: `{name}` is given twice; leave one of the two out")]
    Twice {
        /// Which option.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A file name that decks cannot hold.
    #[error("the netlist's name \"{file}\" holds a blank, which ngspice takes for its end; rename the file")]
    Blank {
        /// The name.
        file: String,
    },
}

/// The deck around a netlist's device.
///
/// # Errors
/// [`DeckError`]
pub fn around(structure: &Structure, wanted: &DeckSpec) -> Result<String, DeckError> {
    if wanted.file.contains(char::is_whitespace) {
        return Err(DeckError::Blank { file: wanted.file.clone() });
    }
    if structure.circuit.is_empty() && structure.ports.is_empty() {
        return Err(DeckError::NothingDrives);
    }
    if structure.electrical_grounds.is_empty() {
        return Err(DeckError::NoGround);
    }
    let alone = structure.clone().without_circuit();
    if alone.ports.is_empty() {
        return Err(DeckError::NothingElectrical);
    }
    let mut names = SpiceNames::new();
    // nodes on a wire are one node of SPICE
    let nets = structure.nets();
    let net = |id: NodeId| nets[id.0];
    let mut nodes: BTreeMap<NodeId, String> =
        structure.electrical_grounds.iter().map(|n| (net(*n), "0".into())).collect();
    let in_circuit = structure.circuit.iter().flat_map(|e| e.nodes.iter().copied());
    let at_ports = structure.ports.iter().flat_map(|p| [Some(p.plus), p.minus].into_iter().flatten());
    for node in in_circuit.chain(at_ports).collect::<Vec<_>>() {
        nodes.entry(net(node)).or_insert_with(|| names.take(&structure.nodes[node.0].name));
    }
    let node = |id: NodeId| nodes.get(&net(id)).cloned().unwrap_or_else(|| "0".into());

    let mut text = format!("* {}: the device, and the circuit that its netlist draws\n", wanted.file);
    let wave = |name: &str| wanted.drives.iter().find(|(driven, _)| driven == name).map(|(_, wave)| wave.as_str());
    let mut elements = SpiceNames::new();
    let sources = sources(structure, wanted)?;
    // what the netlist's sources and ports are called in the deck
    let mut called: BTreeMap<String, String> = BTreeMap::new();
    for element in &structure.circuit {
        let mut line = line(element, &node, &mut elements, sources.as_deref() == Some(element.name.as_str()))?;
        if let Some(word) = line.split_whitespace().next() {
            called.insert(element.name.to_ascii_lowercase(), word.to_owned());
        }
        if let Some(wave) = wave(&element.name) {
            line += &format!(" {wave}");
        }
        text += &line;
        text.push('\n');
    }
    let touched: HashSet<NodeId> = structure.circuit.iter().flat_map(|e| e.nodes.iter().map(|n| net(*n))).collect();
    for port in &structure.ports {
        let given = wanted.ports.iter().find(|(name, _)| *name == port.name).map(|(_, volts)| *volts);
        let known = |n: NodeId| touched.contains(&net(n)) || node(n) == "0";
        let within = touched.contains(&net(port.plus)) && port.minus.is_none_or(known);
        let over_time = wave(&port.name).map_or_else(String::new, |wave| format!(" {wave}"));
        if given.is_none() && over_time.is_empty() && within {
            continue;
        }
        let ac = if sources.as_deref() == Some(port.name.as_str()) { " ac 1" } else { "" };
        let minus = port.minus.map_or_else(|| "0".into(), &node);
        let name = elements.take(&format!("V_{}", port.name));
        called.insert(port.name.to_ascii_lowercase(), name.clone());
        let _ = writeln!(text, "{name} {} {minus} dc {:e}{ac}{over_time}", node(port.plus), given.unwrap_or(0.0));
    }
    let pairs: Vec<String> = alone.ports.iter().map(|port| format!("{} 0", node(port.plus))).collect();
    let shown: Vec<(String, String)> =
        wanted.signals.iter().map(|signal| (names.take(signal), format!("\"{signal}:{:e}\"", scale(signal)))).collect();
    let monitors = match shown.is_empty() {
        true => "null".to_owned(),
        false => format!("%v [{}]", shown.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(" ")),
    };
    let _ = writeln!(text, "A1 %gd [{}] {monitors} device", pairs.join(" "));
    let quoted: Vec<String> = alone.ports.iter().map(|port| format!("\"{}\"", port.name)).collect();
    let _ = writeln!(text, ".model device bimorph(file=\"{}\" without_circuit=true", wanted.file);
    let _ = writeln!(text, "+ ports=[{}]", quoted.join(" "));
    if !shown.is_empty() {
        let signals: Vec<&str> = shown.iter().map(|(_, s)| s.as_str()).collect();
        let _ = writeln!(text, "+ monitors=[{}]", signals.join(" "));
    }
    for word in &wanted.model {
        let _ = writeln!(text, "+ {word}");
    }
    text.push_str("+ )\n");
    for analysis in &wanted.analyses {
        let _ = writeln!(text, "{}", swept(analysis, &called));
    }
    let monitored = shown.iter().map(|(node, _)| node.as_str());
    let at_ports = alone.ports.iter().filter_map(|port| nodes.get(&net(port.plus))).map(String::as_str);
    let at_ports: Vec<&str> = monitored.chain(at_ports.filter(|node| *node != "0")).collect();
    let given: Vec<&str> = called.values().map(String::as_str).filter(|name| name.starts_with("v_")).collect();
    text += &prints(&wanted.analyses, &at_ports, &given);
    text.push_str(".end\n");
    Ok(text)
}

/// The source that small signals come from; checks the names that were given.
fn sources(structure: &Structure, wanted: &DeckSpec) -> Result<Option<String>, DeckError> {
    for (what, names) in [
        ("port", wanted.ports.iter().map(|(name, _)| name).collect::<Vec<_>>()),
        ("drive", wanted.drives.iter().map(|(name, _)| name).collect()),
    ] {
        if let Some((_, name)) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
            return Err(DeckError::Twice { what, name: (*name).clone() });
        }
    }
    let listed = |names: &[&str]| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let ports: Vec<&str> = structure.ports.iter().map(|p| p.name.as_str()).collect();
    if let Some((name, _)) = wanted.ports.iter().find(|(name, _)| !ports.contains(&name.as_str())) {
        return Err(DeckError::Unknown { what: "port", name: name.clone(), available: listed(&ports) });
    }
    let is_source = |e: &&CircuitElement| matches!(e.kind, CircuitKind::VoltageSource | CircuitKind::CurrentSource);
    let mut all: Vec<&str> = structure.circuit.iter().filter(is_source).map(|e| e.name.as_str()).collect();
    all.extend(wanted.ports.iter().map(|(name, _)| name.as_str()));
    all.extend(wanted.drives.iter().map(|(name, _)| name.as_str()).filter(|name| ports.contains(name)));
    if structure.circuit.is_empty() {
        all = ports.clone();
    }
    let known =
        |name: &str| ports.contains(&name) || structure.circuit.iter().filter(is_source).any(|e| e.name == name);
    if let Some((name, _)) = wanted.drives.iter().find(|(name, _)| !known(name)) {
        return Err(DeckError::Unknown { what: "source or port", name: name.clone(), available: listed(&all) });
    }
    match &wanted.source {
        Some(name) if all.contains(&name.as_str()) => Ok(Some(name.clone())),
        Some(name) => Err(DeckError::Unknown { what: "source", name: name.clone(), available: listed(&all) }),
        // what the netlist itself says of small signals holds
        None if structure.circuit.iter().any(|e| e.small_signal.is_some()) => Ok(None),
        None => Ok(all.first().map(|name| (*name).to_owned())),
    }
}

/// An element of the circuit as a line.
fn line(
    element: &CircuitElement,
    node: &impl Fn(NodeId) -> String,
    names: &mut SpiceNames,
    ac: bool,
) -> Result<String, DeckError> {
    let (letter, parameter) = match element.kind {
        CircuitKind::Resistor => ("R", "R"),
        CircuitKind::Capacitor => ("C", "C"),
        CircuitKind::Inductor => ("L", "L"),
        CircuitKind::VoltageSource => ("V", "V"),
        CircuitKind::CurrentSource => ("I", "I"),
        CircuitKind::OpAmp | CircuitKind::Amplifier => ("E", "A"),
    };
    let value = match (element.kind, element.value) {
        (CircuitKind::OpAmp, _) => IDEAL_GAIN,
        (_, Some(value)) => value,
        (_, None) => return Err(DeckError::NoValue { name: element.name.clone(), parameter }),
    };
    let at = |n: usize| node(element.nodes[n]);
    let name = names.take(&format!("{letter}_{}", element.name));
    let small = match element.small_signal {
        Some([amplitude, phase]) => format!(" ac {amplitude:e} {:e}", phase.to_degrees()),
        None if ac => " ac 1".to_owned(),
        None => String::new(),
    };
    let (dc, ac) = match element.kind {
        CircuitKind::VoltageSource | CircuitKind::CurrentSource => ("dc ", small.as_str()),
        _ => ("", ""),
    };
    Ok(match element.kind {
        // SUGAR's op-amp drives node 3 by the second input over the first, its vcvs by the first over the second
        CircuitKind::OpAmp => format!("{name} {} {} {} {} {value:e}", at(2), at(3), at(1), at(0)),
        CircuitKind::Amplifier => format!("{name} {} {} {} {} {value:e}", at(2), at(3), at(0), at(1)),
        _ => format!("{name} {} {} {dc}{value:e}{ac}", at(0), at(1)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_base::Bundle;
    use bimorph_netlist::load;

    const PLATE: &str = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\n\
        anchor * [e] [l=1u w=1u h=1u]\nplategap2d * [m e] [A=1e-8 gap=2u]\neground * [e] []\n";

    fn deck(more: &str, wanted: &DeckSpec) -> Result<String, DeckError> {
        let loaded =
            load(&Bundle::from_text("n.net", &format!("{PLATE}{more}")), &[]).unwrap_or_else(|d| panic!("{d}"));
        around(&loaded.structure, &DeckSpec { file: "n.net".into(), ..wanted.clone() })
    }

    /// The waveform of a source follows its voltage; a name without a source is an error.
    #[test]
    fn sources_follow_their_waveforms() {
        let drive =
            |name: &str| DeckSpec { drives: vec![(name.into(), "PULSE(0 4 1u)".into())], ..DeckSpec::default() };
        let more = "bias Vsrc * [s e] [V=4]\nr R * [s m] [R=1k]\ndrive port * [m e] []\n";
        let text = deck(more, &drive("bias")).unwrap();
        assert!(text.contains("v_bias s 0 dc 4e0 ac 1 PULSE(0 4 1u)\nr_r s m 1e3\nA1"), "{text}");
        let text = deck("drive port * [m e] []\n", &drive("drive")).unwrap();
        assert!(text.contains("v_drive m 0 dc 0e0 ac 1 PULSE(0 4 1u)\nA1"), "{text}");
        assert!(matches!(deck(more, &drive("r")), Err(DeckError::Unknown { .. })));
    }

    /// Every element of the circuit becomes a line, nodes have legal names of their own, the device has the node that acts on it, and
    /// an amplifier's nodes come in SPICE's order.
    #[test]
    fn the_circuit_becomes_lines() {
        let more = "bias Vsrc * [s(1) e] [V=4]\nR * [s(1) m] [R=1k]\nc C * [m e] [C=1p]\nL * [s(1) GND] [L=1m]\n\
            i Isrc * [GND e] [I=1u]\namp opamp * [q m o e] []\nx vcvs * [m e q e] [A=2]\nR * [o q] [G=1m]\n";
        let wanted = DeckSpec {
            signals: vec!["m.x".into()],
            analyses: vec![".op".into()],
            model: vec!["tol=1e-4".into()],
            ..DeckSpec::default()
        };
        let text = deck(more, &wanted).unwrap();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(
            lines,
            [
                "v_bias s_1 0 dc 4e0 ac 1",
                "r_anon8 s_1 m 1e3",
                "c_c m 0 1e-12",
                "l_anon9 s_1 gnd_2 1e-3",
                "i_i gnd_2 0 dc 1e-6",
                "e_amp o 0 m q 1e6",
                "e_x q 0 m 0 2e0",
                "r_anon10 o q 1e3",
                "A1 %gd [m 0] %v [m_x] device",
                ".model device bimorph(file=\"n.net\" without_circuit=true",
                "+ ports=[\"m\"]",
                "+ monitors=[\"m.x:1e6\"]",
                "+ tol=1e-4",
                "+ )",
                ".op",
                ".print op v(m_x) v(m) i(v_bias)",
                ".end",
            ]
        );
    }

    /// Nodes on a wire are one node of the circuit, and the device has one port for them; on a wire to ground they are ground.
    #[test]
    fn wires_are_one_node() {
        let more = "bias Vsrc * [s g] [V=4]\nR * [s x] [R=1k]\nC * [y e] [C=1p]\nwire * [m x y] []\nwire * [e g] []\n";
        let text = deck(more, &DeckSpec::default()).unwrap();
        let lines: Vec<&str> = text.lines().skip(1).take(4).collect();
        assert_eq!(
            lines,
            ["v_bias s 0 dc 4e0 ac 1", "r_anon8 s x 1e3", "c_anon9 x 0 1e-12", "A1 %gd [x 0] null device"]
        );
        assert!(text.contains("ports=[\"x\"]"), "{text}");
    }

    /// Each port is driven by a source; missing or unknown ones are an error.
    #[test]
    fn what_is_missing_is_reported() {
        let port = "drive port * [m e] []\n";
        let wanted = DeckSpec { ports: vec![("drive".into(), 2.0)], ..DeckSpec::default() };
        let text = deck(port, &wanted).unwrap();
        assert!(text.contains("v_drive m 0 dc 2e0 ac 1\nA1 %gd [m 0] null device\n"), "{text}");
        assert_eq!(deck("", &DeckSpec::default()), Err(DeckError::NothingDrives));
        let value = deck("c C * [m e] []\n", &DeckSpec::default());
        assert_eq!(value, Err(DeckError::NoValue { name: "c".into(), parameter: "C" }));
        let unknown = deck(port, &DeckSpec { source: Some("x".into()), ..wanted });
        assert!(matches!(&unknown, Err(DeckError::Unknown { available, .. }) if available == "drive"), "{unknown:?}");
        let nothing = deck("R * [p e] [R=1]\n", &DeckSpec::default());
        assert_eq!(nothing, Err(DeckError::NothingElectrical));
    }
}
