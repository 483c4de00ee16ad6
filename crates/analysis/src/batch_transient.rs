//! Final states of transients for many variants of one mechanism: in lanes where possible, one by one elsewhere, with
//! bit-identical results.
//!
//! A variant has a lane where Rodas4 integrates it in the bodies' own coordinates from rest, and it differs from the others
//! in numbers alone. Errors come from a run alone, which says why.

use super::AnalysisError;
use super::contact_range::within_contact_range;
use super::formulation::{self, Formulation};
use super::stability::StabilityMonitor;
use super::statics::source_vector;
use super::transient::first_step::first_step;
use super::transient::options::{TransientOptions, check};
use super::transient::record::STABILITY_CHECKS;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use crate::readout::signal::SignalView;
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, Ramp};
use bimorph_model::compile::CompiledModel;
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::dense::interpolate;
use bimorph_solve::time::batch::{self, BatchRun, Ended, LaneWork, Watcher};
use bimorph_solve::time::method::Motion;

use super::integrator::Integrator;

/// Final state of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEnd {
    /// Final value of each signal, in the requested order.
    pub values: Vec<f64>,
    /// Accepted steps.
    pub steps: u64,
    /// Warnings about the result.
    pub warnings: Vec<String>,
}

/// Runs the variants that lanes can have in lanes, and gives what each ends with; none for one that has to be run
/// alone. `finished` is called after each variant and returns whether to continue; the remaining ones are `None`
/// otherwise.
///
/// # Errors
/// [`AnalysisError::BadRequest`] for options that mean nothing.
pub fn ends(
    variants: &[&CompiledModel],
    options: &TransientOptions<'_>,
    finished: &mut dyn FnMut() -> bool,
) -> Result<(Vec<Option<RunEnd>>, LaneWork), AnalysisError> {
    check(options)?;
    let mut ends: Vec<Option<RunEnd>> = vec![None; variants.len()];
    let mut work = LaneWork::default();
    let controlled = options.step.is_none() && options.release.is_none() && options.events.is_empty();
    if !controlled || options.method != Integrator::Rodas4 || options.solver != SolverKind::Recursion {
        return Ok((ends, work));
    }
    let set: Vec<Option<Setup>> = variants.iter().map(|compiled| Setup::new(compiled, options)).collect();
    let mut left: Vec<usize> = (0..variants.len()).filter(|&k| set[k].is_some()).collect();
    let mut goes_on = true;
    // each round has the variants that differ from its first one in numbers alone
    while left.len() > 1 && goes_on {
        let mut watchers: Vec<Option<RunFinisher<'_>>> =
            (0..variants.len()).map(|k| Some(RunFinisher::new(variants[k], set[k].as_ref()?, options))).collect();
        let mut others = Vec::new();
        let mut steps: Vec<Option<u64>> = vec![None; variants.len()];
        {
            let mut queue = left.iter().copied();
            let mut slots: Vec<Option<&mut RunFinisher<'_>>> = watchers.iter_mut().map(Option::as_mut).collect();
            let stop = std::cell::Cell::new(false);
            let mut next = || {
                loop {
                    let number = queue.next().filter(|_| !stop.get())?;
                    let (Some(setup), Some(watcher)) = (&set[number], slots[number].take()) else { continue };
                    let system = &variants[number].parts.system;
                    let motion = Motion::zeros(system.bodies());
                    let (h, errors) = (first_step(system, options.stop), ErrorBudget::of(options.errors().step()));
                    let ramp = setup.ramp(variants[number], options.stop);
                    return Some((number, BatchRun { system, ramp, motion, h, errors, watcher }));
                }
            };
            let mut done = |number: usize, ended: Ended| match ended {
                Ended::Done(_, count) => {
                    steps[number] = Some(count);
                    if !finished() {
                        stop.set(true);
                    }
                }
                Ended::Unlike => others.push(number),
                Ended::Alone => {}
            };
            let first = &variants[left[0]].parts.system;
            let round = batch::advance(first, &mut next, &mut done);
            work.together += round.together;
            work.accepted += round.accepted;
            work.rejected += round.rejected;
            goes_on = !stop.get();
        }
        for (k, (watcher, steps)) in watchers.into_iter().zip(steps).enumerate() {
            if let (Some(watcher), Some(steps)) = (watcher, steps) {
                let warnings = watcher.stability.warning().into_iter().collect();
                ends[k] = Some(RunEnd { values: watcher.values, steps, warnings });
            }
        }
        left = others;
    }
    Ok((ends, work))
}

