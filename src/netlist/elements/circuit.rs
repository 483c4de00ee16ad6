//! Circuit elements: resistors, voltage sources, electrical ground, ports.

use super::super::drawing::Fact;
use super::super::sink::Reported;
use super::super::value::Value;
use super::arguments::Site;
use crate::structure::{Port, Resistor, VoltageSource};

pub(super) fn resistor(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let resistance = match (site.positive_if_any("R")?, site.positive_if_any("G")?) {
        (Some(resistance), _) => resistance,
        (None, Some(conductance)) => 1.0 / conductance,
        (None, None) => return Err(site.missing("R")),
    };
    let (a, b) = (site.node(0), site.node(1));
    site.drawing.electrical(&[a, b]);
    site.drawing.structure.resistors.push(Resistor { name: site.name(), a, b, resistance });
    Ok(())
}

pub(super) fn voltage_source(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    if let Some(v) = site.instance.arguments.given.iter().find(|a| a.name == "V")
        && matches!(v.value, Value::Text(_))
    {
        let help = "make it a `port` and let the circuit drive it";
        return Err(site.sink.error("E062", v.span, "a source of a netlist cannot change in time".into(), help));
    }
    let voltage = site.required("V")?;
    source(site, voltage)
}

/// An inductor is a short circuit for the slow device: a source of 0 V.
pub(super) fn inductor(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let message = "an inductor is taken as a short circuit".to_owned();
    site.sink.warning("W021", site.instance.span, message, "put it into the circuit that drives the ports");
    source(site, 0.0)
}

fn source(site: &mut Site<'_, '_>, voltage: f64) -> Result<(), Reported> {
    let (plus, minus) = (site.node(0), site.node(1));
    site.drawing.electrical(&[plus, minus]);
    site.drawing.structure.voltage_sources.push(VoltageSource { name: site.name(), plus, minus, voltage });
    Ok(())
}

/// A capacitor is open in statics and takes no part in the device.
pub(super) fn capacitor(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::Capacitor, site.instance.span);
    site.drawing.electrical(&[site.node(0), site.node(1)]);
    Ok(())
}

pub(super) fn eground(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let node = site.node(0);
    site.drawing.electrical(&[node]);
    if site.drawing.grounded.insert(node) {
        site.drawing.structure.electrical_grounds.push(node);
    }
    Ok(())
}

pub(super) fn port(site: &mut Site<'_, '_>) -> Result<(), Reported> {
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
