//! Model order from a band and a tolerance: the fewest segments for which the estimate holds.
//!
//! Starts from the rule of [`order`], computes the modes within the band and their estimated errors
//! ([`order_error`](super::order_error)), and takes a beam's contribution to fall with the power of its scheme in the number
//! of its segments. From the fewest segments that the band allows upwards, the beams that gain most per body get one more
//! until every mode is predicted to hold. The prediction is then computed; what fails is refined, what holds may be coarsened
//! further. Beams of equal length, section and material get equal numbers, so that symmetric mechanisms stay symmetric.
//!
//! **Rigid beams.** Then beams whose strain does not matter become rigid: those whose share of the strain energy of every mode
//! in the band predicts less than is left of the tolerance (half of it, as a relative rise of the frequency). This too is
//! computed: the frequencies with rigid beams are compared with what the elastic model said those of the beams are, and the
//! compliance wherever a load, an electrode or heat acts with that of the elastic model, both within the tolerance. Beams
//! that touch ground, that are heated or under stress, and electrodes of facing beams stay elastic, as they may matter where
//! nothing rings.
//!
//! More than 64 modes in the band, or a start of more than ten thousand segments, keep what the rule of [`order`] gives.
//!
//! No segment is longer than kh = 3: a beam's own clamped modes (kh = 4.73) then lie above the band, and no mode within the
//! band can hide between nodes.
//!
//! Reference: J. O. Dow, "A Unified Approach to the Finite Element Method and Error Analysis Procedures" (1999), for
//! refinement led by an estimate.

use super::carry::carried;
use super::groups::{Groups, MARGIN};
use super::order_error::{OrderError, of_modes, relative, strain_shares};
use crate::discretize::{DiscretizeError, Discretized, discretize_with, order};
use crate::gaps::Point;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId};
use crate::options::CompileOptions;
use crate::solve::subspace;
use crate::structure::{NodeId, Structure};
use serde::Serialize;

/// Largest kh of a segment at the edge of the band.
const LONGEST: f64 = 3.0;
/// Modes within the band beyond which the rule of [`order`] stands as it is.
const MOST_MODES: usize = 64;
/// Segments beyond which it does.
pub(super) const MOST_SEGMENTS: usize = 10_000;
/// Models tried.
const MOST_PASSES: usize = 24;
/// Models without an estimate that are refined as a whole.
const MOST_BLIND: usize = 3;

/// The chosen order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelOrder {
    /// Segments of each beam, in the order of the structure; 0: a rigid beam.
    pub segments: Vec<usize>,
    /// Largest estimated relative error of a frequency within the band [1]; none where no mode lies in it or no estimate
    /// could be made.
    pub estimated_error: Option<f64>,
    /// Modes within the band that the estimate stands for.
    pub modes_in_band: usize,
    /// Models that were tried.
    pub passes: usize,
}

/// What a mesh is for.
#[derive(Debug, Clone, PartialEq)]
pub struct Aim {
    /// Highest frequency whose mode matters [Hz].
    pub band: f64,
    /// Relative error that the frequency of each mode may have [1], from the lowest; beyond the list: the option `tol`.
    pub tolerances: Vec<f64>,
    /// Beams whose strain does not matter become rigid.
    pub rigid: bool,
}

impl Aim {
    fn tolerance(&self, options: &CompileOptions, mode: usize) -> f64 {
        self.tolerances.get(mode).copied().unwrap_or(options.tol)
    }

    /// Largest error over what is allowed for it, times the option `tol`.
    fn worst(&self, options: &CompileOptions, relative: &[f64]) -> f64 {
        let over = |(m, e): (usize, &f64)| e.abs() / self.tolerance(options, m);
        options.tol * relative.iter().enumerate().map(over).fold(0.0, f64::max)
    }
}

/// Chooses the numbers of segments for a band.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose(structure: &Structure, options: &CompileOptions, band: f64) -> Result<ModelOrder, DiscretizeError> {
    choose_for(structure, options, &Aim { band, tolerances: Vec::new(), rigid: true })
}

