//! Circuit elements: resistors, capacitors, inductors, sources, amplifiers, electrical ground, ports.
//!
//! The model itself knows resistors and fixed voltages. The model itself contains resistors and fixed voltages only.
//! Other elements are kept for a deck around the device, and all other uses of the netlist warn that they are omitted.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::super::value::Value;
use super::arguments::ElementSite;
use bimorph_structure::{CircuitElement, CircuitKind, Port, Resistor, VoltageSource, Wire};

pub(super) fn resistor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let resistance = match (site.positive_if_any("R")?, site.positive_if_any("G")?) {
        (Some(resistance), _) => resistance,
        (None, Some(conductance)) => 1.0 / conductance,
        (None, None) => return Err(site.missing("R")),
    };
    site.warn_of_coincident_ends();
    let (a, b) = (site.node(0), site.node(1));
    site.drawing.electrical(&[a, b]);
    site.drawing.structure.resistors.push(Resistor { name: site.name(), a, b, resistance });
    draw(site, CircuitKind::Resistor, Some(resistance));
    Ok(())
}

pub(super) fn voltage_source(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    if let Some(v) = site.instance.arguments.given.iter().find(|a| a.name == "V")
        && matches!(v.value, Value::Text(_))
    {
        let help = "make it a `port` and let the circuit drive it";
        return Err(site.sink.error("E062", v.span, "a source of a netlist cannot change in time".into(), help));
    }
    // a source of small signals alone gives nothing at rest
    let small = [site.number("sv")?, site.number("sph")?];
    let voltage = if small == [None; 2] { site.required("V")? } else { site.number_or("V", 0.0)? };
    draw(site, CircuitKind::VoltageSource, Some(voltage));
    if small != [None; 2]
        && let Some(element) = site.drawing.structure.circuit.last_mut()
    {
        element.small_signal = Some([small[0].unwrap_or(1.0), small[1].unwrap_or(0.0)]);
    }
    source(site, voltage)
}

/// Nodes on one conductor without resistance.
pub(super) fn wire(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let nodes = site.instance.nodes.clone();
    site.drawing.electrical(&nodes);
    site.drawing.structure.wires.push(Wire { name: site.name(), nodes });
    Ok(())
}

/// The elements of Clark's circuits for SUGAR are drawn too: between arms, `len` long, without being members.
fn drawn(
    site: &mut ElementSite<'_, '_>,
    build: fn(&mut ElementSite<'_, '_>) -> Result<(), Reported>,
) -> Result<(), Reported> {
    if let Some(length) = site.number("len")? {
        let (first, second) = (site.arm(1)?, site.arm(2)?);
        let along = site.instance.rotation.apply([length, 0.0, 0.0]);
        let way = [0, 1].map(|i| first[i] + along[i] + second[i]);
        site.drawing.lay(site.instance.span, &[site.node(0), site.node(1)], &[[0.0; 2], way]);
    }
    build(site)
}

pub(super) fn drawn_resistor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, resistor)
}

pub(super) fn drawn_capacitor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, capacitor)
}

pub(super) fn drawn_inductor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, inductor)
}

pub(super) fn drawn_source(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, voltage_source)
}

/// A wire that is drawn: its nodes are at one potential.
pub(super) fn drawn_short(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, |site| {
        draw(site, CircuitKind::VoltageSource, Some(0.0));
        source(site, 0.0)
    })
}

/// A switch. SUGAR draws it and gives it no equation: it is open.
pub(super) fn drawn_switch(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, |site| {
        let nodes = site.instance.nodes.clone();
        site.drawing.electrical(&nodes);
        site.drawing.note(Fact::Switch, site.instance.span);
        Ok(())
    })
}

/// Ground at the first node; the second is where its picture ends.
pub(super) fn drawn_ground(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    drawn(site, eground)
}

/// Keeps an element as drawn.
fn draw(site: &mut ElementSite<'_, '_>, kind: CircuitKind, value: Option<f64>) {
    let nodes = site.instance.nodes.to_vec();
    site.drawing.electrical(&nodes);
    site.drawing.structure.circuit.push(CircuitElement { name: site.name(), kind, nodes, value, small_signal: None });
}

/// A current source, from the first node through it to the second. It takes no part in the model.
pub(super) fn current_source(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let current = site.required("I")?;
    site.drawing.note(Fact::ActiveCircuit, site.instance.span);
    draw(site, CircuitKind::CurrentSource, Some(current));
    Ok(())
}

/// An ideal operational amplifier. It takes no part in the model.
pub(super) fn op_amp(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::ActiveCircuit, site.instance.span);
    draw(site, CircuitKind::OpAmp, None);
    Ok(())
}

/// A voltage source controlled by a voltage. It takes no part in the model.
pub(super) fn amplifier(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let gain = site.required("A")?;
    site.drawing.note(Fact::ActiveCircuit, site.instance.span);
    draw(site, CircuitKind::Amplifier, Some(gain));
    Ok(())
}

/// An inductor is a short circuit for the slow device: a source of 0 V.
pub(super) fn inductor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let inductance = site.number("L")?;
    if let Some(value) = inductance.filter(|l| *l <= 0.0) {
        return Err(site.out_of_range("L", value, "positive"));
    }
    let message = "an inductor is taken as a short circuit".to_owned();
    let help = "`bimorph cosim` runs the netlist's circuit as it is";
    site.sink.warning("W021", site.instance.span, message, help);
    draw(site, CircuitKind::Inductor, inductance);
    source(site, 0.0)
}

fn source(site: &mut ElementSite<'_, '_>, voltage: f64) -> Result<(), Reported> {
    let (plus, minus) = (site.node(0), site.node(1));
    site.drawing.electrical(&[plus, minus]);
    site.drawing.structure.voltage_sources.push(VoltageSource { name: site.name(), plus, minus, voltage });
    Ok(())
}

/// A capacitor is open in statics and takes no part in the device.
pub(super) fn capacitor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let capacitance = site.positive_if_any("C")?;
    site.drawing.note(Fact::Capacitor, site.instance.span);
    draw(site, CircuitKind::Capacitor, capacitance);
    Ok(())
}

pub(super) fn eground(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let node = site.node(0);
    site.drawing.electrical(&[node]);
    if site.drawing.grounded.insert(node) {
        site.drawing.structure.electrical_grounds.push(node);
    }
    Ok(())
}

pub(super) fn port(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let name = site.name();
    let nodes = &site.instance.nodes;
    site.drawing.electrical(nodes);
    if !site.drawing.port_names.insert(name.clone()) {
        let message = format!("there is a port `{name}` already");
        return Err(site.error("E063", message, "a port's name is its element's name; give each its own"));
    }
    if site.instance.anonymous {
        let message = format!("this port has no name: it is called `{name}`");
        let help = "write its name before the word: `heat port * [a b] []`";
        site.sink.warning("W009", site.instance.span, message, help);
    }
    let (plus, minus) = (nodes[0], nodes.get(1).copied());
    if minus == Some(plus) {
        return Err(site.error("E063", format!("both nodes of the port `{name}` are the same"), ""));
    }
    site.drawing.structure.ports.push(Port { name, plus, minus });
    Ok(())
}
