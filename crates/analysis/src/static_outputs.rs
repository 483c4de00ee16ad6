//! Numbers of a static result by name, and sums of them.

use crate::readout::ReadoutError;
use crate::readout::expression::{Expression, Quantity};
use crate::statics::StaticResult;
use bimorph_base::suggest::nearest;
use bimorph_structure::Structure;
use std::collections::HashSet;

/// Names of the numbers of a static result.
pub const OUTPUTS: &str = "NODE.x, NODE.y, NODE.rz, BEAM.T, BEAM.Tmax, BEAM.stress, BEAM.nominal, ANCHOR.fx, ANCHOR.fy, ANCHOR.m, PORT.i or PORT.q";

/// A number of a static result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticOutput {
    unit: &'static str,
    value: f64,
}

impl Quantity for StaticOutput {
    fn unit(&self) -> &'static str {
        self.unit
    }
}

/// Kind of a part that has numbers in a static result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum StaticPart {
    Node,
    Beam,
    /// A beam whose strength is known.
    StressedBeam,
    /// The same with a fillet.
    FilletedBeam,
    /// A driven anchor, by its node.
    Anchor,
    Port,
}

/// Name, kind and unit of `PART.QUANTITY`.
fn split(name: &str) -> Option<(&str, &str, StaticPart, &'static str)> {
    let (part, quantity) = name.rsplit_once('.')?;
    let (kind, unit) = match quantity {
        "x" | "y" => (StaticPart::Node, "m"),
        "rz" => (StaticPart::Node, "rad"),
        "stress" => (StaticPart::StressedBeam, "Pa"),
        "nominal" => (StaticPart::FilletedBeam, "Pa"),
        "fx" | "fy" => (StaticPart::Anchor, "N"),
        "m" => (StaticPart::Anchor, "N·m"),
        "T" | "Tmax" => (StaticPart::Beam, "K"),
        "i" => (StaticPart::Port, "A"),
        "q" => (StaticPart::Port, "C"),
        _ => return None,
    };
    Some((part, quantity, kind, unit))
}

fn unknown<'a>(name: &str, known: impl Iterator<Item = (&'a str, StaticPart)>) -> ReadoutError {
    let meant = split(name).and_then(|(part, quantity, kind, _)| {
        let alike = known.filter(|(_, of)| *of == kind).map(|(name, _)| name);
        Some(format!(" (did you mean {}.{quantity}?)", nearest(part, alike)?))
    });
    let hint = format!("expected {OUTPUTS}, or a sum of these{}", meant.unwrap_or_default());
    ReadoutError::UnknownSignal { name: name.to_owned(), hint }
}

/// The parts that a result has numbers of.
fn parts(result: &StaticResult) -> impl Iterator<Item = (&str, StaticPart)> {
    let nodes = result.nodes.iter().map(|(name, _)| (name.as_str(), StaticPart::Node));
    let beams = result.temperatures_k.iter().map(|(name, _)| (name.as_str(), StaticPart::Beam));
    let stressed = result.stresses_pa.iter().map(|(name, _)| (name.as_str(), StaticPart::StressedBeam));
    let filleted = result.nominal_stresses_pa.iter().map(|(name, _)| (name.as_str(), StaticPart::FilletedBeam));
    nodes
        .chain(beams)
        .chain(stressed)
        .chain(filleted)
        .chain(result.anchor_forces.iter().map(|(name, _)| (name.as_str(), StaticPart::Anchor)))
        .chain(result.currents_a.iter().map(|(name, _)| (name.as_str(), StaticPart::Port)))
}

fn output(result: &StaticResult, name: &str) -> Option<StaticOutput> {
    let (part, quantity, _, unit) = split(name)?;
    let node = || result.nodes.iter().find(|(node, _)| node == part).map(|(_, motion)| motion);
    let anchor = || result.anchor_forces.iter().find(|(node, _)| node == part).map(|(_, force)| force);
    let listed = |list: &[(String, f64)]| list.iter().find(|(name, _)| name == part).map(|(_, x)| *x);
    let value = match quantity {
        "x" => node()?.x,
        "y" => node()?.y,
        "rz" => node()?.rz,
        "T" => listed(&result.temperatures_k)?,
        "stress" => listed(&result.stresses_pa)?,
        "nominal" => listed(&result.nominal_stresses_pa)?,
        "fx" => anchor()?.fx,
        "fy" => anchor()?.fy,
        "m" => anchor()?.m,
        // a prescribed temperature is that of all of a beam
        "Tmax" => listed(&result.peak_temperatures_k).or_else(|| listed(&result.temperatures_k))?,
        "i" => listed(&result.currents_a)?,
        _ => listed(&result.charges_c)?,
    };
    Some(StaticOutput { unit, value })
}

impl Expression<StaticOutput> {
    /// The number of that name, or a sum of such numbers.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`], [`ReadoutError::BadExpression`].
    pub fn of_static(result: &StaticResult, text: &str) -> Result<Self, ReadoutError> {
        Self::find(text, |name| output(result, name).ok_or_else(|| unknown(name, parts(result))))
    }

    /// Its value.
    pub fn value(&self) -> f64 {
        self.sum(|output| output.value)
    }
}

/// Checks that static results of a structure have these numbers and sums.
///
/// # Errors
/// Those of [`Expression::of_static`].
pub fn check(structure: &Structure, texts: &[String]) -> Result<(), ReadoutError> {
    let nodes =
        structure.nodes.iter().filter(|node| node.mechanical).map(|node| (node.name.as_str(), StaticPart::Node));
    let beams = structure.beams.iter().map(|beam| (beam.name.as_str(), StaticPart::Beam));
    let strong = structure.beams.iter().filter(|beam| beam.material.strength.is_some());
    let stressed = strong.map(|beam| (beam.name.as_str(), StaticPart::StressedBeam));
    let filleted =
        structure.beams.iter().filter(|beam| beam.material.strength.is_some() && beam.material.fillet.is_some());
    let filleted = filleted.map(|beam| (beam.name.as_str(), StaticPart::FilletedBeam));
    let driven = structure.driven_anchors().map(|node| (node, StaticPart::Anchor));
    let ports = structure.ports.iter().map(|port| (port.name.as_str(), StaticPart::Port));
    let known: HashSet<(&str, StaticPart)> =
        nodes.chain(beams).chain(stressed).chain(filleted).chain(driven).chain(ports).collect();
    let find = |name: &str| match split(name) {
        Some((part, _, kind, unit)) if known.contains(&(part, kind)) => Ok(StaticOutput { unit, value: 0.0 }),
        _ => Err(unknown(name, known.iter().copied())),
    };
    texts.iter().try_for_each(|text| Expression::find(text, find).map(drop))
}
