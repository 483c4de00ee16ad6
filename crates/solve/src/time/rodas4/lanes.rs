//! Batched Rodas4: a step of each variant, with its own length, in the vector instructions of the processor.
//!
//! Operations over all bodies and joints run for all lanes at once, in the order of [`super`] and of `stages`. Gaps and
//! dead loads act on few bodies and have branches of their own, and run variant by variant.

mod acted;
pub(in crate::time) mod heat;
mod kernels;
mod motion;
mod storage;

pub use motion::{LaneMotion, Norms};
pub use storage::{Lane, LaneRodas4};

use kernels::{StepKernel, StepPass};

use crate::time::method::{Motion, StepResult};
use crate::time::rosenbrock::{self, RosenbrockStep};
use bimorph_domains::{Ramp, System};
use bimorph_multibody::batch::{LANES, across};

impl LaneRodas4 {
    /// True for a variant that differs in numbers alone.
    pub fn fits(&self, system: &System) -> bool {
        self.model.fits(&system.model)
            && system.electrics.inputs.is_empty()
            && !system.electrics.heating.is_hot()
            && (!self.losses.is_empty() || !system.loses())
            && self.heat.count() == system.electrics.heating.heaters.len()
            && self.drives[0].volts.len() == system.members.len()
            && self.acted.fits(system)
    }

    /// Puts the numbers of a variant that fits, and its motion, into one lane. The sources of its ramp must hold their
    /// voltages.
    pub fn set_lane(&mut self, lane: usize, system: &System, ramp: &Ramp<'_>, motion: &Motion) {
        debug_assert_eq!(ramp.from, ramp.to);
        self.model.set_lane(lane, &system.model);
        self.motion.set_lane(lane, motion);
        self.heat.set_lane(lane, ramp);
        ramp.at(0.0, &mut self.drives[lane]);
        self.drives[lane].load = 1.0;
    }

    /// One step of each lane, of length `h` from the time `s` of its course (s); for lanes without one all is left as it comes.
    /// Returns the lanes whose matrix could not be factored: their motion is nothing.
    pub fn step(&mut self, lanes: &[Option<Lane<'_>>; LANES], s: &[f64; LANES], h: &[f64; LANES]) -> [bool; LANES] {
        match rosenbrock::take(&mut LaneStep { rodas: self, lanes, s, h }) {
            Ok(()) => self.vanished,
            Err(_) => [true; LANES],
        }
    }

    /// Takes one lane back to where its last step began.
    pub fn go_back(&mut self, lane: usize) {
        self.motion.copy_lane(lane, &self.before);
    }

    fn run(&mut self, task: StepPass) {
        across(StepKernel(self, task));
    }
}

/// A step of all lanes under way.
struct LaneStep<'a, 's> {
    rodas: &'a mut LaneRodas4,
    lanes: &'a [Option<Lane<'s>>; LANES],
    /// Start and length in each lane (s).
    s: &'a [f64; LANES],
    h: &'a [f64; LANES],
}

impl RosenbrockStep for LaneStep<'_, '_> {
    fn begin(&mut self) -> StepResult {
        self.rodas.h.0 = *self.h;
        self.rodas.heat.at(of_lanes(self.lanes, self.s));
        self.rodas.run(StepPass::Forcing);
        Ok(())
    }

    fn drive_at(&mut self, alpha: f64) {
        let mut at = *self.s;
        for (at, h) in at.iter_mut().zip(self.h) {
            *at += alpha * h;
        }
        self.rodas.heat.at(of_lanes(self.lanes, &at));
        self.rodas.run(StepPass::Expand);
    }

    fn argument(&mut self, i: usize) {
        self.rodas.run(StepPass::Begin(i));
    }

    fn residual(&mut self, i: usize) {
        self.rodas.run(if i == 0 { StepPass::Tangent } else { StepPass::Elastic(i) });
        self.rodas.act(self.lanes, i);
    }

    /// A lane without a factor is marked, and the others go on.
    fn factor(&mut self) -> StepResult {
        self.rodas.run(StepPass::Factor);
        Ok(())
    }

    fn solve(&mut self, _: usize) {
        self.rodas.run(StepPass::Solve);
    }

    fn finish(&mut self) {
        self.rodas.run(StepPass::Finish);
    }
}

/// The time of each lane that is one.
fn of_lanes(lanes: &[Option<Lane<'_>>; LANES], s: &[f64; LANES]) -> [Option<f64>; LANES] {
    std::array::from_fn(|k| lanes[k].as_ref().map(|_| s[k]))
}
