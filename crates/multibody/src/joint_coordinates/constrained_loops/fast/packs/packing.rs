//! Placement of equal subtrees into packs, once for a mechanism.

use super::subtrees::equal;
use super::{FirstOfSubtree, PackContribution, PackedReal, Packing, Packs, RemainingStep, SubtreePack, WIDTH};
use crate::joint_coordinates::TreeParent;
use crate::joint_coordinates::constrained_loops::reduction::Reduction;
use crate::joint_coordinates::constrained_loops::schedule::{NONE, Schedule};
use crate::joint_coordinates::constrained_loops::tree::{Closure, Linkage, LinkageBody};
use crate::scalar::StoredReal;
use crate::scalar::has_lanes;
use crate::{BodyId, Pattern};
use std::ops::Range;
use std::sync::Arc;

impl Packs {
    /// The packs of a mechanism; none where it has no equal subtrees, or more constraints than coordinates in some loop, or the
    /// processor no lanes.
    pub(super) fn lay(linkage: &Linkage, schedule: &Schedule) -> Option<Self> {
        if schedule.redundant > 0 || !has_lanes() {
            return None;
        }
        let groups = equal(linkage, schedule, WIDTH);
        if groups.is_empty() {
            return None;
        }
        let layout = PackLayout::new(linkage, schedule, &groups);
        let pattern = layout.pattern(linkage);
        let variants: Vec<Linkage> = (0..WIDTH)
            .map(|lane| {
                let pattern = if lane == 0 { pattern.clone() } else { Pattern::new(0, &[]) };
                layout.linkage(linkage, lane, pattern)
            })
            .collect();
        let lanes = Reduction::<PackedReal>::without_packs(&variants.iter().collect::<Vec<_>>());
        let room = vec![PackedReal::ZERO; variants[0].coordinates];
        let packing = Packing::new(linkage, schedule, layout, &pattern);
        Some(Self {
            kept: vec![[PackedReal::ZERO; 9]; packing.nodes.len()],
            kept_blocks: vec![[PackedReal::ZERO; 9]; packing.blocks.len()],
            packing: Arc::new(packing),
            lanes,
            q: room.clone(),
            v: room.clone(),
            out: room,
        })
    }
}

impl Packing {
    /// `pattern` couples the bodies of the packs.
    fn new(linkage: &Linkage, schedule: &Schedule, layout: PackLayout, pattern: &Pattern) -> Self {
        let place = layout.place(linkage.links.len());
        let mut packing = Self {
            rest_closures: runs(schedule.entries.iter().map(|e| place[e.body] == u32::MAX)),
            bodies: layout.bodies,
            place,
            packs: layout.packs,
            shared: layout.shared,
            hands: Vec::new(),
            nodes: Vec::new(),
            blocks: Vec::new(),
            items: Vec::new(),
            order: Vec::new(),
            rest: Vec::new(),
        };
        packing.find_hands(pattern);
        packing.find_items(linkage);
        packing
    }

    /// Lists the bodies that hand something to shared bodies.
    fn find_hands(&mut self, pattern: &Pattern) {
        for body in 0..self.bodies {
            let rows = pattern.rows(body);
            let inner = rows.iter().take_while(|&&row| (row as usize) < self.bodies).count();
            if inner == rows.len() {
                continue;
            }
            let (nodes, blocks) = (self.nodes.len(), self.blocks.len());
            self.nodes.extend(rows[inner..].iter().map(|&row| row as usize));
            for (k, &row) in rows.iter().enumerate().skip(inner) {
                self.blocks.extend(rows[inner..k].iter().filter_map(|&to| pattern.block(row as usize, to as usize)));
            }
            self.hands.push(PackContribution {
                body,
                nodes: nodes..self.nodes.len(),
                blocks: blocks..self.blocks.len(),
            });
        }
    }

