//! Unit of a parameter by its effect: of the entries of the structure that change with it, one equals it.

use bimorph_model::compile::CompiledModel;
use bimorph_structure::Structure;

/// Relative change of a parameter.
const CHANGE: f64 = 1e-3;

/// Unit of a parameter at the value `x`; empty where its effects do not determine it. `changed` gives the model at another value.
pub(crate) fn unit_of(drawn: &CompiledModel, x: f64, changed: &dyn Fn(f64) -> Option<CompiledModel>) -> &'static str {
    let other = if x == 0.0 { 1e-9 } else { x * (1.0 + CHANGE) };
    let Some(model) = changed(other) else { return "" };
    let (before, after) = (quantities(&drawn.structure), quantities(&model.structure));
    if before.len() != after.len() {
        return "";
    }
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    let changes: Vec<_> = before.iter().zip(&after).filter(|(a, b)| !near(a.0, b.0)).collect();
    let equal = changes.iter().find(|(a, b)| near(a.0.abs(), x.abs()) && near(b.0.abs(), other.abs()));
    // half of it, twice, or a multiple: in proportion
    let proportional = || changes.iter().find(|(a, b)| x != 0.0 && near(a.0 / x, b.0 / other));
    let only = || {
        let first = changes.first()?;
        changes.iter().all(|(a, _)| a.1 == first.0.1).then_some(first)
    };
    equal.or_else(proportional).or_else(only).map_or("", |(a, _)| a.1)
}

/// Numbers of a structure with their units, those that parameters commonly set first.
fn quantities(s: &Structure) -> Vec<(f64, &'static str)> {
    let mut all = Vec::new();
    for load in &s.loads {
        all.extend([(load.force[0], "N"), (load.force[1], "N"), (load.force[0].hypot(load.force[1]), "N")]);
        all.push((load.moment, "N·m"));
    }
    for beam in &s.beams {
        let m = &beam.material;
        all.extend([(beam.width, "m"), (beam.length, "m"), (beam.thickness, "m"), (beam.angle, "rad")]);
        all.extend([(m.youngs_modulus, "Pa"), (m.stress, "Pa"), (m.density, "kg/m³"), (m.thermal_expansion, "1/K")]);
        all.extend([(m.ambient_temperature, "K"), (m.fluid, "m"), (m.viscosity, "Pa·s")]);
        all.extend(beam.temperature.map(|t| (t, "K")));
        if let Some(heater) = &beam.heater {
            all.extend([(heater.resistance, "Ω"), (heater.conductance, "W/K"), (heater.coefficient, "1/K")]);
            all.extend(heater.gas.iter().flat_map(|gas| [(gas.conductivity, "W/(m·K)"), (gas.distance, "m")]));
        }
    }
    for gap in &s.beam_gaps {
        all.extend([(gap.gap, "m"), (gap.length, "m"), (gap.height, "m"), (gap.touch.unwrap_or_default(), "m")]);
    }
    for gap in &s.plate_gaps {
        all.extend([(gap.gap, "m"), (gap.sides[0], "m"), (gap.sides[1], "m"), (gap.touch.unwrap_or_default(), "m")]);
        all.push((gap.area, "m²"));
    }
    for comb in &s.combs {
        all.extend([(comb.gap, "m"), (comb.overlap, "m"), (comb.height, "m"), (comb.finger[0], "m"), (comb.gaps, "")]);
    }
    for mass in &s.masses {
        all.extend([(mass.outline[0], "m"), (mass.outline[1], "m"), (mass.mass, "kg")]);
    }
    for stop in &s.stops {
        all.extend(stop.ways.iter().map(|way| (way.unwrap_or_default(), "m")));
    }
    for spring in &s.springs {
        all.extend([(spring.stiffness[0], "N/m"), (spring.stiffness[1], "N/m"), (spring.stiffness[2], "N·m/rad")]);
    }
    all.extend(s.resistors.iter().map(|r| (r.resistance, "Ω")));
    all.extend(s.voltage_sources.iter().map(|source| (source.voltage, "V")));
    all.extend(s.nodes.iter().flat_map(|node| node.position.map(|x| (x, "m"))));
    all
}
