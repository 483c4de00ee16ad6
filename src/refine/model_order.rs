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

use super::order_error::{OrderError, of_modes, relative, strain_shares};
use crate::discretize::{DiscretizeError, Discretized, discretize_with, order};
use crate::gaps::Point;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Model};
use crate::options::CompileOptions;
use crate::solve::subspace;
use crate::structure::{Beam, NodeId, Structure};
use serde::Serialize;
use std::collections::HashMap;

/// Largest kh of a segment at the edge of the band.
const LONGEST: f64 = 3.0;
/// Share of the tolerance that predictions may use.
const MARGIN: f64 = 0.9;
/// Modes within the band beyond which the rule of [`order`] stands as it is.
const MOST_MODES: usize = 64;
/// Segments beyond which it does.
const MOST_SEGMENTS: usize = 10_000;
/// Models tried.
const MOST_PASSES: usize = 12;

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

/// Chooses the numbers of segments for a band.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose(structure: &Structure, options: &CompileOptions, band: f64) -> Result<ModelOrder, DiscretizeError> {
    let bare = mechanics(structure);
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
        let now = look(&bare, options, band, &segments, before)?;
        let Some(error) = &now.error else {
            if holds.is_some() {
                break;
            }
            return Ok(ModelOrder { segments, estimated_error: None, modes_in_band: now.modes, passes });
        };
        let worst = error.relative.iter().take(now.modes).fold(0.0, |m: f64, e| m.max(e.abs()));
        let order =
            ModelOrder { segments: segments.clone(), estimated_error: Some(worst), modes_in_band: now.modes, passes };
        let mut next = groups.fewest(options, error, now.modes, &segments, &floor);
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
            if next == segments || passes == MOST_PASSES {
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
    stiffen(structure, &bare, options, band, &groups, &elastic, &mut order)?;
    Ok(order)
}

/// Makes beams rigid where the tolerance allows.
fn stiffen(
    structure: &Structure,
    bare: &Structure,
    options: &CompileOptions,
    band: f64,
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
            let now = look(bare, options, band, &segments, Some(elastic))?;
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
fn mechanics(structure: &Structure) -> Structure {
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
    band: f64,
    segments: &[usize],
    before: Option<&Seen>,
) -> Result<Seen, DiscretizeError> {
    let parts = discretize_with(structure, options, segments)?;
    let (modes, lambda, shapes, error) = modes_in_band(structure, options, band, &parts, before).unwrap_or_default();
    Ok(Seen { parts, lambda, shapes, modes, error })
}

type Found = (usize, Vec<f64>, Vec<Vec<Pose>>, Option<OrderError>);

fn modes_in_band(
    structure: &Structure,
    options: &CompileOptions,
    band: f64,
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
    let edge = (std::f64::consts::TAU * band).powi(2);
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
                before.shapes.iter().take(block).map(|x| carried(&before.parts, parts, x)).collect();
            start.extend(fresh.into_iter().skip(start.len()));
            start
        }
        _ => fresh,
    };
    // far below the errors that are to be told, which are twice as large in λ
    let settled = (0.05 * options.tol).clamp(1e-9, 1e-3);
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

/// A shape of one model over the bodies of another, linear between the points of each beam.
fn carried(from: &Discretized, to: &Discretized, x: &[Pose]) -> Vec<Pose> {
    let mut y = vec![Pose::zeros(); to.system.bodies()];
    let at = |p: &Point| {
        let pose = Model::pose(x, p.body);
        Pose::new(pose.x - pose.z * p.arm.y, pose.y + pose.z * p.arm.x, pose.z)
    };
    let mut put = |p: &Point, moved: Pose| {
        if let BodyId::Free(k) = p.body {
            y[k] = Pose::new(moved.x + moved.z * p.arm.y, moved.y - moved.z * p.arm.x, moved.z);
        }
    };
    for (from, to) in from.beams.iter().zip(&to.beams) {
        let (last, new) = (from.len() - 1, to.len() - 1);
        for (k, point) in to.iter().enumerate() {
            let s = (k * last) as f64 / new as f64;
            let first = (s as usize).min(last - 1);
            let t = s - first as f64;
            put(point, at(&from[first]) * (1.0 - t) + at(&from[first + 1]) * t);
        }
    }
    for (from, to) in from.nodes.iter().zip(&to.nodes) {
        if let (Some(from), Some(to)) = (from, to) {
            put(to, at(from));
        }
    }
    y
}

/// Beams that are alike.
struct Groups(Vec<Vec<usize>>);

impl Groups {
    fn new(beams: &[Beam]) -> Self {
        let mut known: HashMap<[i64; 5], usize> = HashMap::new();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, beam) in beams.iter().enumerate() {
            let m = &beam.material;
            // alike to nine digits
            let key = [beam.length, beam.width, beam.thickness, m.youngs_modulus, m.density]
                .map(|x| (x.ln() * 1e9).round() as i64);
            let group = *known.entry(key).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(index);
        }
        Self(groups)
    }

    /// The fewest segments for which every mode is predicted to hold.
    fn fewest(
        &self,
        options: &CompileOptions,
        error: &OrderError,
        modes: usize,
        segments: &[usize],
        floor: &[usize],
    ) -> Vec<usize> {
        let most = |beams: &[usize], of: &[usize]| beams.iter().map(|&b| of[b]).max().unwrap_or(1);
        let now: Vec<usize> = self.0.iter().map(|g| most(g, segments)).collect();
        let mut next: Vec<usize> = self.0.iter().map(|g| most(g, floor)).collect();
        let share = |mode: usize, g: &[usize]| g.iter().map(|&b| error.shares[mode][b].abs()).sum::<f64>();
        let shares: Vec<Vec<f64>> = (0..modes).map(|m| self.0.iter().map(|g| share(m, g)).collect()).collect();
        let power = options.scheme.order();
        let scaled = |g: usize, n: usize| (now[g] as f64 / n as f64).powi(power);
        let goal = MARGIN * options.tol;
        let mut sums: Vec<f64> =
            shares.iter().map(|s| s.iter().enumerate().map(|(g, s)| s * scaled(g, next[g])).sum()).collect();
        // a step in N of at least a fiftieth keeps long searches short
        let step = |n: usize| options.scheme.segments(n + 1 + n / 50);
        for _ in 0..100_000 {
            let gain = |g: usize| {
                let less = scaled(g, next[g]) - scaled(g, step(next[g]));
                let bodies = (step(next[g]) - next[g]) * self.0[g].len();
                let useful = (sums.iter().zip(&shares)).filter(|(sum, _)| **sum > goal);
                useful.map(|(sum, s)| (s[g] * less).min(sum - goal) / sum).sum::<f64>() / bodies as f64
            };
            let Some((best, gained)) = (0..now.len()).map(|g| (g, gain(g))).max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            if gained <= 0.0 {
                break;
            }
            let less = scaled(best, next[best]) - scaled(best, step(next[best]));
            for (sum, s) in sums.iter_mut().zip(&shares) {
                *sum -= s[best] * less;
            }
            next[best] = step(next[best]);
        }
        let mut counts = vec![1; segments.len()];
        for (group, n) in self.0.iter().zip(next) {
            for &beam in group {
                counts[beam] = n;
            }
        }
        counts
    }
}