    /// Lists what the recursion over the other bodies does.
    fn find_items(&mut self, linkage: &Linkage) {
        let pattern = &linkage.pattern;
        let main = |shared: usize, lane: usize| self.shared[shared - self.bodies][lane] as usize;
        // what waits: whether for a block, where it goes, what it is
        let mut waiting: Vec<(bool, usize, u32)> = Vec::new();
        let mut rest = runs(self.place.iter().map(|&p| p == u32::MAX));
        rest.push(self.place.len()..self.place.len());
        let mut from = 0;
        for range in rest {
            for &place in &self.place[from..range.start] {
                let (body, lane) = (place as usize / WIDTH, place as usize % WIDTH);
                let Ok(hand) = self.hands.binary_search_by_key(&body, |h| h.body) else { continue };
                let hand = &self.hands[hand];
                let which = |k: usize| (k * WIDTH + lane) as u32;
                waiting.extend(hand.nodes.clone().map(|k| (false, main(self.nodes[k], lane), which(k))));
                let rows = &self.nodes[hand.nodes.clone()];
                let mut k = hand.blocks.start;
                for (i, &row) in rows.iter().enumerate() {
                    for &column in &rows[..i] {
                        let block = pattern.block(main(row, lane), main(column, lane)).unwrap_or(NONE);
                        waiting.push((true, block, which(k)));
                        k += 1;
                    }
                }
            }
            // sums of different places do not touch each other: only the order within each matters
            waiting.sort_by_key(|&(block, to, _)| (block, to));
            for terms in waiting.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                let start = self.order.len();
                self.order.extend(terms.iter().map(|t| t.2));
                let range = start..self.order.len();
                let (block, to, _) = terms[0];
                self.items.push(if block { RemainingStep::Block(to, range) } else { RemainingStep::Node(to, range) });
            }
            waiting.clear();
            from = range.end;
            if !range.is_empty() {
                self.items.push(RemainingStep::Turns(range.clone()));
                self.rest.push(range);
            }
        }
    }
}

/// The ranges in which `of` is true.
fn runs(of: impl Iterator<Item = bool>) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (k, _) in of.enumerate().filter(|&(_, yes)| yes) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end += 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Where everything lies.
struct PackLayout {
    packs: Vec<SubtreePack>,
    /// How many of a pack's lanes are not repeated.
    lanes: Vec<usize>,
    /// Shared bodies of the mechanism by lane, sorted, so that those of one pack stand in elimination order.
    shared: Vec<[u32; WIDTH]>,
    bodies: usize,
    coordinates: usize,
}

impl PackLayout {
    fn new(linkage: &Linkage, schedule: &Schedule, groups: &[Vec<Range<usize>>]) -> Self {
        let closure = |body: usize| schedule.entries.partition_point(|e| e.body < body);
        let joint = |body: usize| schedule.steps.get(body).map_or(usize::MAX, |s| s.joint as usize);
        let coordinate = |body: usize| linkage.links.get(body).map_or(linkage.coordinates, |l| l.first);
        let mut layout = Self { packs: Vec::new(), lanes: Vec::new(), shared: Vec::new(), bodies: 0, coordinates: 0 };
        let mut at = FirstOfSubtree::default();
        for members in groups.iter().flat_map(|group| group.chunks(WIDTH)) {
            let first = |k: usize| {
                let body = members[k.min(members.len() - 1)].start;
                FirstOfSubtree { body, coordinate: coordinate(body), closure: closure(body), joint: joint(body) }
            };
            let (of, end) = (std::array::from_fn(first), members[0].end);
            let start: FirstOfSubtree = first(0);
            let size = FirstOfSubtree {
                body: end - start.body,
                coordinate: coordinate(end) - start.coordinate,
                closure: closure(end) - start.closure,
                joint: members[0].clone().filter(|&b| !linkage.links[b].pin).count(),
            };
            layout.packs.push(SubtreePack { at, size, of });
            layout.lanes.push(members.len());
            at.body += size.body;
            at.coordinate += size.coordinate;
            at.closure += size.closure;
            at.joint += size.joint;
        }
        (layout.bodies, layout.coordinates) = (at.body, at.coordinate);
        for pack in &layout.packs {
            let width = linkage.pattern.rows(pack.of[0].body + pack.size.body - 1).len();
            layout.shared.extend((0..width).map(|slot| pack.shared(linkage, slot)));
        }
        layout.shared.sort_unstable();
        layout.shared.dedup();
        layout
    }

