//! Constraints of ideal sources on potentials: the nodes of a tree of sources share one unknown, or none where it
//! touches ground, and differ by the sources between them.

use bimorph_base::sets::Sets;

/// A node that a source touches, reached from the one before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct TreeStep {
    pub(in super::super) node: usize,
    /// The source to its parent, 1 where it is at its plus and −1 where at its minus, and the node at the other end;
    /// `None`: ground.
    pub(in super::super) by: Option<(usize, f64, Option<usize>)>,
}

/// Constraints of sources on potentials: nodes that they connect share one unknown, and differ by the sources in
/// between.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct KnownPotentials {
    /// The unknown that a node's potential stands on; none: it is at ground but for sources.
    pub(in super::super) row: Vec<Option<usize>>,
    /// Number of unknowns.
    pub(in super::super) free: usize,
    /// Nodes that sources touch, each after its parent.
    pub(in super::super) order: Vec<TreeStep>,
    /// For each node that a source touches the sources between it and where its unknown is, with signs, in `sources`.
    offsets: Vec<(usize, usize)>,
    sources: Vec<(usize, f64)>,
}

impl KnownPotentials {
    /// Of a circuit with these nodes, grounds and sources (plus, minus; none: ground), whose parts are joined in `part`; one that nothing ties to ground has its first node there.
    pub(in super::super) fn new(
        (nodes, grounds): (usize, &[usize]),
        drawn: &[(usize, Option<usize>)],
        part: &mut Sets,
        ground: usize,
    ) -> Self {
        let mut grounded = vec![false; nodes];
        for &node in grounds {
            grounded[node] = true;
        }
        for (node, at_ground) in grounded.iter_mut().enumerate() {
            if !part.together(node, ground) {
                *at_ground = true;
                part.join(node, ground);
            }
        }
        // the sources at each node, ground last
        let index = |node: Option<usize>| node.filter(|n| !grounded[*n]).unwrap_or(nodes);
        let mut first = vec![0usize; nodes + 2];
        let ends = |&(plus, minus): &(usize, Option<usize>)| [index(Some(plus)), index(minus)];
        for end in drawn.iter().flat_map(ends) {
            first[end + 1] += 1;
        }
        for k in 0..=nodes {
            first[k + 1] += first[k];
        }
        let (mut next, mut at) = (first.clone(), vec![0usize; 2 * drawn.len()]);
        for (s, source) in drawn.iter().enumerate() {
            for end in ends(source) {
                at[next[end]] = s;
                next[end] += 1;
            }
        }
        let mut known = Self {
            row: vec![None; nodes],
            free: 0,
            order: Vec::new(),
            offsets: vec![(0, 0); nodes],
            sources: Vec::new(),
        };
        let mut reached = grounded.clone();
        reached.push(true);
        let mut waiting: Vec<usize> = Vec::new();
        let spread = |known: &mut Self, reached: &mut Vec<bool>, waiting: &mut Vec<usize>, from: usize| {
            waiting.push(from);
            while let Some(node) = waiting.pop() {
                bimorph_base::budget::check();
                for &s in &at[first[node]..first[node + 1]] {
                    let [plus, minus] = ends(&drawn[s]);
                    let (other, sign) = if plus == node { (minus, -1.0) } else { (plus, 1.0) };
                    if reached[other] {
                        continue;
                    }
                    reached[other] = true;
                    let begin = known.sources.len();
                    if node < nodes {
                        let (from, to) = known.offsets[node];
                        bimorph_base::budget::lay_out((to - from + 1) * 16);
                        known.sources.extend_from_within(from..to);
                        known.row[other] = known.row[node];
                    }
                    known.sources.push((s, sign));
                    known.offsets[other] = (begin, known.sources.len());
                    known.order.push(TreeStep { node: other, by: Some((s, sign, (node < nodes).then_some(node))) });
                    waiting.push(other);
                }
            }
        };
        spread(&mut known, &mut reached, &mut waiting, nodes);
        for node in 0..nodes {
            if !reached[node] {
                reached[node] = true;
                known.row[node] = Some(known.free);
                known.free += 1;
                if first[node] < first[node + 1] {
                    known.order.push(TreeStep { node, by: None });
                    spread(&mut known, &mut reached, &mut waiting, node);
                }
            }
        }
        known
    }

    /// The sources that a node's potential lies above its unknown, with signs.
    pub(in super::super) fn offset(&self, node: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (from, to) = self.offsets[node];
        self.sources[from..to].iter().copied()
    }
}
