//! **Rigid beams.** Beams with negligible strain become rigid. The criterion is their fraction of the strain energy of
//! every mode in the band: it must predict less than half of the remaining tolerance, as a relative rise of the
//! frequency. The result is verified. The frequencies with rigid beams are compared with the estimates of the elastic
//! model. The compliance at each load, electrode or heater is compared with that of the elastic model. Both must be
//! within the tolerance. Beams that touch ground, that are heated or under stress, and electrodes of facing beams stay
//! elastic, as they may matter where nothing rings.

use super::band_modes::{MeshModes, solve_modes};
use super::groups::Groups;
use super::mesh_target::{Mesh, MeshTarget};
use super::mode_errors::{relative, strain_shares};
use crate::discretize::{Assembly, DiscretizeError, discretize_with};
use crate::options::CompileOptions;
use bimorph_domains::MaterialPoint;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix};
use bimorph_structure::BeamRows;
use bimorph_structure::{NodeId, Structure};

/// Makes beams rigid where the tolerance allows.
pub(super) fn stiffen(
    structure: &Structure,
    bare: &Structure,
    options: &CompileOptions,
    aim: &MeshTarget,
    groups: &Groups,
    elastic: &MeshModes,
    order: &mut Mesh,
) -> Result<(), DiscretizeError> {
    let Some(error) = &elastic.error else { return Ok(()) };
    let modes = elastic.modes;
    let shares = strain_shares(bare, options, &elastic.parts, &elastic.lambda[..modes], &elastic.shapes[..modes]);
    let grounded = |node: NodeId| elastic.parts.nodes[node.0].is_some_and(|p| p.body == BodyId::Ground);
    let along = BeamRows::new(structure);
    let electrodes: Vec<usize> = structure.beam_gaps.iter().flat_map(|gap| along.along(gap)).collect();
    let plain = |b: &usize| {
        let beam = &structure.beams[*b];
        let strained = beam.heater.is_some() || beam.temperature.is_some() || beam.material.stress != 0.0;
        let electrode = electrodes.contains(b);
        !strained && !electrode && !grounded(beam.a) && !grounded(beam.b)
    };
    let rise = |mode: usize, g: &[usize]| 0.5 * g.iter().map(|&b| shares[mode][b]).sum::<f64>();
    let worst = |g: &[usize]| (0..modes).map(|m| rise(m, g)).fold(0.0, f64::max);
    let mut candidates: Vec<&Vec<usize>> = groups.0.iter().filter(|g| g.iter().all(plain)).collect();
    candidates.sort_by(|a, b| worst(a).total_cmp(&worst(b)));
    let mut sums: Vec<f64> = error.relative[..modes].to_vec();
    let mut chosen: Vec<&Vec<usize>> = Vec::new();
    for group in candidates {
        let next: Vec<f64> = sums.iter().enumerate().map(|(m, sum)| sum + rise(m, group)).collect();
        if next.iter().any(|e| e.abs() > options.errors().prediction()) {
            break;
        }
        sums = next;
        chosen.push(group);
    }
    let acted = acted_on(structure);
    let touched = |g: &Vec<usize>| {
        g.iter().any(|&b| [structure.beams[b].a, structure.beams[b].b].iter().any(|n| acted.contains(n)))
    };
    let Some(yields) = compliances(structure, &acted, &elastic.parts) else { return Ok(()) };
    while !chosen.is_empty() {
        let mut segments = order.segments.clone();
        for group in &chosen {
            for &beam in *group {
                segments[beam] = 0;
            }
        }
        let stiff = discretize_with(bare, options, &segments)?;
        let still = compliances(structure, &acted, &stiff).unwrap_or_default();
        let firm = still.len() == yields.len()
            && still
                .iter()
                .zip(&yields)
                .all(|(rigid, elastic)| (rigid - elastic).abs() <= options.errors().within(*elastic));
        if firm {
            let now = solve_modes(bare, options, aim, &segments, Some(elastic))?;
            order.passes += 1;
            let apart = relative(&now.lambda, &error.reference);
            let worst = apart.iter().take(modes).fold(0.0, |m: f64, e| m.max(e.abs()));
            if now.lambda.len() >= modes && options.errors().holds(worst) {
                (order.segments, order.estimated_error) = (segments, Some(worst));
                break;
            }
        }
        let count = chosen.len();
        chosen.retain(|g| firm || !touched(g));
        if chosen.len() == count {
            chosen.truncate(count / 2);
        }
    }
    Ok(())
}

/// Nodes at which loads and electrodes act.
fn acted_on(structure: &Structure) -> Vec<NodeId> {
    let mut nodes: Vec<NodeId> = structure.loads.iter().map(|load| load.node).collect();
    nodes.extend(structure.combs.iter().flat_map(|c| [c.a, c.b]));
    nodes.extend(structure.plate_gaps.iter().flat_map(|g| [g.a, g.b]));
    nodes.extend(structure.beam_gaps.iter().flat_map(|g| g.nodes));
    nodes.extend(structure.stops.iter().flat_map(|s| [Some(s.a), s.b]).flatten());
    nodes.extend(structure.placed.iter().flat_map(|p| p.nodes.iter().copied()));
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Compliance of the structure at its loads: fᵀK⁻¹f for a unit force or moment in each direction at each of these
/// nodes, and for a unit tension in each beam that heat or stress lengthens. Empty where nothing acts; none where
/// something does on a structure that floats.
fn compliances(structure: &Structure, acted: &[NodeId], parts: &Assembly) -> Option<Vec<f64>> {
    let (system, model) = (&parts.system, &parts.system.model);
    let n = system.bodies();
    let mut forces: Vec<Vec<Pose>> = Vec::new();
    let push = |f: &mut [Pose], p: &MaterialPoint, x: f64, y: f64, moment: f64| {
        if let BodyId::Free(k) = p.body {
            f[k] += Pose::new(x, y, moment + p.arm.x * y - p.arm.y * x);
        }
    };
    for point in acted.iter().filter_map(|node| parts.nodes[node.0]) {
        for (x, y, moment) in [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] {
            let mut f = vec![Pose::zeros(); n];
            push(&mut f, &point, x, y, moment);
            forces.push(f);
        }
    }
    for (beam, points) in structure.beams.iter().zip(&parts.beams) {
        if beam.heater.is_some() || beam.temperature.is_some() || beam.material.stress != 0.0 {
            let (y, x) = beam.angle.sin_cos();
            let mut f = vec![Pose::zeros(); n];
            push(&mut f, &points[0], -x, -y, 0.0);
            push(&mut f, &points[points.len() - 1], x, y, 0.0);
            forces.push(f);
        }
    }
    if forces.is_empty() {
        return Some(Vec::new());
    }
    let mut k = BodyMatrix::new(&model.pattern);
    let (rest, mut residual) = (vec![Pose::zeros(); n], vec![Pose::zeros(); n]);
    system.tangent(&rest, &system.electrics.drive(), &mut k, &mut residual);
    model.project_matrix(&mut k);
    k.factor(&model.pattern).ok()?;
    let compliance = |mut f: Vec<Pose>| {
        model.project(&mut f);
        let mut u = f.clone();
        k.solve(&model.pattern, &mut u);
        f.iter().zip(&u).map(|(f, u)| f.dot(u)).sum::<f64>()
    };
    Some(forces.into_iter().map(compliance).collect())
}