    /// Where body `body` of the subtree in `lane` of `pack`, or a body that it shares, lies among the packs.
    fn seat(&self, linkage: &Linkage, pack: &SubtreePack, lane: usize, body: usize) -> usize {
        let start = pack.of[lane].body;
        if body < start + pack.size.body {
            return pack.at.body + body - start;
        }
        let slot = linkage.pattern.rows(start + pack.size.body - 1).binary_search(&(body as u32)).unwrap_or(0);
        self.bodies + self.shared.binary_search(&pack.shared(linkage, slot)).unwrap_or(0)
    }

    /// Each body's place, see [`Packing::place`].
    fn place(&self, count: usize) -> Vec<u32> {
        let mut place = vec![u32::MAX; count];
        for (pack, &lanes) in self.packs.iter().zip(&self.lanes) {
            for (lane, of) in pack.of.iter().enumerate().take(lanes) {
                for k in 0..pack.size.body {
                    place[of.body + k] = ((pack.at.body + k) * WIDTH + lane) as u32;
                }
            }
        }
        place
    }

    /// Couplings of the first lane's bodies: those of the mechanism.
    fn pattern(&self, linkage: &Linkage) -> Pattern {
        let mut edges = Vec::new();
        for pack in &self.packs {
            for k in 0..pack.size.body {
                let rows = linkage.pattern.rows(pack.of[0].body + k);
                edges.extend(rows.iter().map(|&row| (pack.at.body + k, self.seat(linkage, pack, 0, row as usize))));
            }
        }
        Pattern::new(self.bodies + self.shared.len(), &edges)
    }

    /// The subtrees of one lane as a linkage of their own, the shared bodies as roots without coordinates at the end.
    fn linkage(&self, linkage: &Linkage, lane: usize, pattern: Pattern) -> Linkage {
        let mut links: Vec<LinkageBody> = Vec::with_capacity(self.bodies + self.shared.len());
        let mut closures = Vec::new();
        for pack in &self.packs {
            let of = pack.of[lane];
            for body in of.body..of.body + pack.size.body {
                let mut link = linkage.links[body].clone();
                link.first = pack.at.coordinate + link.first - of.coordinate;
                if let TreeParent::Body(parent) = &mut link.parent {
                    *parent = self.seat(linkage, pack, lane, *parent as usize) as u32;
                }
                links.push(link);
            }
            for closure in &linkage.closures[of.closure..of.closure + pack.size.closure] {
                let mut closure = closure.clone();
                match &mut closure {
                    Closure::Held { body, .. } => *body = self.seat(linkage, pack, lane, *body),
                    Closure::Joint(joint) => {
                        for end in [&mut joint.a, &mut joint.b] {
                            if let BodyId::Free(body) = end {
                                *body = self.seat(linkage, pack, lane, *body);
                            }
                        }
                    }
                }
                closures.push(closure);
            }
        }
        links.extend(self.shared.iter().map(|of| LinkageBody {
            parent: TreeParent::Free,
            pin: false,
            moving: [false; 3],
            first: self.coordinates,
            ..linkage.links[of[lane] as usize].clone()
        }));
        let constraints = closures.iter().map(Closure::constraints).sum();
        Linkage { links, closures, pattern, names: Vec::new(), coordinates: self.coordinates, constraints }
    }
}

impl SubtreePack {
    /// The body in place `slot` of what each lane's subtree shares.
    fn shared(&self, linkage: &Linkage, slot: usize) -> [u32; WIDTH] {
        self.of.map(|of| linkage.pattern.rows(of.body + self.size.body - 1)[slot])
    }
}