/// Chooses the numbers of segments for an aim.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose_for(structure: &Structure, options: &CompileOptions, aim: &Aim) -> Result<ModelOrder, DiscretizeError> {
    let (bare, band) = (mechanics(structure), aim.band);
    let options = &CompileOptions { band: Some(band), ..options.clone() };
    let groups = Groups::new(&bare.beams);
    let floor: Vec<usize> = (bare.beams.iter())
        .map(|b| options.scheme.segments((order::waves(b, band) / LONGEST).ceil().max(1.0) as usize))
        .collect();
    let mut segments = order::a_priori(&bare, options)?;
    for (n, floor) in segments.iter_mut().zip(&floor) {
        *n = (*n).max(*floor);
    }
    if segments.iter().sum::<usize>() > MOST_SEGMENTS {
        return Ok(ModelOrder { segments, estimated_error: None, modes_in_band: 0, passes: 0 });
    }
    let mut holds: Option<(ModelOrder, Seen)> = None;
    let mut seen: Option<Seen> = None;
    for passes in 1..=MOST_PASSES {
        let before = seen.as_ref().or(holds.as_ref().map(|(_, seen)| seen));
        let now = look(&bare, options, aim, &segments, before)?;
        let Some(error) = &now.error else {
            if holds.is_some() {
                break;
            }
            // modes of so few segments may not be told apart: with more they are
            let finer: Vec<usize> = segments.iter().map(|&n| options.scheme.segments(2 * n)).collect();
            if now.modes > 0
                && passes <= MOST_BLIND
                && finer != segments
                && finer.iter().sum::<usize>() <= MOST_SEGMENTS
            {
                segments = finer;
                continue;
            }
            return Ok(ModelOrder { segments, estimated_error: None, modes_in_band: now.modes, passes });
        };
        let worst = aim.worst(options, &error.relative[..now.modes]);
        let order =
            ModelOrder { segments: segments.clone(), estimated_error: Some(worst), modes_in_band: now.modes, passes };
        let mut next = predicted(options, aim, &groups, error, now.modes, (&segments, &floor));
        let total = |n: &[usize]| n.iter().sum::<usize>();
        if worst <= options.tol {
            let done = total(&next) >= total(&segments);
            holds = Some((order, now));
            seen = None;
            if done {
                break;
            }
        } else {
            for (next, n) in next.iter_mut().zip(&segments) {
                *next = (*next).max(*n);
            }
            if holds.as_ref().is_some_and(|(h, _)| total(&next) >= total(&h.segments)) {
                break;
            }
            if next == segments || passes == MOST_PASSES || total(&next) > MOST_SEGMENTS {
                if holds.is_some() {
                    break;
                }
                return Ok(order);
            }
            seen = Some(now);
        }
        segments = next;
    }
    let (mut order, elastic) = holds.ok_or(DiscretizeError::NothingMoves)?;
    if aim.rigid {
        stiffen(structure, &bare, options, aim, &groups, &elastic, &mut order)?;
    }
    Ok(order)
}

/// The fewest segments for which every mode is predicted to hold.
fn predicted(
    options: &CompileOptions,
    aim: &Aim,
    groups: &Groups,
    error: &OrderError,
    modes: usize,
    (segments, floor): (&[usize], &[usize]),
) -> Vec<usize> {
    let share = |mode: usize, g: &Vec<usize>| g.iter().map(|&b| error.shares[mode][b].abs()).sum::<f64>();
    let shares: Vec<Vec<f64>> = (0..modes).map(|m| groups.0.iter().map(|g| share(m, g)).collect()).collect();
    let goals: Vec<f64> = (0..modes).map(|m| MARGIN * aim.tolerance(options, m)).collect();
    groups.fewest(options, &shares, &goals, segments, floor)
}

