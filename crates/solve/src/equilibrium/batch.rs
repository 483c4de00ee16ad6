//! Batch of equilibria for variants of one mechanism, bit-identical to single ones.
//!
//! A lane goes the whole path in one step, as [`super::Equilibrium::follow`] does where nothing happens on it: a tangent, and Newton's
//! method until it settles on a stable equilibrium. Where something does happen (a fold, a free motion, a step that is too large) the lane is
//! given up, and the variant has to go alone.

mod kernels;
mod storage;

pub use storage::LaneEquilibrium;

use super::EquilibriumOptions;
use super::newton_test::{Corrections, leaps};
use super::path::LoadPath;
use crate::equations::acted_bodies::pose_in_lane;
use bimorph_domains::{Drive, System};
use bimorph_multibody::batch::{LANES, Lane8, LanePose, across};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::scalar::StoredReal;
use kernels::{EquilibriumKernel, EquilibriumPass};

/// A variant, its path, and the equilibrium (or near it) where that begins.
pub struct BatchPath<'a> {
    /// The mechanism.
    pub system: &'a System,
    /// Its load path.
    pub path: &'a dyn LoadPath,
    /// Where it is at the start.
    pub q: &'a [Pose],
}

/// The end of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvergedPath {
    /// The equilibrium.
    pub q: Vec<Pose>,
    /// Newton iterations.
    pub iterations: usize,
}

/// A lane's course.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LaneStatus {
    Goes,
    Arrived(usize),
    GivenUp,
}

impl LaneEquilibrium {
    /// Goes the ways of variants that fit, [`LANES`] at most. None for one that has to go alone.
    pub fn follow(&mut self, ways: &[BatchPath<'_>]) -> Vec<Option<ConvergedPath>> {
        let Some(last) = ways.len().checked_sub(1) else { return Vec::new() };
        let way = |lane: usize| &ways[lane.min(last)];
        let mut drives: [Drive; LANES] = std::array::from_fn(|lane| way(lane).system.electrics.drive());
        let mut slopes = drives.clone();
        for lane in 0..LANES {
            let BatchPath { system, path, q } = way(lane);
            self.model.set_lane(lane, &system.model);
            for (to, q) in self.trial.iter_mut().zip(*q) {
                (0..DOF).for_each(|i| to[i].set_lane(lane, q[i]));
            }
            path.at(0.0, &mut drives[lane]);
            path.slope(0.0, &mut slopes[lane]);
        }
        self.built_in = [drives[0].load, slopes[0].load];
        let mut course = [LaneStatus::Goes; LANES];
        for (lane, course) in course.iter_mut().enumerate() {
            // one share of built-in strains for all
            if [drives[lane].load, slopes[lane].load] != self.built_in {
                *course = LaneStatus::GivenUp;
            }
        }
        self.goes = Lane8::of(1.0);
        let predicted = self.predict(&way, &drives, &slopes);
        course.iter_mut().zip(self.vanished).for_each(|(course, vanished)| {
            if vanished {
                *course = LaneStatus::GivenUp;
            }
        });
        for (lane, drive) in drives.iter_mut().enumerate() {
            way(lane).path.at(1.0, drive);
        }
        if drives.iter().any(|drive| drive.load != drives[0].load) {
            return ways.iter().map(|_| None).collect();
        }
        self.built_in[0] = drives[0].load;
        self.correct(&way, &drives, &predicted, &mut course);
        let arrived = |lane: usize| match course[lane] {
            LaneStatus::Arrived(iterations) => Some(ConvergedPath { q: self.lane(&self.trial, lane), iterations }),
            _ => None,
        };
        (0..ways.len()).map(arrived).collect()
    }

    /// The tangent's prediction of the end of the way into `trial`; answers how far it goes.
    fn predict<'w>(
        &mut self,
        way: &dyn Fn(usize) -> &'w BatchPath<'w>,
        drives: &[Drive; LANES],
        slopes: &[Drive; LANES],
    ) -> [f64; LANES] {
        expand(&mut self.expansion, drives);
        expand(&mut self.rate, slopes);
        self.balance(way, drives);
        self.residual.copy_from_slice(&self.force);
        self.run(EquilibriumPass::Change);
        for lane in 0..LANES {
            let system = way(lane).system;
            self.acted.take(lane, &self.trial, &self.force);
            system.add_body_drive_force(&self.acted.q, &drives[lane], &slopes[lane], &mut self.acted.r);
            self.acted.give(lane, &mut self.force);
        }
        self.run(EquilibriumPass::Predict);
        self.prediction.copy_from_slice(&self.trial);
        self.sizes(way, |m, k, i, lane| m.force[k][i].0[lane])
    }

