//! The mesh for a transient: the modes that it excites, each with the accuracy that the length of the run requires.
//!
//! A run starts at the distance d = K⁻¹·r from its equilibrium, with r the unbalanced forces at its start: those of a
//! released load, or of a step of the voltages. The part of d along mode i oscillates with the amplitude A_i, relative
//! to the largest displacement or to the amplitude of a requested signal, whichever gives more. The error δ_i of its
//! frequency shifts its phase by ω_i·δ_i·T by the end of the run. With the damping γ = xᵀCx, the time is at most 2/γ,
//! in which the mode decays:
//! ```text
//! rms error of the run over its amplitude ≈ A_i·δ_i·ω_i·min(T, 2/γ)/√3
//! ```
//! Each mode is asked to keep that below the tolerance. Modes are added until the remainder of d is negligible. A
//! heater acts with its time constant τ: a mode oscillates with 1/√(1 + (ωτ)²) of its effect, and the rest follows
//! slowly.

use super::super::loose_parts;
use super::super::modes::modes;
use super::super::rotary_inertia_error;
use super::super::statics::{OperatingPoint, operating_point};
use super::super::transient::TransientOptions;
use super::super::transient::record::at_anchors;
use super::super::{AnalysisError, PortVoltages};
use super::driven::{SuddenAnchorMotion, add_driven, factored};
use super::equilibrium;
use super::remeshed::{chosen, meshed};
use super::signal_amplitudes::{SignalAmplitudes, reach};
use super::warnings::{of_rotary, of_steps};
use bimorph_base::Diagnostic;
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, Shock};
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::options::CompileOptions;
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::lowest_modes;
use bimorph_model::refine::mesh_search::{self, Mesh, MeshTarget};
use bimorph_multibody::forces::add_damping;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Model};
use bimorph_solve::eigen::lowest_modes;
use std::f64::consts::TAU;

/// Modes computed first, and at most.
const FIRST_MODES: usize = 6;
const MAX_MODES: usize = 48;
/// Band of a mesh, of the highest frequency that it must resolve.
const BAND: f64 = 1.01;
/// Factor by which a band is widened where modes of the drawing lie above it, and how often at most: to four times.
const WIDER: f64 = 1.1;
const MAX_WIDER: usize = 15;
/// Error assigned to a waveform unrelated to the reference.
const UNRELATED_ERROR: f64 = 0.3;

/// A mode that a run excites.
struct ExcitedMode {
    frequency: f64,
    amplitude: f64,
    decay: f64,
    /// Relative excess of its frequency without rotary inertia (1).
    rotary: f64,
}

