//! The time of one step of Rodas4 with a solver: one evaluation of the tangent, one factorization, six solves.
//!
//! The step matrix is the same for every solver; what differs is what solves with it. A few steps of a fixed length are made
//! from the beginning of the motion, and the time is the median over the repeats.

use super::runs::{RunSeries, median};
use super::spec::{ChartPart, ChartPoint, Formulation, RunMeasurement};
use super::variant::ChartVariant;
use crate::AnalysisError;
use crate::integrator::Integrator;
use crate::statics::{operating_point, source_vector};
use bimorph_domains::Ramp;
use bimorph_solve::baseline::{Solver, SolverKind};
use bimorph_solve::equations::Bodies;
use bimorph_solve::method::{Method, Motion};
use bimorph_solve::rodas4::Rodas4;
use std::time::Instant;

/// A repeat makes as many steps as fit into this many multiplications, at least one and at most [`MAX_STEPS`].
const MULTIPLICATIONS: u64 = 20_000_000;
const MAX_STEPS: u64 = 20;
/// Length of a step, as a fraction of the run.
const STEP_FRACTION: f64 = 1e-3;
/// A step with more multiplications than this is left out: it would take seconds.
const MAX_MULTIPLICATIONS: u64 = 5_000_000_000;

/// Measures steps of a model with a solver.
///
/// # Errors
/// Those of the request; what a solver refuses becomes a point that says so.
pub(super) fn measure(
    model: &ChartVariant,
    request: &RunSeries<'_>,
    kind: SolverKind,
) -> Result<ChartPoint, AnalysisError> {
    let compiled = model.moving();
    let system = &compiled.parts.system;
    let pattern = &system.model.pattern;
    let mut point = ChartPoint {
        part: ChartPart::Solvers,
        formulation: Formulation::Compliant,
        method: Integrator::Rodas4.name(),
        solver: kind.name(),
        tol: compiled.options.errors().requested(),
        band_hz: compiled.options.band,
        unknowns: system.model.unknowns(),
        measured: None,
        failed: None,
    };
    let solver = match Solver::new(kind, pattern) {
        Ok(solver) => solver,
        Err(error) => {
            point.failed = Some(error.to_string());
            return Ok(point);
        }
    };
    let (factor, solve) = solver.multiplications(pattern);
    let multiplications = factor + 6 * solve;
    if multiplications > MAX_MULTIPLICATIONS {
        point.failed = Some(format!("left out: a step takes {:.1e} multiplications", multiplications as f64));
        return Ok(point);
    }
    let electrics = &system.electrics;
    let sources = source_vector(compiled, &request.spec.voltages)?;
    let mut start = Motion::zeros(system.bodies());
    let mut rise = vec![0.0; electrics.heating.states()];
    if let Some(held) = model.held() {
        let begin = operating_point(held, &request.spec.voltages)?;
        start.q.copy_from_slice(&begin.q);
        rise.copy_from_slice(&begin.rise);
    }
    let ramp = Ramp::new(electrics, &sources, &sources, &rise, request.stop);
    let h = STEP_FRACTION * request.stop;
    let steps = (MULTIPLICATIONS / multiplications.max(1)).clamp(1, MAX_STEPS) as usize;
    let mut bodies = Bodies::new(system, &ramp);
    let mut method = Rodas4::with_solver(solver, system, &[]);
    let mut error = Motion::zeros(system.bodies());
    let mut seconds = Vec::with_capacity(request.spec.repeat);
    // the first round warms caches and is not counted
    for round in 0..=request.spec.repeat {
        let mut motion = start.clone();
        let begun = Instant::now();
        for k in 0..steps {
            if method.step(&mut bodies, k as f64 * h, h, &mut motion, &mut error).is_err() {
                point.failed = Some("the step matrix cannot be factored".into());
                return Ok(point);
            }
        }
        if round > 0 {
            seconds.push(begun.elapsed().as_secs_f64() / steps as f64);
        }
    }
    point.measured = Some(RunMeasurement {
        error: None,
        told: None,
        seconds: median(&mut seconds),
        steps: 1,
        rejected: 0,
        factorizations: 1,
        solves: 6,
        forces: 6,
        multiplications: Some(multiplications),
    });
    Ok(point)
}