/// Makes beams rigid where the tolerance allows.
fn stiffen(
    structure: &Structure,
    bare: &Structure,
    options: &CompileOptions,
    aim: &Aim,
    groups: &Groups,
    elastic: &Seen,
    order: &mut ModelOrder,
) -> Result<(), DiscretizeError> {
    let Some(error) = &elastic.error else { return Ok(()) };
    let modes = elastic.modes;
    let shares = strain_shares(bare, options, &elastic.parts, &elastic.lambda[..modes], &elastic.shapes[..modes]);
    let grounded = |node: NodeId| elastic.parts.nodes[node.0].is_some_and(|p| p.body == BodyId::Ground);
    let electrodes: Vec<(NodeId, NodeId)> =
        structure.beam_gaps.iter().flat_map(|g| [(g.nodes[0], g.nodes[1]), (g.nodes[2], g.nodes[3])]).collect();
    let plain = |b: &usize| {
        let beam = &structure.beams[*b];
        let strained = beam.heater.is_some() || beam.temperature.is_some() || beam.material.stress != 0.0;
        let electrode = electrodes.contains(&(beam.a, beam.b)) || electrodes.contains(&(beam.b, beam.a));
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
        if next.iter().any(|e| e.abs() > MARGIN * options.tol) {
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
            && still.iter().zip(&yields).all(|(rigid, elastic)| (rigid - elastic).abs() <= options.tol * elastic);
        if firm {
            let now = look(bare, options, aim, &segments, Some(elastic))?;
            order.passes += 1;
            let apart = relative(&now.lambda, &error.reference);
            let worst = apart.iter().take(modes).fold(0.0, |m: f64, e| m.max(e.abs()));
            if now.lambda.len() >= modes && worst <= options.tol {
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
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// How far the drawn structure gives way where it is acted on: fᵀK⁻¹f for a unit force or moment in each direction at each
/// of these nodes, and for a unit tension in each beam that heat or stress lengthens. Empty where nothing acts; none where
/// something does on a structure that floats.
fn compliances(structure: &Structure, acted: &[NodeId], parts: &Discretized) -> Option<Vec<f64>> {
    let (system, model) = (&parts.system, &parts.system.model);
    let n = system.bodies();
    let mut forces: Vec<Vec<Pose>> = Vec::new();
    let push = |f: &mut [Pose], p: &Point, x: f64, y: f64, moment: f64| {
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
    let mut k = BlockMatrix::new(&model.pattern);
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

/// A model that was computed.
struct Seen {
    parts: Discretized,
    lambda: Vec<f64>,
    shapes: Vec<Vec<Pose>>,
    modes: usize,
    error: Option<OrderError>,
}

/// The drawing without what has no share in the modes of the drawn geometry.
pub(super) fn mechanics(structure: &Structure) -> Structure {
    let mut bare = Structure {
        nodes: structure.nodes.clone(),
        beams: structure.beams.clone(),
        masses: structure.masses.clone(),
        links: structure.links.clone(),
        supports: structure.supports.clone(),
        springs: structure.springs.clone(),
        ..Structure::default()
    };
    for beam in &mut bare.beams {
        beam.heater = None;
        beam.temperature = None;
        beam.material.stress = 0.0;
    }
    bare
}

/// Modes within the band and their errors; starts from the shapes of a model with other segments.
fn look(
    structure: &Structure,
    options: &CompileOptions,
    aim: &Aim,
    segments: &[usize],
    before: Option<&Seen>,
) -> Result<Seen, DiscretizeError> {
    let parts = discretize_with(structure, options, segments)?;
    let (modes, lambda, shapes, error) = modes_in_band(structure, options, aim, &parts, before).unwrap_or_default();
    Ok(Seen { parts, lambda, shapes, modes, error })
}

type Found = (usize, Vec<f64>, Vec<Vec<Pose>>, Option<OrderError>);

fn modes_in_band(
    structure: &Structure,
    options: &CompileOptions,
    aim: &Aim,
    parts: &Discretized,
    before: Option<&Seen>,
) -> Option<Found> {
    let (system, model) = (&parts.system, &parts.system.model);
    let n = system.bodies();
    let mut k = BlockMatrix::new(&model.pattern);
    let (rest, mut residual) = (vec![Pose::zeros(); n], vec![Pose::zeros(); n]);
    system.tangent(&rest, &system.electrics.drive(), &mut k, &mut residual);
    let shifted = |sigma: f64| {
        let mut a = k.clone();
        for (j, block) in a.diagonal.iter_mut().enumerate() {
            for i in 0..3 {
                block[(i, i)] -= sigma * model.mass(j)[i];
            }
        }
        model.project_matrix(&mut a);
        a
    };
    let edge = (std::f64::consts::TAU * aim.band).powi(2);
    let modes = shifted(edge).factor(&model.pattern).ok()?.negative;
    if modes == 0 || modes > MOST_MODES {
        return None;
    }
    let mut shift = 0.0;
    let mut factor = shifted(shift);
    if factor.factor(&model.pattern).is_err() {
        shift = -1e-3 * edge;
        factor = shifted(shift);
        factor.factor(&model.pattern).ok()?;
    }
    let massive: usize = (0..n).map(|j| model.mass(j).iter().filter(|m| **m > 0.0).count()).sum();
    let block = (modes + (4 + modes / 2).min(12)).min(massive);
    let fresh = subspace::start(n, block, system.length_scale);
    let start = match before {
        Some(before) if before.shapes.len() >= modes => {
            let mut start: Vec<Vec<Pose>> =
                (before.shapes.iter().take(block)).map(|x| carried(structure, &before.parts, parts, x, true)).collect();
            start.extend(fresh.into_iter().skip(start.len()));
            start
        }
        _ => fresh,
    };
    // far below the errors that are to be told, which are twice as large in λ
    let tightest = (0..modes).map(|m| aim.tolerance(options, m)).fold(options.tol, f64::min);
    let settled = (0.05 * tightest).clamp(1e-9, 1e-3);
    let found = subspace::iterate(model, (&factor, shift), start, modes, settled)?;
    // two more than wanted: the highest wanted one is told from its neighbours
    let some = (modes + 2).min(found.lambda.len());
    let rigid = parts.beams.iter().any(|points| points.len() == 2 && points[0].body == points[1].body);
    let error = if rigid {
        None // compared with the elastic model instead
    } else {
        of_modes(structure, options, parts, (&factor, shift), &found.lambda[..some], &found.shapes[..some])
    };
    Some((modes, found.lambda, found.shapes, error))
}