/// The mesh for a run with its estimated modal error, and an upper bound of the error of the motion outside the modes.
pub(super) fn order(moving: &CompiledModel, options: &TransientOptions<'_>) -> Result<(Mesh, f64), AnalysisError> {
    if moving.structure.beams.is_empty() {
        return Ok((Mesh { estimated_error: Some(0.0), ..moving.order.clone() }, 0.0));
    }
    let given = chosen(moving) || moving.options.band.is_some();
    let voltages = &options.voltages;
    let start = options.release.unwrap_or(moving);
    if start.order.segments.len() != moving.order.segments.len() {
        return Ok((moving.order.clone(), 0.0)); // another drawing: the run itself says so
    }
    let at = |model: &CompiledModel, segments: Vec<usize>| match given {
        true => equilibrium::estimated(model, voltages, segments).map(|(order, _)| order),
        false => equilibrium::order(model, voltages, segments).map(|(order, _)| order),
    };
    let mut still = match at(start, moving.order.segments.clone()) {
        // a run of a mechanism or of a loose part needs no equilibrium
        Err(AnalysisError::Singular { .. }) if options.release.is_none() => moving.order.clone(),
        still => still?,
    };
    if options.release.is_some() {
        // where the run goes to may have no equilibrium at all
        if let Ok(end) = at(moving, still.segments.clone()) {
            still = merged(&still, &end);
        }
    }
    let errors = moving.options.errors();
    let mut count = FIRST_MODES;
    loop {
        let mesh = match given {
            true => still.clone(),
            false => {
                let counted = lowest_modes::choose(&moving.structure, &moving.options, count).map_err(refused)?;
                merged(&still, &counted)
            }
        };
        let (mut modes, mut left) = excited(moving, options, &mesh.segments, (count, true))?;
        if left > errors.negligible_amplitude() && modes.len() >= count && count < MAX_MODES {
            count = (2 * count).min(MAX_MODES);
            continue;
        }
        if left > errors.requested() && !options.motions.is_empty() {
            // no mesh resolves the jumps: that for the slow motion, with what they add to it
            let (slow, rest) = excited(moving, options, &mesh.segments, (count, false))?;
            let added =
                modes.iter().zip(&slow).map(|(all, slow)| (all.amplitude - slow.amplitude).powi(2)).sum::<f64>();
            left = rest + (left - rest).hypot(added.sqrt());
            modes = slow;
        }
        // the motion outside the modes may have an error of its whole amplitude
        let left = if left > errors.negligible_amplitude() { 2f64.sqrt() * left } else { 0.0 };
        // no mesh holds the tolerance where these do not
        let beside = left.max(turned(&modes, options.stop));
        let looser = if given { 1.0 } else { errors.beside(beside) };
        let relaxed = errors.scaled(looser);
        let Some(highest) = modes.iter().rposition(|m| m.amplitude > relaxed.negligible_amplitude()) else {
            return Ok((still, left));
        };
        let of_modes = modes[..=highest].iter();
        let tolerances: Vec<f64> = of_modes.map(|m| relaxed.frequency(weight(m, options.stop))).collect();
        let mut analyse = |segments: &[usize]| frequencies(moving, voltages, segments, &tolerances);
        if given {
            let swings: Vec<f64> = modes[..=highest].iter().map(|m| 2f64.sqrt() * m.amplitude).collect();
            let estimated_error = mesh_estimate(&moving.options, &still.segments, &swings, &mut analyse);
            return Ok((merged(&still, &Mesh { estimated_error, ..still.clone() }), left));
        }
        // measured frequency errors exceeded their estimates: the modes get a part of the tolerance, and the estimate
        // is reported
        let sharper = tolerances.iter().map(|t| ErrorBudget::of(*t).frequency_estimate()).collect();
        let aim = MeshTarget { band: BAND * modes[highest].frequency, tolerances: sharper, rigid: false };
        let order = with_every_mode(moving, aim)?;
        let order = order.with_estimate_times(ErrorBudget::of_modes_estimate(looser));
        let mesh = merged(&still, &order);
        if order.estimated_error.is_some() {
            return Ok((mesh, left));
        }
        let fitted = doubling::fit(&moving.structure, &moving.options, mesh.segments.clone(), &mut analyse);
        return Ok((fitted.map_or(mesh, |fitted| merged(&still, &fitted.with_estimate_times(looser))), left));
    }
}

/// The mesh for a band of the drawing in which every mode with a tolerance lies: what softens a mode where the run goes to lowers its frequency there alone.
fn with_every_mode(moving: &CompiledModel, mut aim: MeshTarget) -> Result<Mesh, AnalysisError> {
    let choose = |aim: &MeshTarget| mesh_search::choose_for(&moving.structure, &moving.options, aim).map_err(refused);
    let mut order = choose(&aim)?;
    for _ in 0..MAX_WIDER {
        if order.modes_in_band >= aim.tolerances.len() || order.estimated_error.is_none() {
            break;
        }
        aim.band *= WIDER;
        order = choose(&aim)?;
    }
    Ok(order)
}

