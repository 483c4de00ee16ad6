//! Straight beams: beam2d, beam3d and its kin, and beams that conduct.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::super::value::short;
use super::arguments::ElementSite;
use super::etched::EquivalentRectangle;
use bimorph_structure::{Beam, Heater, Load, NodeId, PropertyCurve, Resistor, Yield};

/// A layer's `thermcond` below this is no conductivity of a solid structural material (W/(m·K)). The MUMPs process
/// file of SUGAR has 2.33, which is the digits of silicon's expansion coefficient.
const SMALL_CONDUCTIVITY: f64 = 5.0;
/// Least radius of a fillet, of the width of the beam (1): the end of the chart of stress concentration.
const SHARPEST: f64 = 0.05;

/// In-plane width, thickness and direction of a rectangular section.
struct RectangularSection {
    width: f64,
    thickness: f64,
    angle: f64,
}

impl ElementSite<'_, '_> {
    /// The section of a mean width, turned as the element is: a quarter turn about its axis swaps width and thickness.
    fn section(&mut self, width: f64) -> Result<RectangularSection, Reported> {
        let angle = self.direction(self.instance.rotation)?;
        let (height, lean) = (self.positive("h")?, self.lean()?);
        let Some(side) = self.instance.rotation.side() else {
            let message = format!("the section of `{}` is tilted against the drawing plane", self.instance.name);
            return Err(self.error("E061", message, "turn it about its axis (`ox`) by quarter turns only"));
        };
        let EquivalentRectangle { width, thickness } = EquivalentRectangle::of(width, height, lean, side == 0);
        Ok(RectangularSection { width, thickness, angle })
    }

    /// A beam between two nodes; without a length it is measured from the node positions.
    pub(super) fn beam(
        &mut self,
        name: String,
        ends: [NodeId; 2],
        width: f64,
        length: Option<f64>,
    ) -> Result<Beam, Reported> {
        let section = self.section(width)?;
        let material = self.material()?;
        let temperature = self.temperature(&material)?;
        if let Some(radius) = material.fillet.filter(|radius| *radius < SHARPEST * section.width * (1.0 - 1e-9)) {
            let wanted = format!("{} m or more, a twentieth of the width", short(SHARPEST * section.width));
            return Err(self.out_of_range("fillet", radius, &wanted));
        }
        Ok(Beam {
            name,
            a: ends[0],
            b: ends[1],
            length: length.unwrap_or(0.0),
            angle: section.angle,
            width: section.width,
            thickness: section.thickness,
            material,
            temperature,
            heater: None,
        })
    }

    /// Adds a beam of the element's own `l` and the given width.
    pub(super) fn add_beam(&mut self, name: String, ends: [NodeId; 2], width: f64) -> Result<(), Reported> {
        let length = self.positive_if_any("l")?;
        if let Some(length) = length
            && self.leaves_plane()
        {
            let offset = self.instance.rotation.apply([length, 0.0, 0.0]);
            return self.upright(name, ends, width, offset);
        }
        let beam = self.beam(name, ends, width, length)?;
        self.bow(&beam)?;
        self.drawing.add_beam(self.instance.span, beam, length.is_some());
        Ok(())
    }

    /// A rest curvature (1/m), positive towards local y, or that of a `stressgradient`, as the pair of end moments E·I·curvature that
    /// is the same thing: the moment is constant along the beam and does not turn with it.
    fn bow(&mut self, beam: &Beam) -> Result<(), Reported> {
        let gradient = self.number_or("stressgradient", 0.0)?;
        let curvature = self.number("curvature")?.unwrap_or(-gradient / beam.material.youngs_modulus);
        if curvature == 0.0 {
            return Ok(());
        }
        let Some(side) = self.instance.rotation.side().filter(|side| *side != 0) else {
            let cause = if self.number("curvature")?.is_some() { "curvature" } else { "stressgradient" };
            let message = format!("`{cause}` bends `{}` out of the drawing plane and is left out", beam.name);
            let span = self.span_of(cause);
            self.sink.warning("W020", span, message, "models are planar (x, y, rotation about z)");
            return Ok(());
        };
        let bending = f64::from(side) * beam.material.youngs_modulus * beam.thickness * beam.width.powi(3) / 12.0;
        for (node, sign) in [(beam.a, -1.0), (beam.b, 1.0)] {
            let name = format!("{}.bow", beam.name);
            self.drawing.structure.loads.push(Load { name, node, force: [0.0; 2], moment: sign * bending * curvature });
        }
        Ok(())
    }

    /// Resistance from end to end, from `R`, `G`, `resistivity` or the layer's sheet resistance (Ω).
    pub(super) fn resistance(&mut self, r: &str, g: &str, width: f64) -> Result<f64, Reported> {
        if let Some(resistance) = self.positive_if_any(r)? {
            return Ok(resistance);
        }
        if let Some(conductance) = self.positive_if_any(g)? {
            return Ok(1.0 / conductance);
        }
        if let Some(resistivity) = self.positive_if_any("resistivity")? {
            return Ok(resistivity * self.positive("l")? / (width * self.positive("h")?));
        }
        match self.positive_if_any("sheetresistance")? {
            Some(sheet) => Ok(sheet * self.positive("l")? / width),
            None => Err(self.missing(r)),
        }
    }
}

