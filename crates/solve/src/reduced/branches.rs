//! Equilibria of the full model at points of a box of inputs: those of the branch from rest, through pull-in where that comes, and those of the
//! branches beyond it, as far as these hold on the way back.

use super::inputs::InputBox;
use super::taylor::DriveRay;
use crate::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::path::LoadPath;
use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;

/// Where an equilibrium lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StaticBranch {
    /// On the branch from rest.
    Rest,
    /// Where that falls to.
    Fallen,
    /// On a branch beyond, on the way back.
    Beyond,
    /// At the end of that, where the parts release; its drive is another one than that of its point.
    Release,
}

/// An equilibrium.
#[derive(Debug, Clone)]
pub(super) struct BranchState {
    /// The point of the box, by its place among the points.
    pub(super) point: usize,
    /// The branch.
    pub(super) branch: StaticBranch,
    /// The drive.
    pub(super) drive: Drive,
    /// Where the bodies are.
    pub(super) q: Vec<Pose>,
}

/// The equilibria at points of a box.
pub(super) fn branch_states(system: &System, inputs: &InputBox, points: &[Vec<f64>]) -> Vec<BranchState> {
    let mut found = Vec::new();
    let mut solver = Equilibrium::new(system, EquilibriumOptions::default());
    for (point, u) in points.iter().enumerate() {
        let drive = inputs.drive(u);
        if drive == inputs.none {
            continue;
        }
        let mut q = vec![Pose::zeros(); system.bodies()];
        let Ok(path) = solver.follow(system, &DriveRay { none: &inputs.none, to: &drive }, &mut q) else { continue };
        if path.reached == 1.0 {
            let branch = if path.passed.is_empty() { StaticBranch::Rest } else { StaticBranch::Fallen };
            found.push(BranchState { point, branch, drive, q });
        }
    }
    let fallen: Vec<BranchState> = found.iter().filter(|state| state.branch == StaticBranch::Fallen).cloned().collect();
    let back = points.iter().enumerate().filter(|(point, _)| fallen.iter().all(|state| state.point != *point));
    let mut solver = Equilibrium::new(system, EquilibriumOptions { stop_at_fold: true, ..Default::default() });
    for (point, u) in back {
        let apart = |of: &BranchState| points[of.point].iter().zip(u).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let Some(nearest) = fallen.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { break };
        let line = DriveLine { from: &nearest.drive, to: &inputs.drive(u) };
        let mut q = nearest.q.clone();
        let Ok(path) = solver.follow(system, &line, &mut q) else { continue };
        let mut drive = nearest.drive.clone();
        line.at(path.reached, &mut drive);
        let branch = if path.reached == 1.0 { StaticBranch::Beyond } else { StaticBranch::Release };
        found.push(BranchState { point, branch, drive, q });
    }
    found
}

/// A straight path from one drive to another.
struct DriveLine<'a> {
    from: &'a Drive,
    to: &'a Drive,
}

impl DriveLine<'_> {
    /// `of` becomes the sum of both with these shares.
    fn blend(&self, [from, to]: [f64; 2], of: &mut Drive) {
        let (a, b) = (self.from, self.to);
        of.clone_from(a);
        let mix = |of: &mut [f64], a: &[f64], b: &[f64]| {
            of.iter_mut().zip(a.iter().zip(b)).for_each(|(of, (a, b))| *of = from * a + to * b);
        };
        mix(&mut of.volts, &a.volts, &b.volts);
        mix(&mut of.expansion, &a.expansion, &b.expansion);
        mix(&mut of.inputs, &a.inputs, &b.inputs);
        of.load = from * a.load + to * b.load;
    }
}

impl LoadPath for DriveLine<'_> {
    fn at(&self, s: f64, drive: &mut Drive) {
        self.blend([1.0 - s, s], drive);
    }

    fn slope(&self, _: f64, slope: &mut Drive) {
        self.blend([-1.0, 1.0], slope);
        slope.turning = 0.0;
    }

    fn begins_loaded(&self) -> bool {
        true
    }
}
