//! Batch of equilibria for variants of one mechanism, bit-identical to single ones.
//!
//! A lane goes the whole path in one step, as [`super::Equilibrium::follow`] does where nothing happens on it: a tangent, and Newton's
//! method until it settles on a stable equilibrium. Where something does happen (a fold, a free motion, a step that is too large) the lane is
//! given up, and the variant has to go alone.

mod kernels;
mod storage;

pub use storage::LaneEquilibrium;

use super::path::LoadPath;
use super::{EquilibriumOptions, LEAP, STALLED};
use bimorph_domains::{Domain, Drive, System};
use bimorph_multibody::batch::{LANES, Lane8, LanePose, across};
use bimorph_multibody::planar::Pose;
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
                (0..3).for_each(|i| to[i].set_lane(lane, q[i]));
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
            self.take(lane);
            system.add_body_drive_force(&self.q, &drives[lane], &slopes[lane], &mut self.r);
            self.give(lane);
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
        let mut last = [f64::INFINITY; LANES];
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
                let scale = system.length_scale;
                if self.vanished[lane]
                    || !correction.is_finite()
                    || (correction > last[lane] && correction > 1e-3 * scale)
                {
                    course[lane] = LaneStatus::GivenUp;
                    continue;
                }
                let reach = reaches[lane].max(1e-6 * scale);
                let stalled = correction <= STALLED * reach && correction > 0.1 * last[lane];
                last[lane] = correction;
                // where parts touch, a stalled iteration has to balance, too: a single one continues
                if stalled && correction > options.tolerance * reach {
                    let touching = !system.members.is_empty()
                        && system.contact_scale(&self.lane(&self.trial, lane), &drives[lane].volts) > 0.0;
                    if touching {
                        course[lane] = LaneStatus::GivenUp;
                        continue;
                    }
                }
                if correction <= options.tolerance * reach || stalled {
                    let stable = self.negative.lane(lane) == 0.0;
                    let near = away[lane] <= 0.5 * predicted[lane] + 1e-3 * scale;
                    let sound = stable && near && !self.leaps(lane, way(lane), &drives[lane]);
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
            self.take(lane);
            system.add_body_forces(&self.q, drive, &mut self.r);
            self.give(lane);
            let Self { tangent, own, acted, blocks, q, .. } = self;
            for (lanes, own, which) in
                [(&mut tangent.diagonal, &mut own.diagonal, &*acted), (&mut tangent.below, &mut own.below, &*blocks)]
            {
                for &b in which {
                    (0..9).for_each(|e| own[b][(e % 3, e / 3)] = lanes[b][e / 3][e % 3].lane(lane));
                }
            }
            system.add_body_tangent(q, drive, own);
            for (lanes, own, which) in
                [(&mut tangent.diagonal, &own.diagonal, &*acted), (&mut tangent.below, &own.below, &*blocks)]
            {
                for &b in which {
                    (0..9).for_each(|e| lanes[b][e / 3][e % 3].set_lane(lane, own[b][(e % 3, e / 3)]));
                }
            }
        }
        self.run(EquilibriumPass::Factor);
    }

    /// Displacement of a lane's bodies that are acted on, and the force on them.
    fn take(&mut self, lane: usize) {
        let pose = |p: &LanePose| Pose::new(p[0].lane(lane), p[1].lane(lane), p[2].lane(lane));
        for &b in &self.acted {
            (self.q[b], self.r[b]) = (pose(&self.trial[b]), pose(&self.force[b]));
        }
    }

    fn give(&mut self, lane: usize) {
        for &b in &self.acted {
            (0..3).for_each(|i| self.force[b][i].set_lane(lane, self.r[b][i]));
        }
    }

    fn lane(&self, x: &[LanePose], lane: usize) -> Vec<Pose> {
        x.iter().map(|p| Pose::new(p[0].lane(lane), p[1].lane(lane), p[2].lane(lane))).collect()
    }

    /// As `leaps` of [`super::Equilibrium`].
    fn leaps(&self, lane: usize, way: &BatchPath<'_>, drive: &Drive) -> bool {
        let system = way.system;
        let closes = |(gap, volts): &(usize, &f64)| **volts != 0.0 && system.members[*gap].is_electrostatic();
        let mut closing = drive.volts.iter().enumerate().filter(closes).peekable();
        if closing.peek().is_none() {
            return false;
        }
        let trial = self.lane(&self.trial, lane);
        closing.any(|(gap, _)| {
            let (before, after) = (system.distance(gap, way.q), system.distance(gap, &trial));
            (after - before).abs() > LEAP * before.max(after)
        })
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
