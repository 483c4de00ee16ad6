//! Batch driver: runs of many variants with Rodas4, each with its own steps.
//!
//! A step of all lanes is taken at once, with the length from each lane's own error control; a lane that rejects its
//! step goes back alone. A finished variant leaves its lane to the next of the queue. The result of a variant is
//! therefore bit-identical to a single run ([`super::adaptive`]), with any neighbours. Failures in a lane (a singular
//! matrix, vanishing steps, a stop by the observer) are left to a single run, which finds the same and reports the
//! reason.

use super::method::Motion;
use super::pace::StepController;
use super::rodas4::lanes::{Lane, LaneRodas4};
use crate::equations::bodies::{self, contact_error, dragged};
use bimorph_base::ErrorBudget;
use bimorph_domains::{Ramp, System};
use bimorph_multibody::batch::LANES;

/// The estimated error falls with this power of the step.
const ORDER: f64 = 4.0;

/// A run of one variant.
pub struct BatchRun<'a> {
    /// The mechanism.
    pub system: &'a System,
    /// Its sources, which hold their voltages, and heat.
    pub ramp: Ramp<'a>,
    /// Where it begins.
    pub motion: Motion,
    /// First step to try (s).
    pub h: f64,
    /// Relative error that a step may make.
    pub errors: ErrorBudget,
    /// Sees each accepted step.
    pub watcher: &'a mut dyn Watcher,
}

/// Sees the accepted steps of one run.
pub trait Watcher {
    /// True where the motions before and after the step from `s` to `s` + `h` (s) are to be seen.
    fn wants(&self, s: f64, h: f64) -> bool;
    /// Receives an accepted step; returns whether to continue.
    fn observe(&mut self, s: f64, h: f64, before: &Motion, after: &Motion) -> bool;
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// At the end of the ramp, with this motion after so many steps.
    Done(Motion, u64),
    /// It differs from the first variant in more than numbers, and was not begun.
    Unlike,
    /// It has to be done alone.
    Alone,
}

/// A lane at work.
struct RunningLane<'a> {
    number: usize,
    errors: ErrorBudget,
    watcher: &'a mut dyn Watcher,
    mass: f64,
    contacts: bool,
    pace: StepController,
    steps: u64,
}

impl<'a> RunningLane<'a> {
    fn start(
        number: usize,
        system: &System,
        (pace, errors): (StepController, ErrorBudget),
        watcher: &'a mut dyn Watcher,
    ) -> Self {
        Self {
            number,
            errors,
            watcher,
            mass: system.model.bodies.iter().map(|b| b.mass).sum(),
            contacts: system.has_contacts(),
            pace,
            steps: 0,
        }
    }
}

/// Counted work of the lanes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LaneWork {
    /// Steps of all lanes at once.
    pub together: u64,
    /// Steps of single lanes that were accepted.
    pub accepted: u64,
    /// Steps of single lanes that were rejected.
    pub rejected: u64,
}

/// Advances every variant that `next` gives with its number, and calls `done` with its outcome. The lanes are laid out
/// for the mechanism of `first`; variants that differ from it in more than numbers end as [`Ended::Unlike`] at once.
pub fn advance<'a>(
    first: &System,
    next: &mut dyn FnMut() -> Option<(usize, BatchRun<'a>)>,
    done: &mut dyn FnMut(usize, Ended),
) -> LaneWork {
    let mut work = LaneWork::default();
    let Some(mut method) = LaneRodas4::new(first).filter(|_| dragged(&first.model).is_empty()) else {
        while let Some((number, _)) = next() {
            done(number, Ended::Alone);
        }
        return work;
    };
    let mut lanes: [Option<Lane<'a>>; LANES] = [const { None }; LANES];
    let mut running: [Option<RunningLane<'a>>; LANES] = [const { None }; LANES];
    let (mut s, mut step) = ([0.0; LANES], [1.0; LANES]);
    let (mut before, mut after) = (Motion::zeros(first.bodies()), Motion::zeros(first.bodies()));
    let mut error_motion = before.clone();
    loop {
        for k in 0..LANES {
            while running[k].is_none() {
                let Some((number, variant)) = next() else { break };
                if !method.fits(variant.system) {
                    done(number, Ended::Unlike);
                    continue;
                }
                method.set_lane(k, variant.system, &variant.ramp, &variant.motion);
                let pace = StepController::new((0.0, variant.ramp.dt), variant.h, ORDER);
                lanes[k] = Some(Lane { system: variant.system, ramp: variant.ramp });
                running[k] = Some(RunningLane::start(number, variant.system, (pace, variant.errors), variant.watcher));
            }
        }
        if running.iter().all(Option::is_none) {
            return work;
        }
        bimorph_base::budget::check();
        for k in 0..LANES {
            if let Some(run) = &running[k] {
                (s[k], step[k]) = (run.pace.t, run.pace.step());
            }
        }
        let vanished = method.step(&lanes, &s, &step);
        work.together += 1;
        for k in 0..LANES {
            let (Some(run), Some(lane)) = (&mut running[k], &lanes[k]) else {
                method.go_back(k);
                continue;
            };
            let (system, h) = (lane.system, step[k]);
            let wanted = run.watcher.wants(s[k], h);
            if wanted || run.contacts {
                method.before.take(k, &mut before);
                method.motion.take(k, &mut after);
            }
            let error = if vanished[k] {
                f64::INFINITY
            } else {
                let contact = if run.contacts {
                    method.error.take(k, &mut error_motion);
                    contact_error(system, (&before, &after), &error_motion, run.errors.requested())
                } else {
                    0.0
                };
                relative_error(&method, k, system, run, h, contact)
            };
            let mut ended = None;
            if error <= 1.0 {
                run.pace.accept(h, error);
                run.steps += 1;
                work.accepted += 1;
                if wanted && !run.watcher.observe(run.pace.t - h, h, &before, &after) {
                    ended = Some(Ended::Alone);
                } else if run.pace.is_over() {
                    method.motion.take(k, &mut after);
                    ended = Some(Ended::Done(after.clone(), run.steps));
                }
            } else {
                method.go_back(k);
                work.rejected += 1;
                if !run.pace.reject(h, error, 0.1) {
                    ended = Some(Ended::Alone);
                }
            }
            if let Some(ended) = ended {
                done(run.number, ended);
                (running[k], lanes[k]) = (None, None);
            }
        }
    }
}

/// The error of a step over what it may be, as [`crate::equations::bodies`] has it.
fn relative_error(method: &LaneRodas4, k: usize, system: &System, run: &RunningLane<'_>, h: f64, contact: f64) -> f64 {
    if run.mass == 0.0 {
        return 0.0;
    }
    let norms = &method.norms;
    let scale = bodies::error_scale([norms.before[k], norms.after[k]], [system.length_scale, run.mass.sqrt()]);
    bodies::relative_error([norms.error_q[k], norms.error_v[k]], h, run.errors.within(scale), contact)
}