/// Warnings about a run on its mesh: equal steps longer than its motion allows, and missing rotary inertia.
pub(super) fn motion_warnings(moving: &CompiledModel, options: &TransientOptions<'_>) -> Vec<Diagnostic> {
    let Ok((modes, _)) = excited(moving, options, &moving.order.segments, (FIRST_MODES, true)) else {
        return Vec::new();
    };
    let missed = options.step.and_then(|step| Some(of_steps(step, outrun(moving, step, &modes)?)));
    missed.into_iter().chain(of_rotary(moving, phase_error(&modes, options.stop))).collect()
}

/// Error of a run without rotary inertia, relative to its amplitude.
fn phase_error(modes: &[ExcitedMode], stop: f64) -> f64 {
    let late = |mode: &ExcitedMode| {
        let lasts = stop.min(2.0 / mode.decay.max(f64::MIN_POSITIVE));
        // a wave of unknown phase has an error of its amplitude
        mode.amplitude * (mode.rotary * TAU * mode.frequency * lasts / 3f64.sqrt()).min(2f64.sqrt())
    };
    modes.iter().map(late).fold(0.0, f64::max)
}

/// The same where it makes another waveform of the run.
fn turned(modes: &[ExcitedMode], stop: f64) -> f64 {
    let late = phase_error(modes, stop);
    if late > UNRELATED_ERROR { late } else { 0.0 }
}

/// The mode that a run in equal steps begins with and cannot follow: its frequency (Hz) and its share of the way. A step longer than a
/// radian of it damps it away or slows it, in a companion of twice the step as well.
fn outrun(moving: &CompiledModel, step: f64, modes: &[ExcitedMode]) -> Option<(f64, f64)> {
    let swings = |mode: &&ExcitedMode| {
        mode.decay < 2.0 * TAU * mode.frequency && mode.amplitude > moving.options.errors().requested()
    };
    let too_fast = |mode: &&ExcitedMode| TAU * mode.frequency * step > 1.0;
    let most = modes.iter().filter(swings).filter(too_fast).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))?;
    Some((most.frequency, most.amplitude))
}

/// The estimate of a mesh as it is: a mode that has lost its phase is wrong by what it swings, and by no more.
fn mesh_estimate(
    options: &CompileOptions,
    segments: &[usize],
    swings: &[f64],
    analyse: doubling::Analyse<'_, AnalysisError>,
) -> Option<f64> {
    let errors = doubling::errors(options, segments, analyse).ok()??;
    Some(errors.iter().zip(swings).map(|(e, swing)| e.abs().min(*swing)).fold(0.0, f64::max))
}

/// Frequencies about where the run goes to, with errors relative to what each may have.
fn frequencies(
    moving: &CompiledModel,
    voltages: &PortVoltages,
    segments: &[usize],
    tolerances: &[f64],
) -> Result<Vec<Output>, AnalysisError> {
    let model = meshed(moving, segments)?;
    let found = modes(&model, tolerances.len(), voltages)?.frequencies_hz;
    let scale = |f: f64, own: f64| moving.options.errors().scale(f, own).max(f64::MIN_POSITIVE);
    let mut outputs: Vec<Output> =
        found.iter().zip(tolerances).map(|(&f, &tolerance)| Output { value: f, scale: scale(f, tolerance) }).collect();
    outputs.resize(tolerances.len(), Output { value: f64::NAN, scale: 1.0 });
    Ok(outputs)
}

fn refused(error: DiscretizeError) -> AnalysisError {
    AnalysisError::NotConverged { detail: error.to_string() }
}

/// Error of a run over that of the frequency of a mode, both relative.
fn weight(mode: &ExcitedMode, stop: f64) -> f64 {
    let lasts = stop.min(2.0 / mode.decay.max(f64::MIN_POSITIVE));
    mode.amplitude * (TAU * mode.frequency * lasts / 3f64.sqrt()).max(1.0)
}