    /// Newton's method at the end of the way.
    fn correct<'w>(
        &mut self,
        way: &dyn Fn(usize) -> &'w BatchPath<'w>,
        drives: &[Drive; LANES],
        predicted: &[f64; LANES],
        course: &mut [LaneStatus; LANES],
    ) {
        let options = EquilibriumOptions::default();
        let mut progress: [Corrections; LANES] =
            std::array::from_fn(|lane| Corrections::new(way(lane).system.length_scale));
        expand(&mut self.expansion, drives);
        for iteration in 1..=options.iterations {
            for (goes, course) in self.goes.0.iter_mut().zip(&*course) {
                *goes = if *course == LaneStatus::Goes { 1.0 } else { 0.0 };
            }
            if self.goes.0 == [0.0; LANES] {
                return;
            }
            bimorph_base::budget::check();
            self.balance(way, drives);
            self.run(EquilibriumPass::Correct);
            let corrections = self.sizes(way, |m, k, i, lane| m.force[k][i].0[lane]);
            let reaches = self.sizes(way, |m, k, i, lane| m.trial[k][i].0[lane]);
            let away = self.sizes(way, |m, k, i, lane| m.trial[k][i].0[lane] - m.prediction[k][i].0[lane]);
            for lane in (0..LANES).filter(|&lane| course[lane] == LaneStatus::Goes).collect::<Vec<_>>() {
                let (system, correction) = (way(lane).system, corrections[lane]);
                if self.vanished[lane] || progress[lane].diverge(correction) {
                    course[lane] = LaneStatus::GivenUp;
                    continue;
                }
                // where parts touch, a stalled iteration has to balance, too: a single one decides that
                let mut undecided = false;
                let settled = progress[lane].settle(correction, (reaches[lane], options.tolerance), || {
                    undecided = !system.members.is_empty()
                        && system.contact_scale(&self.lane(&self.trial, lane), &drives[lane].volts) > 0.0;
                    true
                });
                if undecided {
                    course[lane] = LaneStatus::GivenUp;
                } else if settled {
                    let stable = self.negative.lane(lane) == 0.0;
                    let near = progress[lane].is_near(away[lane], predicted[lane]);
                    let end = || self.lane(&self.trial, lane);
                    let sound = stable && near && !leaps(system, &drives[lane].volts, way(lane).q, end);
                    course[lane] = if sound { LaneStatus::Arrived(iteration) } else { LaneStatus::GivenUp };
                }
            }
        }
        for course in course.iter_mut().filter(|course| **course == LaneStatus::Goes) {
            *course = LaneStatus::GivenUp;
        }
    }

    /// The tangent at `trial`, factored, and the residual in `force`.
    fn balance<'w>(&mut self, way: &dyn Fn(usize) -> &'w BatchPath<'w>, drives: &[Drive; LANES]) {
        self.run(EquilibriumPass::Tangent);
        for (lane, drive) in drives.iter().enumerate() {
            let system = way(lane).system;
            if self.goes.0[lane] == 0.0 || !system.is_acted_on(drive) {
                continue;
            }
            let Self { tangent, acted, trial, force, .. } = self;
            acted.take(lane, trial, force);
            system.add_body_forces(&acted.q, drive, &mut acted.r);
            acted.give(lane, force);
            acted.take_tangent(lane, tangent);
            system.add_body_tangent(&acted.q, drive, &mut acted.tangent);
            acted.give_tangent(lane, tangent);
        }
        self.run(EquilibriumPass::Factor);
    }

    fn lane(&self, x: &[LanePose], lane: usize) -> Vec<Pose> {
        x.iter().map(|p| pose_in_lane(p, lane)).collect()
    }

    /// Largest displacement of a body in each lane, as `size` of one variant.
    #[inline(always)]
    fn sizes<'w>(
        &self,
        way: &dyn Fn(usize) -> &'w BatchPath<'w>,
        at: impl Fn(&Self, usize, usize, usize) -> f64,
    ) -> [f64; LANES] {
        let scale: [f64; LANES] = std::array::from_fn(|lane| way(lane).system.length_scale);
        let mut largest = [0.0f64; LANES];
        for k in 0..self.trial.len() {
            for lane in 0..LANES {
                let (x, y, z) = (at(self, k, 0, lane), at(self, k, 1, lane), at(self, k, 2, lane));
                let extent = (x * x + y * y).sqrt().max(z.abs() * scale[lane]);
                // a comparison with NaN must not hide it
                let finite = x * 0.0 + y * 0.0 + z * 0.0 == 0.0;
                largest[lane] = largest[lane].max(if finite { extent } else { f64::INFINITY });
            }
        }
        largest
    }

    fn run(&mut self, task: EquilibriumPass) {
        across(EquilibriumKernel(self, task));
    }
}

/// Free strains of heaters from the drive of each lane.
fn expand(expansion: &mut [Lane8], drives: &[Drive; LANES]) {
    for (k, expansion) in expansion.iter_mut().enumerate() {
        for (lane, drive) in drives.iter().enumerate() {
            expansion.set_lane(lane, drive.expansion[k]);
        }
    }
}
