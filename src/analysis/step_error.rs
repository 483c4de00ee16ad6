//! How far the steps of a run in time may be off by its end.
//!
//! Control of each step bounds what a step adds, not what becomes of it: phases add up, and parts that swing far exchange
//! energy. So the run has a companion at ten times the tolerance (or in steps of twice the length), and the difference of the two
//! is measured signal by signal ([`largest_error`]). Were the error proportional to the tolerance, a ninth of the difference would be the
//! error of the finer run; found are ratios of the two errors from 1 (the single bimorph let go from 7 µm) to 12, so half of it is told, and of
//! methods of second order, whose ratios are about two, all of it.
//!
//! Where the error is beyond what the mesh leaves of the tolerance, and the run is short, it is made again at a tenth of the tolerance, with the run before as its companion: of
//! a method of order four or more that costs it less than twice the steps. What takes long is told as it comes, once, with its warning.
//!
//! A companion has a third to a half of the steps. One that would take long is given up after 3e6 unknowns times steps, and its difference
//! is continued in proportion to time, as phases go.

mod picked;

use super::after_contact::{Samples, before, first_contact, judge};
use super::chart::error::{half_range, largest_error};
use super::integrator::Integrator;
use super::transient::options::STEP_SHARE;
use super::transient::{TransientOptions, TransientResult, transient};
use super::{AnalysisError, Watch};
use crate::compile::{Compiled, Formulation};
use crate::equations::bodies::FLOOR;
use picked::{Picked, stride};

/// How much looser a companion is.
const LOOSER: f64 = 10.0;
/// Loosest tolerance of a companion.
const LOOSEST: f64 = 0.3;
/// Share of the difference that is told.
const SHARE: f64 = 0.5;
/// The same for methods of second order, and explicit ones, whose error falls little with the tolerance.
const SHARE_OF_SECOND: f64 = 1.0;
/// What is added to what proportion says, where the companion is hardly looser.
const RESERVE: f64 = 1.2;
/// Unknowns times steps of a companion, at most.
const MOST_WORK: f64 = 3e6;
/// The same of a run that is made again: some seconds.
const MOST_AGAIN: f64 = 1e7;
/// Times the steps of a run that one at a tenth of its tolerance takes, of the methods that are run again.
const MORE: f64 = 2.0;
/// How much sharper than asked for the steps of a run may be.
const MOST_SHARPER: f64 = 99.0;
/// Share of the tolerance that is left to steps in any case.
const LEAST_ROOM: f64 = 0.3;
/// Samples of a run that is run again, at most.
const MOST_KEPT: usize = 1 << 20;
/// Where the estimate of a single run is made.
const AT_THE_END: &str = "by the end of the run";
/// Output times that a companion must have reached to say something.
const FEWEST: usize = 16;
/// Times what the floor of a step's error is that a motion has to swing for a companion to tell anything.
const RESOLVED: f64 = 10.0;
/// Share of the scene below which a swing is rounding, whatever swings beside it [1].
const ROUNDING: f64 = 1e-12;
/// What swings by less than this share of the scene is rounding: a symmetric part moves so across its axis [1].
const STILL: f64 = 1e-9;

/// Makes a run: with its options, told of each sample and of its progress.
pub type Run<'r, T> = &'r mut dyn FnMut(
    &TransientOptions<'_>,
    &mut dyn FnMut(f64, &[f64]),
    Watch<'_>,
) -> Result<(TransientResult, T), AnalysisError>;

/// Makes the run that `options` ask for, with [`TransientResult::step_error`], and a warning where that is beyond the tolerance.
/// `model` is what moves; `sample` and `watch` are told of the run, not of its companion.
///
/// # Errors
/// Those of the run; a companion that fails is none, and leaves the run without the estimate.
pub fn with_step_error<T>(
    options: &TransientOptions<'_>,
    model: &Compiled,
    run: Run<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<(TransientResult, T), AnalysisError> {
    let mut samples = Samples::new(options);
    let mut both = |t: f64, values: &[f64]| {
        samples.keep(t, values);
        sample(t, values);
    };
    let (mut result, more, _) = held(options, model, run, &mut both, watch)?;
    let looser = looser(options);
    let least = |unit: &str| least(unit, options, model);
    let mut alike = |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: Watch<'_>| {
        run(options, sample, watch).map(|_| ())
    };
    judge(&samples, (options, &looser), &least, &mut alike, &mut result, watch)?;
    Ok((result, more))
}