/// The finer of two meshes for every beam, and the larger of their errors.
fn merged(a: &Mesh, b: &Mesh) -> Mesh {
    Mesh {
        segments: a.segments.iter().zip(&b.segments).map(|(a, b)| *a.max(b)).collect(),
        estimated_error: a.estimated_error.zip(b.estimated_error).map(|(a, b)| a.max(b)),
        modes_in_band: b.modes_in_band,
        passes: a.passes + b.passes,
    }
}

/// The lowest modes about where the run goes to, so many and with jumps of rates or without, with their amplitudes; and the share of the way there that is
/// in none of them.
fn excited(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    segments: &[usize],
    (count, jumps): (usize, bool),
) -> Result<(Vec<ExcitedMode>, f64), AnalysisError> {
    let model = meshed(moving, segments)?;
    let system = &model.parts.system;
    let rest = OperatingPoint::rest(&model, &options.voltages)?;
    let from = match options.release {
        Some(start) => {
            let held = meshed(start, segments)?;
            operating_point(&held, &options.voltages)?
        }
        None => match at_anchors(&model, options)? {
            Some(q) if !system.anchors.is_empty() => OperatingPoint { q, ..rest.clone() },
            _ => rest.clone(),
        },
    };
    // without an equilibrium to go to the way is that from rest
    let to = operating_point(&model, &options.voltages).unwrap_or(rest);
    let mut drive = system.electrics.drive();
    system.electrics.apply(&to.sources, &to.rise, &mut drive);
    let mut stiffness = BodyMatrix::new(&system.model.pattern);
    let mut residual = to.q.clone();
    system.tangent(&to.q, &drive, &mut stiffness, &mut residual);
    system.add_stress_stiffness(&to.q, &drive, &mut stiffness);
    let found = lowest_modes(system, (&to.q, &drive), &stiffness, count)?;

    let mut way = pushed(&model, &from, options.shock.as_ref(), &drive, &stiffness)
        .unwrap_or_else(|| from.q.iter().zip(&to.q).map(|(a, b)| a - b).collect());
    let factor = factored(&model, options, &stiffness);
    if let Some(factor) = &factor {
        add_driven(&model, options, factor, &mut way);
    }
    let of_run = |factor: &BodyMatrix| SuddenAnchorMotion::of_run(&model, options, factor);
    let mut sudden = factor.as_ref().filter(|_| jumps).map_or_else(Vec::new, of_run);
    let size = reach(&model, &way);
    if size == 0.0 {
        return Ok((Vec::new(), 0.0));
    }
    let slow = shortest_heat(&model, &from, &to);
    // the way that slow heat takes it within the run
    let size = if slow > 0.0 { size * -(-options.stop / slow).exp_m1() } else { size };
    let seen = SignalAmplitudes::new(&model, options, &to);
    // what each signal sees of the way, of every mode on it, and of what is in none of them
    let mut swings = vec![seen.of(&way, 0.0)];
    let lags = |omega: f64| (1.0 + (omega * slow).powi(2)).sqrt();
    let mut modes: Vec<ExcitedMode> = (found.shapes.iter().zip(&found.lambda))
        .map(|(x, lambda)| {
            let omega = lambda.max(0.0).sqrt();
            let share = system.model.mass_product(x, &way);
            for (way, x) in way.iter_mut().zip(x) {
                *way -= x * share;
            }
            let jumps: f64 = sudden.iter_mut().map(|motion| motion.take_mode(&model, x, omega)).sum();
            let amplitude = share.abs() / lags(omega) + jumps;
            swings.push(seen.of(x, omega).iter().map(|swing| swing * amplitude).collect());
            ExcitedMode {
                frequency: omega / TAU,
                amplitude: (reach(&model, x) * amplitude / size).min(1.0),
                decay: damping(&system.model, x),
                rotary: rotary_inertia_error::too_high(&model, x),
            }
        })
        .collect();
    let last = found.lambda.last().map_or(0.0, |l| l.max(0.0).sqrt());
    let sizes = seen.sizes(&swings, options);
    let largest = |swing: &[f64]| swing.iter().zip(&sizes).map(|(swing, size)| swing / size).fold(0.0, f64::max);
    for (mode, swing) in modes.iter_mut().zip(&swings[1..]) {
        mode.amplitude = mode.amplitude.max(largest(swing)).min(1.0);
    }
    // what is in none of the modes
    let of_rest = |rest: &[Pose], slower: f64| {
        let swings: Vec<f64> = seen.of(rest, last).iter().map(|swing| swing / slower).collect();
        (reach(&model, rest) / size / slower).max(largest(&swings))
    };
    let of_jumps: f64 = sudden.iter().map(|motion| of_rest(&motion.beyond(last), 1.0)).sum();
    Ok((modes, of_rest(&way, lags(last)) + of_jumps))
}

