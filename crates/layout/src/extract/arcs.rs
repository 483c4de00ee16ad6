//! Chains of short beams along a circle become arcs; widths that only rounding to the grid makes different become one.

use super::{Arc, Extraction};
use std::f64::consts::PI;

/// Fewest beams that make an arc.
const MIN_BEAMS: usize = 4;
/// Nodes may lie off the circle by so many database units, and this fraction of the width.
const OFF: [f64; 2] = [3.0, 0.02];
/// Largest change of the width along an arc (1).
const SWELL: f64 = 0.02;
/// Largest angle of one arc (rad).
const LARGEST: f64 = PI;
/// Widths of beams at an angle to the grid are one when they differ by less than this many database units.
const ROUNDING: f64 = 2.0;

/// Gives beams at an angle to the grid that rounding made different one width.
pub(super) fn same_widths(result: &mut Extraction, unit: f64) {
    let tilted = |k: &usize| {
        let [p, q] = result.beams[*k].nodes.map(|n| result.nodes[n].at);
        let beam = &result.beams[*k];
        let even = (beam.width[0] - beam.width[1]).abs() <= ROUNDING * unit;
        even && (p[0] - q[0]).abs() > 1e-3 * unit && (p[1] - q[1]).abs() > 1e-3 * unit
    };
    let width = |k: usize| 0.5 * (result.beams[k].width[0] + result.beams[k].width[1]);
    let mut order: Vec<(usize, f64, f64)> = (0..result.beams.len())
        .filter(tilted)
        .map(|k| {
            let [p, q] = result.beams[k].nodes.map(|n| result.nodes[n].at);
            (k, width(k), (p[0] - q[0]).hypot(p[1] - q[1]))
        })
        .collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let mut first = 0;
    while first < order.len() {
        let group = order[first..].iter().take_while(|k| k.1 - order[first].1 <= ROUNDING * unit).count();
        let alike = &order[first..first + group];
        let long: f64 = alike.iter().map(|k| k.2).sum();
        let mean = alike.iter().map(|k| k.1 * k.2).sum::<f64>() / long;
        alike.iter().for_each(|(k, ..)| result.beams[*k].width = [mean; 2]);
        first += group;
    }
}

/// Puts arcs in the place of chains of beams.
pub(super) fn arcs(result: &mut Extraction, unit: f64) {
    let chains = chains(result);
    let mut gone = vec![false; result.beams.len()];
    for chain in chains {
        let mut first = 0;
        while first + MIN_BEAMS <= chain.len() {
            bimorph_base::budget::check();
            let fits = |count: usize| {
                first + count <= chain.len() && fit(result, &chain[first..first + count], unit).is_some()
            };
            if !fits(MIN_BEAMS) {
                first += 1;
                continue;
            }
            // the longest that fits: doubling, then halving
            let (mut low, mut high) = (MIN_BEAMS, 2 * MIN_BEAMS);
            while fits(high) {
                (low, high) = (high, 2 * high);
            }
            while high - low > 1 {
                let middle = usize::midpoint(low, high);
                if fits(middle) { low = middle } else { high = middle }
            }
            let run = &chain[first..first + low];
            if let Some(arc) = fit(result, run, unit) {
                result.arcs.push(arc);
                run.iter().for_each(|link| gone[link.beam] = true);
            }
            first += low;
        }
    }
    let mut kept = gone.into_iter();
    result.beams.retain(|_| !kept.next().unwrap_or(false));
}

/// A beam in a chain, from one node to the next.
#[derive(Debug, Clone, Copy)]
struct ChainLink {
    beam: usize,
    from: usize,
    to: usize,
}