/// The same, with the tolerance that the steps of the run followed.
fn held<T>(
    options: &TransientOptions<'_>,
    model: &Compiled,
    run: Run<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<(TransientResult, T, f64), AnalysisError> {
    let unknowns = model.unknowns() as f64;
    let (companion, whole) = companion(options, model.unknowns(), run, watch)?;
    let steps = companion.as_ref().map_or(0, |c| c.counters.steps) as f64;
    // what takes long is told as it comes, and once
    let again = whole
        && options.step.is_none()
        && is_high(Formulation::of_run(model, options).1)
        && MORE * MORE * steps * unknowns <= MOST_AGAIN
        && options.points * options.signals.len() <= MOST_KEPT;
    if !again {
        let mut made = once(options, model, (companion, whole), run, sample, watch)?;
        made.result.warnings.extend(made.result.step_error.and_then(|e| beyond(options, e, AT_THE_END)));
        return Ok((made.result, made.more, options.tol));
    }
    let mut now = options.clone();
    let mut kept = Kept::default();
    let mut made = once(&now, model, (companion, whole), run, &mut |t, values| kept.keep(t, values), watch)?;
    let room = room(options.tol, made.result.estimated_error);
    while made.result.step_error.is_some_and(|error| error > room)
        && MORE * made.result.counters.steps as f64 * unknowns <= MOST_AGAIN
        && now.tol > options.tol / MOST_SHARPER
    {
        let sharper = TransientOptions { tol: now.tol / LOOSER, ..options.clone() };
        let mut others = Kept::default();
        let companion = (Some(made.picked.clone()), true);
        match once(&sharper, model, companion, run, &mut |t, values| others.keep(t, values), watch) {
            Ok(found) if found.result.step_error.is_some() => (made, kept, now) = (found, others, sharper),
            Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
            _ => break,
        }
    }
    kept.tell(sample);
    made.result.warnings.extend(made.result.step_error.and_then(|e| beyond(options, e, AT_THE_END)));
    Ok((made.result, made.more, now.tol))
}

/// What a tolerance leaves to the steps of a run whose mesh may be off by so much.
fn room(tol: f64, mesh: Option<f64>) -> f64 {
    match mesh {
        Some(mesh) if mesh <= tol => (tol - mesh).max(LEAST_ROOM * tol),
        _ => tol,
    }
}

/// A run with its estimate, and what a sharper one is compared with.
struct Made<T> {
    result: TransientResult,
    more: T,
    picked: TransientResult,
}

/// One run, compared with its companion, which may have come to its end.
fn once<T>(
    options: &TransientOptions<'_>,
    model: &Compiled,
    (companion, whole): (Option<TransientResult>, bool),
    run: Run<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<Made<T>, AnalysisError> {
    let reached = companion.as_ref().map_or(0, |c| c.signals.first().map_or(0, |s| s.2.len()));
    let mut picked = Picked::new(options, reached);
    let mut both = |t: f64, values: &[f64]| {
        picked.see(values);
        sample(t, values);
    };
    let (mut result, more) = run(options, &mut both, watch)?;
    // what both do not resolve they have in common
    let resolved = options.step.is_some() || resolved(&picked, &result, options, model);
    let signals = picked.signals(&result.signals);
    let picked = TransientResult { signals, counters: result.counters, ..TransientResult::default() };
    // one that took the same steps proves nothing
    let other = |c: &TransientResult| c.counters.steps != result.counters.steps;
    match companion.filter(|c| (whole || reached >= FEWEST) && other(c) && resolved) {
        Some(companion) => {
            // after a contact single values are judged on their own
            let contact = first_contact(&result);
            let until = |run: &TransientResult| contact.map(|t| before(run, options, t, stride(options)));
            let (one, other) = (until(&picked), until(&companion));
            let apart = largest_error(one.as_ref().unwrap_or(&picked), other.as_ref().unwrap_or(&companion), &|unit| {
                least(unit, options, model)
            });
            let share = match options.until.is_some() || contact.is_some() {
                true => 1.0,
                false => ((reached - 1) * stride(options)) as f64 / (options.points - 1) as f64,
            };
            let (_, method) = Formulation::of_run(model, options);
            result.step_error = Some(told_of(options, method) * apart / share.min(1.0));
        }
        None => result.warnings.extend((!options.signals.is_empty()).then(|| unknown(options))),
    }
    Ok(Made { result, more, picked })
}

/// Samples that nobody was told of yet.
#[derive(Default)]
struct Kept {
    t: Vec<f64>,
    values: Vec<f64>,
}

impl Kept {
    fn keep(&mut self, t: f64, values: &[f64]) {
        crate::budget::lay_out(size_of_val(values) + size_of::<f64>());
        self.t.push(t);
        self.values.extend(values);
    }

    fn tell(&self, sample: &mut dyn FnMut(f64, &[f64])) {
        let width = (self.values.len() / self.t.len().max(1)).max(1);
        self.t.iter().zip(self.values.chunks(width)).for_each(|(t, values)| sample(*t, values));
    }
}

/// Whether the displacements of a run swing by more than what the floor of a step's error hides, in the run as in its companion; or by rounding.
fn resolved(picked: &Picked, result: &TransientResult, options: &TransientOptions<'_>, model: &Compiled) -> bool {
    let length = model.parts.system.length_scale;
    let lengths = result.signals.iter().zip(&picked.columns).filter(|((_, unit, _), _)| unit == "m");
    let most = lengths.map(|(_, column)| half_range(column)).fold(0.0, f64::max);
    most < ROUNDING * length || most > RESOLVED * STEP_SHARE * options.tol * FLOOR * length
}

/// The tolerance of a companion.
fn loose(options: &TransientOptions<'_>) -> f64 {
    (LOOSER * options.tol).min(LOOSEST)
}

/// The options of a companion.
fn looser<'a>(options: &TransientOptions<'a>) -> TransientOptions<'a> {
    TransientOptions {
        tol: loose(options),
        step: options.step.map(|step| 2.0 * step),
        events: Vec::new(),
        keep: false,
        ..options.clone()
    }
}