/// K⁻¹·r with the unbalanced forces r at the start of the run, under its further drive; `None` for a floating part. For
/// small motions this is the way to where the run goes to; for large ones the shortening of what bends is no stretch in
/// it.
///
/// A shock counts as a step of its largest acceleration, which brings at least as much motion.
fn pushed(
    model: &CompiledModel,
    from: &OperatingPoint,
    shock: Option<&Shock>,
    drive: &Drive,
    stiffness: &BodyMatrix,
) -> Option<Vec<Pose>> {
    let system = &model.parts.system;
    let mut x = vec![Pose::zeros(); system.bodies()];
    system.residual(&from.q, drive, &mut x);
    if let Some(Shock { peak: [x_peak, y_peak], .. }) = shock {
        for (x, body) in x.iter_mut().zip(&system.model.bodies) {
            *x += Pose::new(body.mass * x_peak, body.mass * y_peak, 0.0);
        }
        system.model.project(&mut x);
    }
    let mut factor = stiffness.clone();
    system.model.project_matrix(&mut factor);
    if system.model.loose_parts().is_empty() {
        factor.factor(&system.model.pattern).ok()?;
    } else {
        // a part that floats bends under the forces that are left beside those of its free motion
        loose_parts::relieve(&system.model, &mut x);
        system.model.factor_holding(&mut factor, &mut Vec::new()).ok()?;
    }
    factor.solve(&system.model.pattern, &mut x);
    system.model.project(&mut x);
    x.iter().all(|x| x.iter().all(|v| v.is_finite())).then_some(x)
}

/// The way from one state to another, if the stiffness all along were that at its end; none for a part that floats.
pub(super) fn linear_way(model: &CompiledModel, from: &OperatingPoint, to: &OperatingPoint) -> Option<Vec<Pose>> {
    let system = &model.parts.system;
    let mut drive = system.electrics.drive();
    system.electrics.apply(&to.sources, &to.rise, &mut drive);
    let mut stiffness = BodyMatrix::new(&system.model.pattern);
    let mut residual = to.q.clone();
    system.tangent(&to.q, &drive, &mut stiffness, &mut residual);
    pushed(model, from, None, &drive, &stiffness)
}

/// xᵀCx of a mode with xᵀMx = 1 (1/s).
fn damping(model: &Model, x: &[Pose]) -> f64 {
    let mut force = vec![Pose::zeros(); x.len()];
    add_damping(model, x, &mut force);
    force.iter().zip(x).map(|(f, x)| f.dot(x)).sum()
}

/// The shortest time constant of the heat that the run begins with (s); 0 where heat moves nothing.
fn shortest_heat(model: &CompiledModel, from: &OperatingPoint, to: &OperatingPoint) -> f64 {
    let heaters = &model.parts.system.electrics.heating.heaters;
    let moves = |k: &usize| from.rise[*k] != to.rise[*k];
    let loads = !model.parts.system.loads.is_empty() || to.volts.iter().any(|v| *v != 0.0);
    let shortest = (0..heaters.len()).filter(moves).map(|k| heaters[k].time_constant).fold(f64::INFINITY, f64::min);
    // what pushes or pulls beside it begins at once
    if loads || shortest.is_infinite() { 0.0 } else { shortest }
}
