//! The storage of a reduction: everything is laid out once, in elimination order.

use super::closures::ClosureData;
use super::fast::packs::Packs;
use super::kinematics::{Arms, Hanging, JointData, LinkData, Placed, lane};
use super::reduction::{Node, Reduction, Scratch};
use super::scalar::Real;
use super::schedule::Schedule;
use super::schedule::Turn;
use super::tree::Linkage;

impl<T: Real> Reduction<T> {
    /// Storage for one variant per lane; all must have the same tree and loops (fewer variants are repeated). Over one
    /// `f64`, subtrees that are equal in structure go side by side through vector instructions.
    pub fn new(variants: &[&Linkage]) -> Self {
        let mut reduction = Self::without_packs(variants);
        if T::LANES == 1 {
            reduction.packs = Packs::new(variants[0], &reduction.schedule);
        }
        reduction
    }

    /// [`Reduction::new`] with every body on its own: slower where subtrees are equal, and the same bits.
    pub fn without_packs(variants: &[&Linkage]) -> Self {
        Self::with_schedule(variants, Schedule::new(variants[0]))
    }

    pub(super) fn with_schedule(variants: &[&Linkage], schedule: Schedule) -> Self {
        let linkage = variants[0];
        let count = linkage.links.len();
        let of = |b: usize| variants.iter().map(|v| &v.links[b]).collect::<Vec<_>>();
        let joints: Vec<_> = (0..count).filter(|&b| !linkage.links[b].pin).map(|b| JointData::new(&of(b))).collect();
        let closures = (0..linkage.closures.len())
            .map(|c| {
                let of: Vec<_> =
                    variants.iter().map(|v| (&v.closures[c], v.links[v.closures[c].bodies().0].lever)).collect();
                ClosureData::new(&of)
            })
            .collect();
        let mut units = vec![T::ONE; linkage.coordinates];
        for (b, link) in linkage.links.iter().enumerate() {
            let mut next = link.first;
            for i in 0..3 {
                if link.moving[i] {
                    if i == 2 {
                        for lane in 0..T::LANES {
                            units[next].set_lane(lane, variants[lane % variants.len()].links[b].lever);
                        }
                    }
                    next += 1;
                }
            }
        }
        let most = |f: &dyn Fn(Turn) -> usize| schedule.turns().map(f).max().unwrap_or(0);
        let size = most(&|t| t.freedom + 3 * t.front);
        let scratch = Scratch {
            m: vec![T::ZERO; size * size],
            g: vec![T::ZERO; size],
            r: vec![T::ZERO; most(&|t| t.rows) * (size + 1)],
        };
        Self {
            links: (0..count).map(|b| LinkData::new(&of(b))).collect(),
            arms: (0..count).map(|b| Arms::new(&of(b))).collect(),
            signs: (0..count).map(|b| lane(&of(b), &|link| link.sign)).collect(),
            closures,
            units,
            placed: vec![Placed::REST; count],
            hanging: vec![Hanging::REST; count],
            axes: vec![[T::ZERO; 3]; if joints.is_empty() { 0 } else { linkage.coordinates }],
            joints,
            force: vec![[T::ZERO; 3]; count],
            torque: vec![T::ZERO; linkage.coordinates],
            nodes: vec![Node::CLEAN; schedule.node_count],
            coupling: vec![[T::ZERO; 9]; schedule.block_count],
            rows: vec![T::ZERO; schedule.row_entries],
            coefficients: vec![T::ZERO; schedule.coefficient_entries],
            base: vec![T::ZERO; linkage.coordinates],
            turned: vec![[[T::ZERO; 3]; 3]; if most(&|t| t.freedom) > 1 { count } else { 0 }],
            accelerations: vec![[T::ZERO; 3]; count],
            front: scratch,
            added: Vec::new(),
            added_coupling: Vec::new(),
            nearness: T::ZERO,
            packs: None,
            schedule,
        }
    }
}
