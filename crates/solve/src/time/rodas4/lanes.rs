//! Batched Rodas4: a step of each variant, with its own length, in the vector instructions of the processor.
//!
//! Operations over all bodies and joints run for all lanes at once, in the order of [`super`] and of `stages`. Gaps and
//! dead loads act on few bodies and have branches of their own, and run variant by variant.

mod acted;
mod heat;
mod kernels;
mod motion;
mod storage;

pub use motion::{LaneMotion, Norms};
pub use storage::{Lane, LaneRodas4};

use kernels::{StepKernel, StepPass};

use super::tableau::{ALPHA, moves_on};
use crate::time::method::Motion;
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
            && self.acted == system.acted_on()
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
        self.h.0 = *h;
        self.heat.at(of_lanes(lanes, s));
        self.run(StepPass::Forcing);
        for (i, alpha) in ALPHA.into_iter().enumerate() {
            if moves_on(i) {
                let mut at = *s;
                for (at, h) in at.iter_mut().zip(h) {
                    *at += alpha * h;
                }
                self.heat.at(of_lanes(lanes, &at));
                self.run(StepPass::Expand);
            }
            self.run(StepPass::Begin(i));
            if i == 0 {
                self.run(StepPass::Tangent);
                self.act(lanes, i);
                self.run(StepPass::Factor);
            } else {
                self.run(StepPass::Elastic(i));
                self.act(lanes, i);
            }
            self.run(StepPass::Solve);
        }
        self.run(StepPass::Finish);
        self.vanished
    }

    /// Takes one lane back to where its last step began.
    pub fn go_back(&mut self, lane: usize) {
        self.motion.copy_lane(lane, &self.before);
    }

    fn run(&mut self, task: StepPass) {
        across(StepKernel(self, task));
    }
}

/// The time of each lane that is one.
fn of_lanes(lanes: &[Option<Lane<'_>>; LANES], s: &[f64; LANES]) -> [Option<f64>; LANES] {
    std::array::from_fn(|k| lanes[k].as_ref().map(|_| s[k]))
}