/// Share of the difference that is told: of a companion that is hardly looser, more than all of it, since the error is in proportion to
/// the tolerance at best.
fn told_of(options: &TransientOptions<'_>, method: Integrator) -> f64 {
    let share = if is_high(method) { SHARE } else { SHARE_OF_SECOND };
    match options.step {
        Some(_) => SHARE,
        None => share.max(RESERVE / (loose(options) / options.tol - 1.0)),
    }
}

/// Of a method whose error falls fast with the length of its steps.
fn is_high(method: Integrator) -> bool {
    matches!(method, Integrator::Rodas4 | Integrator::Radau5 | Integrator::Sdirk4)
}

/// The amplitude below which a signal of this unit stands still.
pub(super) fn least(unit: &str, options: &TransientOptions<'_>, model: &Compiled) -> f64 {
    let length = model.parts.system.length_scale;
    match unit {
        "m" => STILL * length,
        "rad" | "K" => STILL,
        "m/s" => STILL * length / options.stop,
        "rad/s" => STILL / options.stop,
        _ => 0.0,
    }
}

/// The companion of a run as far as it came, none where it failed; and whether it came to the end.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
fn companion<T>(
    options: &TransientOptions<'_>,
    unknowns: usize,
    run: Run<'_, T>,
    watch: Watch<'_>,
) -> Result<(Option<TransientResult>, bool), AnalysisError> {
    let tol = loose(options);
    let differs = options.step.is_some() || tol >= 2.0 * options.tol;
    if options.signals.is_empty() || options.points < 2 || !differs {
        return Ok((None, false));
    }
    let looser = looser(options);
    let mut picked = Picked::new(options, usize::MAX);
    let mut keep = |_: f64, values: &[f64]| picked.see(values);
    let (mut steps, mut stopped) = (0.0, false);
    let mut few = |_: f64| {
        steps += 1.0;
        stopped = !watch(0.0);
        !stopped && steps * unknowns as f64 <= MOST_WORK
    };
    let ended = run(&looser, &mut keep, &mut few);
    let counters = ended.as_ref().map_or_else(|_| Default::default(), |(result, _)| result.counters);
    if stopped {
        return Err(AnalysisError::Cancelled);
    }
    let whole = ended.is_ok();
    match ended {
        Ok(_) | Err(AnalysisError::Cancelled) => {
            let names: Vec<_> = options.signals.iter().map(|name| (name.clone(), String::new(), Vec::new())).collect();
            Ok((
                Some(TransientResult { signals: picked.signals(&names), counters, ..TransientResult::default() }),
                whole,
            ))
        }
        Err(_) => Ok((None, false)),
    }
}

/// The estimate alone, for one of several runs that are alike, at `points` output times; and the tolerance that their steps have to follow
/// for it. None where nothing was compared.
pub(crate) fn step_error(options: &TransientOptions<'_>, model: &Compiled, watch: Watch<'_>) -> (Option<f64>, f64) {
    let mut run = |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: Watch<'_>| {
        Ok((transient(model, options, sample, watch)?, ()))
    };
    let found = held(options, model, &mut run, &mut |_, _| (), watch);
    found.map_or((None, options.tol), |(result, (), tol)| (result.step_error, tol))
}

/// What to say of steps that nothing was compared with.
pub(crate) fn unknown(options: &TransientOptions<'_>) -> String {
    format!("nothing tells how far the steps in time are off: the tolerance {:e} is not confirmed", options.tol)
}

/// What to say of steps whose estimate is beyond the tolerance; `place` says where it was made.
pub(crate) fn beyond(options: &TransientOptions<'_>, error: f64, place: &str) -> Option<String> {
    if error <= options.tol {
        return None;
    }
    let way = if options.step.is_some() { "take a shorter --step" } else { "take a smaller --tol" };
    Some(format!(
        "the steps in time may be off by {error:.1e} of the amplitude {place}, more than the tolerance {:e}; {way}",
        options.tol
    ))
}