/// Beams that follow each other with nothing else at the nodes between them.
fn chains(result: &Extraction) -> Vec<Vec<ChainLink>> {
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); result.nodes.len()];
    for (k, beam) in result.beams.iter().enumerate() {
        beam.nodes.iter().for_each(|n| at[*n].push(k));
    }
    let mut through: Vec<bool> = at.iter().map(|beams| beams.len() == 2).collect();
    let others =
        result.links.iter().chain(result.roots.iter().map(|r| &r.nodes)).flatten().chain(&result.anchors).copied();
    let others = others.chain(result.bodies.iter().map(|b| b.node)).chain(result.combs.iter().flat_map(|c| c.nodes));
    let plates = result.plates.iter().flat_map(|p| p.nodes).chain(result.facing.iter().flat_map(|f| f.nodes));
    others.chain(plates).for_each(|n| through[n] = false);
    // an arc carries no current
    (0..through.len()).filter(|n| result.carries(*n)).for_each(|n| through[n] = false);
    let mut done = vec![false; result.beams.len()];
    let mut chains = Vec::new();
    for rings in [false, true] {
        for start in 0..result.nodes.len() {
            if through[start] != rings {
                continue;
            }
            for &first in &at[start] {
                let (mut chain, mut from, mut beam) = (Vec::new(), start, first);
                while !done[beam] {
                    done[beam] = true;
                    let [a, b] = result.beams[beam].nodes;
                    let to = if a == from { b } else { a };
                    chain.push(ChainLink { beam, from, to });
                    if !through[to] || to == start {
                        break;
                    }
                    let Some(next) = at[to].iter().find(|k| **k != beam) else { break };
                    (from, beam) = (to, *next);
                }
                if chain.len() >= MIN_BEAMS {
                    chains.push(chain);
                }
            }
        }
    }
    chains
}

/// The arc through the first, a middle and the last node, if all others lie on it.
fn fit(result: &Extraction, run: &[ChainLink], unit: f64) -> Option<Arc> {
    let beam = &result.beams[run[0].beam];
    let place = |n: usize| result.nodes[n].at;
    let (a, m, b) = (place(run[0].from), place(run[run.len() / 2].from), place(run[run.len() - 1].to));
    let (p, q) = ([m[0] - a[0], m[1] - a[1]], [b[0] - a[0], b[1] - a[1]]);
    let across = p[0] * q[1] - p[1] * q[0];
    let [pp, qq] = [p, q].map(|d| d[0] * d[0] + d[1] * d[1]);
    if across.abs() < 1e-9 * pp.max(qq) {
        return None;
    }
    let center = [a[0] + (q[1] * pp - p[1] * qq) / (2.0 * across), a[1] + (p[0] * qq - q[0] * pp) / (2.0 * across)];
    let radius = (a[0] - center[0]).hypot(a[1] - center[1]);
    let width = run.iter().map(|l| 0.5 * (result.beams[l.beam].width[0] + result.beams[l.beam].width[1]));
    let width = width.sum::<f64>() / run.len() as f64;
    let off = OFF[0] * unit + OFF[1] * width;
    let turn = across.signum();
    let mut angle = 0.0;
    let mut last = [a[0] - center[0], a[1] - center[1]];
    let mut largest: f64 = 0.0;
    let mut smallest = f64::INFINITY;
    for link in run {
        let other = &result.beams[link.beam];
        let to = place(link.to);
        let arm = [to[0] - center[0], to[1] - center[1]];
        let step = turn * (last[0] * arm[1] - last[1] * arm[0]).atan2(last[0] * arm[0] + last[1] * arm[1]);
        let alike = other.layer == beam.layer
            && other.porosity == beam.porosity
            && other.width.iter().all(|w| (w - width).abs() <= SWELL * width);
        if !alike || step <= 0.0 || (arm[0].hypot(arm[1]) - radius).abs() > off {
            return None;
        }
        (largest, smallest) = (largest.max(step), smallest.min(step));
        angle += step;
        last = arm;
    }
    // the pieces of a polygonal arc are equal; a straight beam at its end is longer and not part of it
    if angle > LARGEST || largest > 3.0 * smallest || largest > 0.6 || radius < 0.5 * width {
        return None;
    }
    let nodes = [run[0].from, run[run.len() - 1].to];
    Some(Arc { layer: beam.layer, nodes, angle: turn * angle, width, porosity: beam.porosity })
}