impl ElementSite<'_, '_> {
    /// The curve in whose proportion the resistance of a beam changes with temperature, also where that is given by `R` or `G`.
    fn resistance_curve(&mut self) -> Result<Option<PropertyCurve>, Reported> {
        let name = if self.number("resistivity")?.is_some() { "resistivity" } else { "sheetresistance" };
        self.changing(name, "TCR")
    }

    /// A property against temperature, where it is given so and not by its coefficient, too.
    fn changing(&mut self, name: &str, coefficient: &str) -> Result<Option<PropertyCurve>, Reported> {
        let curve = self.curve(name)?;
        if curve.is_some() && self.number(coefficient)?.is_some() {
            let message = format!("`{name}` is a curve over temperature, and `{coefficient}` is given, too");
            return Err(self.error("E060", message, format!("leave out `{coefficient}`")));
        }
        Ok(curve)
    }

    /// True for a beam that is given the width or the height 0: in SUGAR it has no stiffness and no mass, and places its nodes.
    pub(super) fn has_no_section(&mut self) -> Result<bool, Reported> {
        let none = |size: Option<f64>| size == Some(0.0);
        let gone = none(self.number("w")?) && none(self.number("h")?) && self.number("l")?.is_some();
        if gone {
            self.drawing.note(Fact::NoSection, self.instance.span);
        }
        Ok(gone)
    }
}

pub(super) fn beam2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    if site.has_no_section()? {
        return super::arm::tracer(site);
    }
    let width = site.etched("w")?;
    site.add_beam(site.name(), [site.node(0), site.node(1)], width)
}

pub(super) fn beam3d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    beam2d(site)
}

/// beam2de, beam3de: a resistor along a beam.
pub(super) fn beam2de(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (a, b) = (site.node(0), site.node(1));
    let width = site.etched("w")?;
    let resistance = site.resistance("R", "G", width)?;
    site.add_beam(site.name(), [a, b], width)?;
    site.drawing.electrical(&[a, b]);
    site.drawing.structure.resistors.push(Resistor { name: site.name(), a, b, resistance });
    Ok(())
}

pub(super) fn beam3de(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    beam2de(site)
}

/// beam2de_b: a resistor of Rs·l/w along a beam.
pub(super) fn beam2de_b(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (a, b) = (site.node(0), site.node(1));
    let (length, width) = (site.positive("l")?, site.etched("w")?);
    let resistance = site.positive("Rs")? * length / width;
    site.add_beam(site.name(), [a, b], width)?;
    site.drawing.electrical(&[a, b]);
    site.drawing.structure.resistors.push(Resistor { name: site.name(), a, b, resistance });
    Ok(())
}

/// The electro-thermal beam.
pub(super) fn beam2det(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (a, b) = (site.node(0), site.node(1));
    let (length, width, height) = (site.positive("l")?, site.etched("w")?, site.positive("h")?);
    let resistance = site.resistance("R", "G", width)?;
    let conductivity = site.positive("thermcond")?;
    if !site.is_given("thermcond") && conductivity < SMALL_CONDUCTIVITY {
        site.drawing.note_number(Fact::SmallConductivity, site.instance.span, conductivity);
    }
    if site.number("thermalexpansion")?.is_none() {
        return Err(site.missing("thermalexpansion"));
    }
    let mut beam = site.beam(site.name(), [a, b], width, Some(length))?;
    let (time_constant, heat) = match (site.number("tau")?, site.positive_if_any("specificheat")?) {
        (Some(_), heat) => (Some(site.non_negative_or("tau", 0.0)?), heat),
        (None, Some(heat)) => (None, Some(heat)),
        (None, None) => (Some(0.0), None),
    };
    let capacity = beam.material.density * heat.unwrap_or(0.0) * length * width * height;
    beam.temperature = None;
    let gas = site.gas_loss(width, height)?;
    let conductance = conductivity * width * height / length;
    let ambient = beam.material.ambient_temperature;
    let resistance_curve = site.resistance_curve()?;
    let conductance_curve = site.changing("thermcond", "TCK")?;
    let capacity_curve = site.changing("specificheat", "TCC")?;
    let substrate = site.absolute("substratetemperature")?;
    let gas_curve = if gas.is_some() { site.curve("gasconductivity")? } else { None };
    if let Some((curve, substrate)) = gas_curve.as_ref().zip(substrate) {
        let span = site.span_of("gasconductivity");
        site.covered("gasconductivity", curve, substrate, "temperature of the substrate", span)?;
    }
    beam.heater = Some(Heater {
        resistance,
        conductance,
        time_constant,
        capacity,
        gas,
        coefficient: site.number_or("TCR", 0.0)?,
        thermal_coefficient: site.number_or("TCK", 0.0)?,
        capacity_coefficient: site.number_or("TCC", 0.0)?,
        resistance_curve,
        conductance_curve,
        capacity_curve,
        gas_curve,
        emissivity: site.emissivity(ambient)?,
        substrate,
    });
    site.drawing.electrical(&[a, b]);
    if let (Some(stress), Some(softening)) = (site.positive_if_any("yieldstress")?, site.positive_if_any("softening")?)
    {
        if softening <= ambient {
            let message = format!("`softening` is {softening} K, not above the ambient temperature of {ambient} K");
            return Err(site.error("E060", message, "give the temperature at which no strength is left [K]"));
        }
        let beam = site.drawing.structure.beams.len();
        site.drawing.structure.yields.push(Yield { beam, stress, softening, strain: 0.0 });
    }
    site.bow(&beam)?;
    site.drawing.add_beam(site.instance.span, beam, true);
    Ok(())
}
