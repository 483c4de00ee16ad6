//! Structurally equal subtrees of one mechanism, for packs.
//!
//! A subtree here is one of the elimination tree: a body with all bodies whose elimination changes its front.
//! Everything that a subtree's bodies couple to lies in it, or in the front of its root, the **shared** bodies. Joints,
//! closures and fill all obey this, so nothing else has to be checked.
//!
//! Two subtrees are equal when their bodies, in elimination order, have the same kinds of joints and closures and the
//! same fronts, counted from the subtree; only geometry, masses and stiffnesses may differ. Bodies are numbered by
//! their kind and by their subtrees, leaf → root, so that a mechanism is compared in one sweep.

use crate::joint_coordinates::TreeParent;
use crate::joint_coordinates::constrained_loops::schedule::{ClosureEntry, NONE, Schedule};
use crate::joint_coordinates::constrained_loops::tree::{Closure, Linkage};
use std::collections::HashMap;
use std::ops::Range;

/// Fewest equal subtrees that form a pack: a pack costs about as much as four subtrees one by one.
const MIN_SUBTREES: usize = 5;

/// Equal subtrees, each the range of its bodies in elimination order.
pub(super) type EqualSubtrees = Vec<Range<usize>>;

/// The groups of at least [`MIN_SUBTREES`] equal subtrees of a mechanism, the largest subtrees there are, disjoint. The
/// rest of a group after full packs of `width` is skipped if it has fewer than `MIN_SUBTREES` members.
pub(super) fn equal(linkage: &Linkage, schedule: &Schedule, width: usize) -> Vec<EqualSubtrees> {
    let mut groups = SubtreeShapes::new(linkage, schedule).choose();
    for group in &mut groups {
        let left = group.len() % width;
        if left < MIN_SUBTREES {
            group.truncate(group.len() - left);
        }
    }
    groups
}

/// Shape of each body's subtree.
struct SubtreeShapes {
    /// Equal numbers: equal subtrees. None: a subtree that cannot be taken out of the recursion.
    shape: Vec<Option<u32>>,
    /// Bodies of the subtree.
    size: Vec<usize>,
    shapes: usize,
}

impl SubtreeShapes {
    fn new(linkage: &Linkage, schedule: &Schedule) -> Self {
        let (pattern, count) = (&linkage.pattern, linkage.links.len());
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
        let (mut size, mut lowest) = (vec![1; count], (0..count).collect::<Vec<_>>());
        // the last body that rows of the subtree go to
        let mut reach = vec![0; count];
        let mut number = vec![0; count];
        let mut shape = vec![None; count];
        let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
        let mut key = Vec::new();
        let mut entry = 0;
        for body in 0..count {
            let first = entry;
            while schedule.entries.get(entry).is_some_and(|e| e.body == body) {
                entry += 1;
            }
            key.clear();
            describe(linkage, schedule, body, first..entry, &mut key);
            let turn = schedule.turn(body);
            if turn.next != NONE {
                reach[body] = turn.next;
            }
            for &child in &children[body] {
                size[body] += size[child];
                lowest[body] = lowest[body].min(lowest[child]);
                reach[body] = reach[body].max(reach[child]);
                key.push(number[child]);
                for &row in pattern.rows(child) {
                    let slot = pattern.rows(body).binary_search(&row).map_or(0, |k| 1 + k as u32);
                    key.push(slot);
                }
            }
            let next = known.len() as u32;
            number[body] = match known.get(&key) {
                Some(&n) => n,
                None => *known.entry(key.clone()).or_insert(next),
            };
            // its bodies follow each other, its rows end in it, and what it hands on goes by way of memory
            let alone = body + 1 - lowest[body] == size[body] && reach[body] <= body && !schedule.steps[body].hands_on;
            shape[body] = alone.then_some(number[body]);
            if let Some(&parent) = pattern.rows(body).first() {
                children[parent as usize].push(body);
            }
        }
        Self { shape, size, shapes: known.len() }
    }

    /// The largest subtrees of which there are [`MIN_SUBTREES`] that are equal.
    fn choose(&self) -> Vec<EqualSubtrees> {
        let mut number = vec![0usize; self.shapes];
        for &shape in self.shape.iter().flatten() {
            number[shape as usize] += 1;
        }
        let mut members: Vec<EqualSubtrees> = vec![Vec::new(); self.shapes];
        let mut end = self.shape.len();
        while end > 0 {
            let body = end - 1;
            match self.shape[body].filter(|&s| number[s as usize] >= MIN_SUBTREES) {
                Some(shape) => {
                    let start = end - self.size[body];
                    members[shape as usize].push(start..end);
                    end = start;
                }
                None => end = body,
            }
        }
        // others of a shape may lie within larger subtrees
        members.retain(|m| m.len() >= MIN_SUBTREES);
        members.iter_mut().for_each(|m| m.reverse());
        members
    }
}

/// Writes what a body and its closures are: everything that the recursion decides by, and no number that it computes with.
fn describe(linkage: &Linkage, schedule: &Schedule, body: usize, closures: Range<usize>, key: &mut Vec<u32>) {
    let link = &linkage.links[body];
    let flags = |of: [bool; 3]| of.iter().fold(0, |bits, &b| 2 * bits + u32::from(b));
    let slot = |s: usize| if s == NONE { u32::MAX } else { s as u32 };
    let hangs = match link.parent {
        TreeParent::Ground => 0,
        TreeParent::Free => 1,
        TreeParent::Body(_) => 2,
    };
    let turn = schedule.turn(body);
    key.extend([hangs, slot(turn.parent), turn.front as u32, u32::from(link.pin), flags(link.moving)]);
    key.push(closures.len() as u32);
    for k in closures {
        let ClosureEntry { other, count, ends, .. } = schedule.entries[k];
        let first_is_a = ends[0] == Some(body as u32);
        let (kind, locked) = match &linkage.closures[k] {
            Closure::Held { .. } => (0, 0),
            Closure::Joint(joint) => (1 + u32::from(linkage.closures[k].is_pin()), flags(joint.locked)),
        };
        key.extend([kind, locked, count as u32, slot(other), u32::from(first_is_a)]);
    }
}
