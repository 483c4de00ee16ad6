//! Subtrees of one mechanism that are equal in structure: what [`super::packs`] reduces side by side.
//!
//! A subtree here is one of the elimination tree: a body with all bodies whose elimination changes its front. Everything that
//! a subtree's bodies couple to lies in it, or in the front of its root, the **shared** bodies. Joints, closures and fill all
//! obey this, so nothing else has to be looked at.
//!
//! Two subtrees are equal when their bodies, in elimination order, have the same kinds of joints and closures and the same
//! fronts, counted from the subtree; only geometry, masses and stiffnesses may differ. Bodies are numbered by what they are
//! and by what hangs in them, leaf → root, so a mechanism is compared in one sweep.

use super::linkage::{Closure, Linkage, Parent};
use super::schedule::{Entry, NONE, Schedule};
use std::collections::HashMap;
use std::ops::Range;

/// Fewest subtrees that are reduced side by side: a pack costs about as much as two subtrees one after the other.
const FEWEST: usize = 3;

/// Equal subtrees, each the range of its bodies in elimination order.
pub(super) type Equal = Vec<Range<usize>>;

/// The groups of at least [`FEWEST`] equal subtrees of a mechanism, disjoint. Groups that fill packs of `width` come before
/// larger subtrees that do not; what is left over of a group when packs are full, and is fewer than `FEWEST`, is left out.
pub(super) fn equal(linkage: &Linkage, schedule: &Schedule, width: usize) -> Vec<Equal> {
    let shapes = Shapes::new(linkage, schedule);
    let mut taken = vec![false; linkage.links.len()];
    let mut groups = Vec::new();
    for fewest in [width, FEWEST] {
        groups.extend(shapes.choose(fewest, &mut taken));
    }
    for group in &mut groups {
        let left = group.len() % width;
        if left < FEWEST {
            group.truncate(group.len() - left);
        }
    }
    groups
}

/// What each body's subtree is.
struct Shapes {
    /// Equal numbers: equal subtrees. None: a subtree that cannot be taken out of the recursion.
    shape: Vec<Option<u32>>,
    /// Bodies of the subtree.
    size: Vec<usize>,
    shapes: usize,
}

impl Shapes {
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
            let turn = &schedule.turns[body];
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

    /// The largest subtrees of which there are `fewest` that are equal, among bodies that are not taken; takes them.
    fn choose(&self, fewest: usize, taken: &mut [bool]) -> Vec<Equal> {
        let count = self.shape.len();
        let range = |body: usize| body + 1 - self.size[body]..body + 1;
        let mut before = vec![0u32; count + 1];
        for body in 0..count {
            before[body + 1] = before[body] + u32::from(taken[body]);
        }
        let untouched = |r: &Range<usize>| before[r.start] == before[r.end];
        let free: Vec<Option<u32>> = (0..count).map(|b| self.shape[b].filter(|_| untouched(&range(b)))).collect();
        let mut number = vec![0usize; self.shapes];
        for &shape in free.iter().flatten() {
            number[shape as usize] += 1;
        }
        let mut members: Vec<Equal> = vec![Vec::new(); self.shapes];
        let mut body = count;
        while body > 0 {
            match free[body - 1].filter(|&s| number[s as usize] >= fewest) {
                Some(shape) => {
                    members[shape as usize].push(range(body - 1));
                    body -= self.size[body - 1];
                }
                None => body -= 1,
            }
        }
        members.retain(|m| m.len() >= fewest);
        for member in members.iter_mut() {
            member.reverse();
            for range in member.iter() {
                taken[range.clone()].fill(true);
            }
        }
        members
    }
}

/// Writes what a body and its closures are: everything that the recursion decides by, and no number that it computes with.
fn describe(linkage: &Linkage, schedule: &Schedule, body: usize, closures: Range<usize>, key: &mut Vec<u32>) {
    let link = &linkage.links[body];
    let flags = |of: [bool; 3]| of.iter().fold(0, |bits, &b| 2 * bits + u32::from(b));
    let slot = |s: usize| if s == NONE { u32::MAX } else { s as u32 };
    let hangs = match link.parent {
        Parent::Ground => 0,
        Parent::Free => 1,
        Parent::Body(_) => 2,
    };
    let turn = &schedule.turns[body];
    key.extend([hangs, slot(turn.parent), turn.front as u32, u32::from(link.pin), flags(link.moving)]);
    key.push(closures.len() as u32);
    for k in closures {
        let Entry { other, count, ends, .. } = schedule.entries[k];
        let first_is_a = ends[0] == Some(body as u32);
        let (kind, locked) = match &linkage.closures[k] {
            Closure::Held { .. } => (0, 0),
            Closure::Joint(joint) => (1 + u32::from(linkage.closures[k].is_pin()), flags(joint.locked)),
        };
        key.extend([kind, locked, count as u32, slot(other), u32::from(first_is_a)]);
    }
}