/// Setup of a run of one variant.
struct Setup {
    signals: Vec<Expression<RunSignal>>,
    sources: Vec<f64>,
    rise: Vec<f64>,
}

impl Setup {
    /// None where a run alone has to say what is wrong, or where there are no lanes.
    fn new(compiled: &CompiledModel, options: &TransientOptions<'_>) -> Option<Self> {
        // lanes are of the bodies' own coordinates
        if compiled.joints.is_some() || formulation::of_run(compiled, options).0.formulation != Formulation::Compliant {
            return None;
        }
        let sources = source_vector(compiled, &options.voltages).ok()?;
        let find = |name: &String| Expression::of_run(compiled, name, &sources);
        let signals = options.signals.iter().map(find).collect::<Result<_, _>>().ok()?;
        let rise = vec![0.0; compiled.parts.system.electrics.heating.states()];
        Some(Self { signals, sources, rise })
    }

    fn ramp<'a>(&'a self, compiled: &'a CompiledModel, stop: f64) -> Ramp<'a> {
        let electrics = &compiled.parts.system.electrics;
        Ramp::new(electrics, &self.sources, &self.sources, &self.rise, stop)
    }
}

/// Checks the end of a run, its stability during the motion, and the range of the law of contact.
struct RunFinisher<'a> {
    compiled: &'a CompiledModel,
    setup: &'a Setup,
    ramp: Ramp<'a>,
    stop: f64,
    contacts: bool,
    looks: usize,
    stability: StabilityMonitor,
    drive: Drive,
    values: Vec<f64>,
}

impl<'a> RunFinisher<'a> {
    fn new(compiled: &'a CompiledModel, setup: &'a Setup, options: &TransientOptions<'_>) -> Self {
        let system = &compiled.parts.system;
        let ramp = setup.ramp(compiled, options.stop);
        let mut drive = system.electrics.drive();
        ramp.at(0.0, &mut drive);
        Self {
            compiled,
            setup,
            ramp,
            stop: options.stop,
            contacts: system.has_contacts(),
            looks: 0,
            stability: StabilityMonitor::new(system),
            drive,
            values: Vec::new(),
        }
    }

    /// Number of stability checks due at the end of a step.
    fn due(&self, s: f64, h: f64) -> usize {
        ((s + h) / self.stop * STABILITY_CHECKS as f64 * (1.0 + 1e-12)) as usize
    }

    fn ends(&self, s: f64, h: f64) -> bool {
        self.stop <= (s + h) * (1.0 + 1e-12)
    }
}

impl Watcher for RunFinisher<'_> {
    fn wants(&self, s: f64, h: f64) -> bool {
        self.contacts || self.due(s, h) > self.looks || self.ends(s, h)
    }

    fn observe(&mut self, s: f64, h: f64, before: &Motion, after: &Motion) -> bool {
        let charged = |gap| self.compiled.parts.system.electrics.is_charged(gap, &self.drive.volts);
        if self.contacts && within_contact_range(self.compiled, &after.q, charged).is_err() {
            return false;
        }
        if self.ends(s, h) && self.values.is_empty() {
            let mut now = before.clone();
            interpolate(before, after, h, ((self.stop - s) / h).min(1.0), &mut now);
            let rise: Vec<f64> = (0..self.setup.rise.len()).map(|k| self.ramp.rise_at(k, self.stop)).collect();
            let volts = self.drive.volts.clone();
            let view = SignalView { q: &now.q, v: &now.v, rise: &rise, volts: &volts };
            self.values = self.setup.signals.iter().map(|signal| signal.value(self.compiled, &view)).collect();
        }
        let due = self.due(s, h);
        if due > self.looks {
            self.looks = due;
            self.ramp.at(s + h, &mut self.drive);
            self.stability.check(&self.compiled.parts.system, &self.drive, s + h, (&after.q, &after.v));
        }
        true
    }
}
