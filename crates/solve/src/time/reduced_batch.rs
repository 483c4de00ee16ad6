//! Batch driver of a reduced model: runs under different sources, each with its own steps.
//!
//! As [`batch`](super::batch) for bodies: a step of all lanes is taken at once, with the length from each lane's own error control, and a finished run
//! leaves its lane to the next one. The course of a run is that of [`adaptive`](super::adaptive), bit by bit, with any neighbours. Where a step has no
//! matrix, steps vanish, polynomials are left or the observer stops, the run is left to that driver, from its start.

use super::adaptive::Observer;
use super::batch::LaneWork;
use super::method::{Method, Motion, SolverCounters};
use super::pace::StepController;
use super::reduced_rodas4::ReducedRodas4;
use super::reduced_rodas4::lanes::LaneReducedRodas4;
use crate::equations::{Bodies, Equations};
use bimorph_domains::{Ramp, System};
use bimorph_multibody::batch::LANES;

/// The estimated error falls with this power of the step.
const ORDER: f64 = 4.0;
/// Share of a step to try after one without an error.
const LOST: f64 = 0.1;

/// A run from its start.
pub struct ReducedRun<'a> {
    /// The mechanism.
    pub system: &'a System,
    /// Its sources, which hold their voltages, and heat.
    pub ramp: &'a Ramp<'a>,
    /// Where it begins.
    pub motion: Motion,
    /// First step to try (s).
    pub h: f64,
    /// Relative error that a step may make.
    pub tol: f64,
    /// Its method.
    pub method: ReducedRodas4,
    /// Sees each accepted step.
    pub observe: Observer<'a>,
}

/// The end of a run in a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReducedEnd {
    /// Its work, as that of a run alone.
    pub work: SolverCounters,
    /// See [`ReducedRodas4::error`].
    pub error: Option<f64>,
    /// See [`ReducedRodas4::excess`].
    pub excess: f64,
}

/// A lane at work.
struct ReducedLane<'a> {
    number: usize,
    run: ReducedRun<'a>,
    bodies: Bodies<'a>,
    pace: StepController,
    before: Motion,
    error: Motion,
    /// Norm of the displacements now, where errors are measured by masses alone.
    reach: Option<f64>,
    /// State of the method at the start of the step.
    carried: Vec<Motion>,
    steps: u64,
    rejected: u64,
}

/// Course of a lane after a step.
enum AfterStep {
    GoesOn,
    Done,
    Alone,
}

impl<'a> ReducedLane<'a> {
    /// None where the run has no start, or leaves its polynomials there.
    fn start(number: usize, mut run: ReducedRun<'a>) -> Option<Self> {
        let mut bodies = Bodies::new(run.system, run.ramp);
        run.method.start(&mut bodies, &run.motion).ok()?;
        let pace = StepController::new((0.0, bodies.end()), run.h, ORDER);
        let (before, error) = (run.motion.clone(), Motion::zeros(run.motion.q.len()));
        let carried = run.method.carried().to_vec();
        let reach = bodies.reach(&run.motion.q);
        Some(Self { number, run, bodies, pace, before, error, reach, carried, steps: 0, rejected: 0 })
    }

    /// Judges the step of length `h` (s) that `lanes` have taken in this lane.
    fn judge(&mut self, lanes: &mut LaneReducedRodas4, lane: usize, h: f64) -> AfterStep {
        let Self { run, bodies, pace, before, error, reach, carried, .. } = self;
        let ReducedRun { motion, method, tol, observe, .. } = run;
        before.copy(motion);
        for (keep, now) in carried.iter_mut().zip(method.carried().iter()) {
            keep.copy(now);
        }
        lanes.give(lane, method, motion);
        let touches = |at: &Motion| bodies.system.contact_energy(&at.q) != 0.0;
        let plain = reach.zip(bodies.reach(&motion.q)).filter(|_| !touches(before) && !touches(motion));
        let share = match plain {
            Some((first, last)) => bodies.share_of_norms([first, last], lanes.error_norms(lane), h, *tol),
            None => {
                method.fill_error(error);
                bodies.share([&*before, &*motion], error, h, *tol)
            }
        };
        if share > 1.0 {
            motion.copy(before);
            for (keep, now) in carried.iter().zip(method.carried().iter_mut()) {
                now.copy(keep);
            }
            self.rejected += 1;
            return if pace.reject(h, share, LOST) { AfterStep::GoesOn } else { AfterStep::Alone };
        }
        *reach = match plain {
            Some((_, last)) => Some(last),
            None => bodies.reach(&motion.q),
        };
        pace.accept(h, share);
        self.steps += 1;
        lanes.accept(lane, method);
        method.accepted(bodies, (pace.t - h, h), [&*before, &*motion], carried);
        if !observe(pace.t - h, h, before, motion) || !method.has_polynomials() {
            return AfterStep::Alone;
        }
        if pace.is_over() { AfterStep::Done } else { AfterStep::GoesOn }
    }

    fn end(&self) -> ReducedEnd {
        let ReducedRun { method, .. } = &self.run;
        let own = SolverCounters { steps: self.steps, rejected: self.rejected, ..SolverCounters::default() };
        let work = Method::<Bodies<'a>>::work(method).and(own);
        ReducedEnd { work, error: method.error(), excess: method.excess }
    }
}

/// Advances every run that `next` gives with its number, and calls `done` with its end; none where it has to be made alone. `lanes` are those of
/// the reduced model that all methods have.
pub fn advance<'a>(
    lanes: &mut LaneReducedRodas4,
    next: &mut dyn FnMut() -> Option<(usize, ReducedRun<'a>)>,
    done: &mut dyn FnMut(usize, Option<ReducedEnd>),
) -> LaneWork {
    let mut work = LaneWork::default();
    let mut running: [Option<Box<ReducedLane<'a>>>; LANES] = [const { None }; LANES];
    let (mut s, mut step) = ([0.0; LANES], [1.0; LANES]);
    loop {
        for (k, running) in running.iter_mut().enumerate() {
            while running.is_none() {
                let Some((number, run)) = next() else { break };
                match ReducedLane::start(number, run) {
                    Some(lane) => {
                        lanes.set_lane(k, &lane.run.method, lane.run.ramp);
                        *running = Some(Box::new(lane));
                    }
                    None => done(number, None),
                }
            }
        }
        if running.iter().all(Option::is_none) {
            return work;
        }
        bimorph_base::budget::check();
        for (k, lane) in running.iter().enumerate() {
            if let Some(lane) = lane {
                (s[k], step[k]) = (lane.pace.t, lane.pace.step());
            }
        }
        let vanished = lanes.step(&s, &step);
        work.together += 1;
        for (k, running) in running.iter_mut().enumerate() {
            let Some(lane) = running else { continue };
            let steps = lane.steps;
            let after = if vanished[k] { AfterStep::Alone } else { lane.judge(lanes, k, step[k]) };
            work.accepted += lane.steps - steps;
            work.rejected += u64::from(lane.steps == steps);
            match after {
                AfterStep::GoesOn => continue,
                AfterStep::Done => done(lane.number, Some(lane.end())),
                AfterStep::Alone => done(lane.number, None),
            }
            *running = None;
            lanes.clear_lane(k);
        }
    }
}
