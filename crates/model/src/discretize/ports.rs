//! Resistors, heated beams, sources and ports → potentials, port conductances and quadratic forms of temperature.
//!
//! Sources are numbered ports first, then the netlist's voltage sources, then one for each gap with a fixed voltage, and one
//! for each with an offset voltage (both touch no node).

use super::error::DiscretizeError;
use super::rigid::RigidGroups;
use bimorph_domains::drive::Electrics;
use bimorph_domains::floating::FloatingConductors;
use bimorph_domains::network::{CircuitError, ElectricalNetwork, Potentials};
use bimorph_domains::thermal::{HeatConductor, HeatCurves, Heating, RelativeCurve};
use bimorph_domains::{Domain, Member, PlacedMember};
use bimorph_multibody::BodyId;
use bimorph_structure::{Beam, GapVoltage, Heater, PropertyCurve, Structure};
use nalgebra::{DMatrix, RowDVector};
use std::collections::HashMap;
use std::sync::Arc;

/// Builds the electrical side; `heated` lists the beams that are heaters, in heater order, and `gaps` what
/// acts across gaps.
///
/// # Errors
/// [`DiscretizeError::SourceLoop`], [`DiscretizeError::Conductances`], [`DiscretizeError::NoHeatSink`].
pub fn lay(
    structure: &Structure,
    heated: &[usize],
    gaps: &[PlacedMember<'_, Member>],
    rigid: &RigidGroups,
) -> Result<Electrics, DiscretizeError> {
    let ports = structure.ports.len();
    let mut names: Vec<String> = structure.ports.iter().map(|p| p.name.clone()).collect();
    names.extend(structure.voltage_sources.iter().map(|s| s.name.clone()));
    let mut fixed: Vec<f64> = structure.voltage_sources.iter().map(|s| s.voltage).collect();

    let net: Vec<usize> = structure.nets().into_iter().map(|node| node.0).collect();
    let conductors = heated.iter().filter_map(|index| conductor(&structure.beams[*index], &net));
    let heaters: Vec<HeatConductor> = conductors.collect();
    let circuit = network(structure, &net, heaters.iter().map(|h| (h.a, h.b, h.resistance)));
    let potentials = circuit.solve().map_err(|e| match e {
        CircuitError::SourceLoop { source_index } => {
            DiscretizeError::SourceLoop { source_name: names[source_index].clone() }
        }
        CircuitError::Range { resistor } => {
            let element = match structure.resistors.get(resistor) {
                Some(resistor) => &resistor.name,
                None => &structure.beams[heated[resistor - structure.resistors.len()]].name,
            };
            DiscretizeError::Conductances { element: element.clone() }
        }
    })?;
    let driven = potentials.potential.ncols();
    let fields = gaps.iter().filter(|gap| gap.voltage.is_some()).count();
    // a gap with a voltage of its own is a source
    bimorph_base::budget::lay_out_matrix(fields + 2 * ports, driven + ports + structure.voltage_sources.len() + fields);

    let mut rows: Vec<(usize, Result<Vec<f64>, usize>)> = Vec::new();
    for (g, gap) in gaps.iter().enumerate() {
        let row = match gap.voltage {
            None => continue,
            Some(GapVoltage::Nodes(a, b)) => Ok(potentials.difference(net[a.0], net[b.0]).iter().copied().collect()),
            Some(GapVoltage::Fixed(v)) => {
                fixed.push(*v);
                names.push(gap.name.to_owned());
                Err(ports + fixed.len() - 1)
            }
        };
        rows.push((g, row));
    }
    let shifted = offset_sources(structure, gaps, (&mut fixed, &mut names));
    let sources = ports + fixed.len();
    let mut gap_rows = DMatrix::zeros(gaps.len(), sources);
    for (g, row) in rows {
        match row {
            Ok(row) => gap_rows.view_mut((g, 0), (1, driven)).copy_from(&RowDVector::from_vec(row)),
            Err(own) => gap_rows[(g, own)] = 1.0,
        }
    }
    shifted.into_iter().for_each(|(g, own)| gap_rows[(g, ports + own)] = 1.0);
    let mut sink = vec![false; structure.nodes.len()];
    for n in (0..structure.nodes.len()).filter(|n| structure.nodes[*n].mechanical && rigid.grounded(*n)) {
        sink[net[n]] = true;
    }
    let held = anchor_rises(structure, &heaters, &net);
    let heating = Heating::new(heaters, &potentials, sources, &sink)
        .map_err(|e| DiscretizeError::NoHeatSink { beam: structure.beams[heated[e.heater]].name.clone() })?
        .with_hot(&circuit, &held);
    if heating.is_hot() {
        fixed_gap_voltages(structure, &heating, &circuit, (&potentials, &net), gaps)?;
    }
    let mut conductance = DMatrix::zeros(ports, sources);
    conductance.view_mut((0, 0), (ports, driven)).copy_from(&potentials.conductance.rows(0, ports));
    let floating = floating(structure, &circuit, &net, gaps);
    Ok(Electrics { ports, fixed, names, gap_rows, floating, conductance, heating, inputs: Vec::new() })
}

/// Electrodes that no port, source or ground fixes. Nodes of elements that the model leaves out stay at 0 V.
fn floating(
    structure: &Structure,
    circuit: &ElectricalNetwork,
    net: &[usize],
    gaps: &[PlacedMember<'_, Member>],
) -> FloatingConductors {
    let outside = structure.circuit.iter().filter(|element| element.kind.is_left_out());
    let outside = outside.flat_map(|element| element.nodes.iter().map(|node| net[node.0]));
    let (parts, count) = circuit.floating_parts(structure.ports.len(), outside);
    let sides = gaps.iter().enumerate().filter_map(|(g, gap)| match gap.voltage {
        Some(GapVoltage::Nodes(a, b)) => Some((g, [*a, *b].map(|node| (net[node.0], parts[net[node.0]])))),
        _ => None,
    });
    FloatingConductors::new((gaps.len(), count), &sides.collect::<Vec<_>>())
}

/// The pairs of bodies that floating conductors couple.
pub fn floating_pairs(electrics: &Electrics, gaps: &[PlacedMember<'_, Member>]) -> Vec<(BodyId, BodyId)> {
    let mut pairs = Vec::new();
    for group in electrics.floating.groups() {
        let mut bodies = Vec::new();
        for of in &group.gaps {
            gaps[of.gap].member.bodies(|body| {
                if !bodies.contains(&body) {
                    bodies.push(body);
                }
            });
        }
        for (i, a) in bodies.iter().enumerate() {
            bimorph_base::budget::check();
            pairs.extend(bodies[..i].iter().map(|b| (*a, *b)));
        }
    }
    pairs
}

/// A heated beam as a conductor of heat and current.
fn conductor(beam: &Beam, net: &[usize]) -> Option<HeatConductor> {
    let h = beam.heater.as_ref()?;
    Some(HeatConductor {
        a: net[beam.a.0],
        b: net[beam.b.0],
        resistance: h.resistance,
        conductance: h.conductance,
        expansion: beam.material.thermal_expansion,
        ambient: beam.material.ambient_temperature,
        time_constant: h.time_constant.unwrap_or(0.0),
        delayed: h.time_constant.is_none(),
        capacity: h.capacity,
        gas: h.gas.map_or(0.0, |gas| gas.conductance(beam.width, beam.length)),
        coefficient: h.coefficient,
        thermal_coefficient: h.thermal_coefficient,
        capacity_coefficient: h.capacity_coefficient,
        radiation: beam.radiation(),
        substrate: h.substrate.map_or(0.0, |substrate| substrate - beam.material.ambient_temperature),
        curves: heat_curves(beam, h),
    })
}

/// Properties of a heated beam that have curves over temperature; none: no one has.
fn heat_curves(beam: &Beam, heater: &Heater) -> Option<Arc<HeatCurves>> {
    let ambient = beam.material.ambient_temperature;
    let relative = |curve: &Option<PropertyCurve>| curve.as_ref().map(|curve| RelativeCurve::new(curve, ambient));
    let curves = HeatCurves {
        resistance: relative(&heater.resistance_curve),
        conductance: relative(&heater.conductance_curve),
        capacity: relative(&heater.capacity_curve),
        gas: relative(&heater.gas_curve),
        expansion: beam.material.expansion_curve.clone().map(|curve| (curve, ambient)),
    };
    (!curves.is_empty()).then(|| Arc::new(curves))
}

/// The network of a structure whose nodes lie on the nets `net`, its heated beams last among the resistors.
fn network(
    structure: &Structure,
    net: &[usize],
    heated: impl Iterator<Item = (usize, usize, f64)>,
) -> ElectricalNetwork {
    ElectricalNetwork {
        nodes: structure.nodes.len(),
        resistors: (structure.resistors.iter().map(|r| (net[r.a.0], net[r.b.0], r.resistance))).chain(heated).collect(),
        sources: (structure.ports.iter().map(|p| (net[p.plus.0], p.minus.map(|n| net[n.0]))))
            .chain(structure.voltage_sources.iter().map(|s| (net[s.plus.0], Some(net[s.minus.0]))))
            .collect(),
        grounds: structure.electrical_grounds.iter().map(|n| net[n.0]).collect(),
    }
}

/// Resistances between the electrodes of gaps, with all sources at 0 V.
#[derive(Debug, Clone, PartialEq)]
pub struct ElectrodeResistances {
    /// Gaps whose voltage is that of nodes, by their numbers.
    pub gaps: Vec<usize>,
    /// Voltage of a gap for a current through another (Ω).
    pub between: DMatrix<f64>,
}

/// Resistances between the electrodes of the gaps of these names; `warm` of each of the beams that are `heated` (Ω).
///
/// # Errors
/// [`CircuitError`].
pub fn electrode_resistances(
    structure: &Structure,
    names: &[String],
    heated: &[usize],
    warm: &[f64],
) -> Result<ElectrodeResistances, CircuitError> {
    let net: Vec<usize> = structure.nets().into_iter().map(|node| node.0).collect();
    let beams = heated.iter().map(|index| &structure.beams[*index]);
    let warm = beams.zip(warm).map(|(beam, resistance)| (net[beam.a.0], net[beam.b.0], *resistance));
    let voltages: HashMap<&str, &GapVoltage> = structure.gap_voltages().collect();
    let (mut gaps, mut pairs) = (Vec::new(), Vec::new());
    for (g, name) in names.iter().enumerate() {
        if let Some(GapVoltage::Nodes(a, b)) = voltages.get(name.as_str()) {
            gaps.push(g);
            pairs.push([net[a.0], net[b.0]]);
        }
    }
    let between = network(structure, &net, warm).resistances(&pairs)?;
    Ok(ElectrodeResistances { gaps, between })
}

/// Adds a source for each gap in which trapped charge acts as one in series; the gaps, with the numbers of their sources among the `fixed` ones.
fn offset_sources(
    structure: &Structure,
    gaps: &[PlacedMember<'_, Member>],
    (fixed, names): (&mut Vec<f64>, &mut Vec<String>),
) -> Vec<(usize, usize)> {
    let offsets: HashMap<&str, f64> = structure.gap_offsets().collect();
    let mut shifted = Vec::new();
    for (g, gap) in gaps.iter().enumerate().filter(|(_, gap)| gap.voltage.is_some()) {
        if let Some(volts) = offsets.get(gap.name) {
            shifted.push((g, fixed.len()));
            fixed.push(*volts);
            names.push(format!("{}.voffset", gap.name));
        }
    }
    shifted
}

/// Rise of the anchors of each net above the ambient temperature of the heaters (K); 0: none is given.
fn anchor_rises(structure: &Structure, heaters: &[HeatConductor], net: &[usize]) -> Vec<f64> {
    let mut held = vec![0.0; structure.nodes.len()];
    let Some(ambient) = heaters.first().map(|heater| heater.ambient) else { return held };
    for support in &structure.supports {
        if let Some(temperature) = support.temperature {
            held[net[support.node.0]] = temperature - ambient;
        }
    }
    held
}

/// Relative change of resistances by which gap voltages are tested (1).
const PROBE: f64 = 0.5;
/// Change of a gap's voltage that is rounding, for a volt of a source (1).
const SAME: f64 = 1e-9;

/// Refuses gaps whose voltages depend on resistances that depend on temperature.
fn fixed_gap_voltages(
    structure: &Structure,
    heating: &Heating,
    circuit: &ElectricalNetwork,
    (potentials, net): (&Potentials, &[usize]),
    gaps: &[PlacedMember<'_, Member>],
) -> Result<(), DiscretizeError> {
    let mut probe = circuit.clone();
    let first = probe.resistors.len() - heating.heaters.len();
    for (k, (resistor, heater)) in probe.resistors[first..].iter_mut().zip(&heating.heaters).enumerate() {
        if heater.changes_resistance() {
            // each by its own factor: equal ones leave dividers as they are
            resistor.2 *= 1.0 + PROBE * (1.0 + (k % 7) as f64 / 7.0);
        }
    }
    let Ok(hot) = probe.solve() else { return Ok(()) };
    for gap in gaps {
        let Some(GapVoltage::Nodes(a, b)) = gap.voltage else { continue };
        let (a, b) = (net[a.0], net[b.0]);
        if (potentials.difference(a, b) - hot.difference(a, b)).amax() > SAME {
            let beam = heating.heaters.iter().position(HeatConductor::changes_resistance);
            let beam = beam.and_then(|k| structure.beams.iter().filter(|b| b.heater.is_some()).nth(k));
            let beam = beam.map_or_else(String::new, |beam| beam.name.clone());
            return Err(DiscretizeError::HotGap { gap: gap.name.to_owned(), beam });
        }
    }
    Ok(())
}
