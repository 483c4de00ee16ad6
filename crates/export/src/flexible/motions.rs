//! The modes at rest that a sudden input excites, as directions of a reduced model.
//!
//! Statics and their Taylor terms have the motion that an input ends with, not those about it. With the force f of an input, its static motion
//! x = K⁻¹·f and the modes φ, λ at rest, mode j begins with
//! ```text
//! (φ_j·f)²/(λ_j·f·x)      of the motion at the input, the sum of all of them being 1, and
//! (c·φ_j)·(φ_j·f)/λ_j     of a reading with the slope c
//! ```
//! after a step of the input. Modes with more than a certain share of any of these are taken, the largest first. Coordinates of 32 times the
//! slowest frequency follow their forces at once in a file: modes beyond it are left out.

use super::super::mechanism::dot;
use bimorph_analysis::harmonic::modal;
use bimorph_domains::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_solve::reduced::InputBox;
use bimorph_solve::reduced::polynomial::fast_coordinates::FAST;
use bimorph_solve::reduced::polynomial::shapes::Probe;

/// Modes computed first, and at most.
const FIRST: usize = 8;
const MOST: usize = 64;
/// Share of the motion at an input below which its coupling to a mode is rounding (1).
const ROUNDING: f64 = 1e-12;
/// Displacement for slopes of readings, over the length scale (1).
const SMALL: f64 = 1e-3;

/// A mode at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct SuddenMode {
    /// Motion of the bodies.
    pub shape: Vec<Pose>,
    /// λ = ω² (rad²/s²).
    pub lambda: f64,
    /// The largest share of the static motion at an input, or of a reading, that it begins with (1).
    pub share: f64,
}

/// An input at rest: its force on the bodies, and its static motion.
struct RestInput {
    force: Vec<Pose>,
    motion: Vec<Pose>,
}

/// The motion at rest that inputs excite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SuddenMotion {
    /// The modes with shares from a least one on, the largest first; none where the drawn state has no modes that swing.
    pub modes: Vec<SuddenMode>,
    /// The largest share of another mode up to 32 times the slowest frequency (1).
    pub left_out: f64,
}

/// The motion that inputs excite, with modes of a share of `least` or more.
pub fn sudden_motion(system: &System, inputs: &InputBox, probes: &[&Probe<'_>], least: f64) -> SuddenMotion {
    let model = &system.model;
    let rest = vec![Pose::zeros(); system.bodies()];
    let (mut tangent, mut at_rest) = (BodyMatrix::new(&model.pattern), rest.clone());
    system.tangent(&rest, &inputs.none, &mut tangent, &mut at_rest);
    let Some(forces) = forces(system, inputs, &tangent, &at_rest) else { return SuddenMotion::default() };
    let mut count = FIRST;
    loop {
        let found = modal::lowest(system, (&rest, &inputs.none), &tangent, count).ok();
        let Some(found) = found.filter(|found| found.lambda.iter().all(|lambda| *lambda > 0.0)) else {
            return SuddenMotion::default();
        };
        let shares = shares(system, &forces, probes, &found.lambda, &found.shapes);
        let excited = (0..shares.len()).filter(|&j| shares[j] >= least);
        let slowest = excited.clone().map(|j| found.lambda[j]).fold(f64::INFINITY, f64::min);
        let is_slow = |j: &usize| found.lambda[*j] * FAST <= slowest;
        let complete = found.lambda.len() < count || found.lambda.last().is_some_and(|last| last * FAST > slowest);
        if complete || count >= MOST {
            let mut taken: Vec<usize> = excited.filter(is_slow).collect();
            taken.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]));
            let others = (0..shares.len()).filter(|j| is_slow(j) && !taken.contains(j));
            let left_out = others.map(|j| shares[j]).fold(0.0, f64::max);
            let mode =
                |j: usize| SuddenMode { shape: found.shapes[j].clone(), lambda: found.lambda[j], share: shares[j] };
            return SuddenMotion { modes: taken.into_iter().map(mode).collect(), left_out };
        }
        count *= 2;
    }
}

/// Forces and static motions of the inputs; none where a motion meets no resistance.
fn forces(system: &System, inputs: &InputBox, tangent: &BodyMatrix, at_rest: &[Pose]) -> Option<Vec<RestInput>> {
    let model = &system.model;
    let mut factor = tangent.clone();
    model.project_matrix(&mut factor);
    factor.factor(&model.pattern).ok()?;
    let of = |input: usize| {
        let mut force = inputs.force(system, input, at_rest);
        model.project(&mut force);
        let mut motion = force.clone();
        factor.solve(&model.pattern, &mut motion);
        RestInput { force, motion }
    };
    Some((0..inputs.inputs.len()).map(of).collect())
}

/// The largest share of each mode.
fn shares(
    system: &System,
    inputs: &[RestInput],
    probes: &[&Probe<'_>],
    lambda: &[f64],
    shapes: &[Vec<Pose>],
) -> Vec<f64> {
    let slopes: Vec<Vec<f64>> = shapes.iter().map(|shape| readings(system, probes, shape)).collect();
    let mut largest = vec![0.0f64; lambda.len()];
    for input in inputs {
        bimorph_base::budget::check();
        let work = dot(&input.force, &input.motion);
        if work <= 0.0 {
            continue;
        }
        let pushed: Vec<f64> = shapes.iter().map(|shape| dot(shape, &input.force)).collect();
        let at_input = |j: usize| pushed[j] * pushed[j] / (lambda[j] * work);
        let ends = readings(system, probes, &input.motion);
        for j in (0..lambda.len()).filter(|&j| at_input(j) > ROUNDING) {
            largest[j] = largest[j].max(at_input(j));
            for (k, end) in ends.iter().enumerate() {
                let begun =
                    |j: usize| if at_input(j) > ROUNDING { (slopes[j][k] * pushed[j] / lambda[j]).abs() } else { 0.0 };
                // a reading that ends at zero is measured by what its modes begin with
                let whole = (0..lambda.len()).map(begun).fold(end.abs(), f64::max);
                if whole > 0.0 {
                    largest[j] = largest[j].max(begun(j) / whole);
                }
            }
        }
    }
    largest
}

/// Readings of the probes after a small motion along `shape`, over its size.
fn readings(system: &System, probes: &[&Probe<'_>], shape: &[Pose]) -> Vec<f64> {
    let length = system.length_scale;
    let size = shape.iter().map(|x| x.xy().norm().max(x.z.abs() * length)).fold(0.0, f64::max);
    if size == 0.0 {
        return vec![0.0; probes.len()];
    }
    let step = SMALL * length / size;
    let moved = |sign: f64| shape.iter().map(|x| x * (sign * step)).collect::<Vec<Pose>>();
    let (ahead, behind) = (moved(1.0), moved(-1.0));
    probes.iter().map(|probe| (probe(&ahead) - probe(&behind)) / (2.0 * step)).collect()
}
