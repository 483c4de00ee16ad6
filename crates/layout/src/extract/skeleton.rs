//! The medial axis without its twigs: branches into corners and small bumps are removed.
//!
//! A branch that ends in a corner says how the corner is shaped and nothing about limbs. A short branch ends in a bump
//! where it protrudes from the disk at its root by less than [`BUMP`] of its own width (a notion of significance as in
//! Attali and Montanvert 1997). The area of a twig goes to the vertex where it grew.

use super::medial::{Medial, Vertex};
use super::moments::Moments;

/// A vertex nearer than this to the outline is one of its corners (database units).
pub(super) const CORNER: f64 = 1e-3;
/// A branch that protrudes by less than this fraction of its own width is a bump (1).
const BUMP: f64 = 0.75;

/// The medial axis without twigs.
#[derive(Debug)]
pub(super) struct Skeleton<'a> {
    pub(super) axis: &'a Medial,
    /// Which edges are left.
    pub(super) alive: Vec<bool>,
    /// Area of the twigs that grew at each vertex.
    pub(super) own: Vec<Moments>,
    /// Where the area of a vertex or an edge that was cut off went; itself for what is left.
    home: Vec<u32>,
    degree: Vec<u32>,
    /// Edges at each vertex: those of vertex v are `at[start[v]..start[v + 1]]`.
    start: Vec<u32>,
    at: Vec<u32>,
}

impl<'a> Skeleton<'a> {
    /// Cuts the twigs off. Cost: linear.
    pub(super) fn of(axis: &'a Medial) -> Self {
        let count = axis.vertices.len();
        let mut start = vec![0u32; count + 1];
        for v in axis.edges.iter().flat_map(|e| e.ends) {
            start[v as usize + 1] += 1;
        }
        let degree = start[1..].to_vec();
        for v in 0..count {
            start[v + 1] += start[v];
        }
        let (mut fill, mut at) = (start.clone(), vec![0u32; 2 * axis.edges.len()]);
        for (k, edge) in axis.edges.iter().enumerate() {
            for v in edge.ends {
                at[fill[v as usize] as usize] = k as u32;
                fill[v as usize] += 1;
            }
        }
        let alive = vec![true; axis.edges.len()];
        let home = (0..count as u32).collect();
        let mut skeleton = Self { axis, alive, own: vec![Moments::default(); count], home, degree, start, at };
        skeleton.cut_corners();
        skeleton.cut_bumps();
        skeleton
    }

    pub(super) fn vertex(&self, v: u32) -> &Vertex {
        &self.axis.vertices[v as usize]
    }

    /// Edges that are left at a vertex.
    pub(super) fn degree(&self, v: u32) -> u32 {
        self.degree[v as usize]
    }

    /// The edges that are left at a vertex.
    pub(super) fn around(&self, v: u32) -> impl Iterator<Item = u32> {
        let range = self.start[v as usize] as usize..self.start[v as usize + 1] as usize;
        self.at[range].iter().copied().filter(|e| self.alive[*e as usize])
    }

    /// The other end of an edge.
    pub(super) fn across(&self, e: u32, v: u32) -> u32 {
        let [a, b] = self.axis.edges[e as usize].ends;
        if a == v { b } else { a }
    }

    pub(super) fn length(&self, e: u32) -> f64 {
        let [p, q] = self.axis.edges[e as usize].ends.map(|v| self.vertex(v).at);
        (p[0] - q[0]).hypot(p[1] - q[1])
    }

    /// The edges from a leaf to the next vertex where three met by `degree`, and that vertex; none where the other end is a leaf.
    fn twig(&self, leaf: u32, degree: &[u32]) -> Option<(Vec<u32>, u32)> {
        let (mut edges, mut v) = (Vec::new(), leaf);
        let mut e = self.around(v).next()?;
        loop {
            edges.push(e);
            v = self.across(e, v);
            match degree[v as usize] {
                2 => e = self.around(v).find(|next| *next != e)?,
                1 => return None,
                _ => return Some((edges, v)),
            }
        }
    }

    fn cut(&mut self, edges: &[u32], to: u32) {
        for e in edges {
            let mut moments = self.axis.edges[*e as usize].cell;
            self.alive[*e as usize] = false;
            for v in self.axis.edges[*e as usize].ends {
                self.degree[v as usize] -= 1;
                if v != to {
                    self.home[v as usize] = to;
                    moments += std::mem::take(&mut self.own[v as usize]);
                }
            }
            self.own[to as usize] += moments;
        }
    }

    /// The vertex that is left and has the area of an edge that was cut off.
    pub(super) fn home(&self, edge: u32) -> u32 {
        let [a, b] = self.axis.edges[edge as usize].ends;
        let mut v = if self.home[a as usize] == a { b } else { a };
        // a twig of several edges leads there vertex by vertex
        while self.home[v as usize] != v {
            v = self.home[v as usize];
        }
        v
    }

    fn cut_corners(&mut self) {
        // where three edges met, a limb continues when two of them were cut
        let met = self.degree.clone();
        for v in 0..self.degree.len() as u32 {
            if self.degree(v) == 1 && self.vertex(v).r < CORNER {
                let only = self.around(v).next();
                if let Some((edges, to)) = self.twig(v, &met) {
                    self.cut(&edges, to);
                } else if let Some(e) = only {
                    let to = self.across(e, v);
                    self.cut(&[e], to);
                }
            }
        }
    }

    fn cut_bumps(&mut self) {
        let mut leaves: Vec<u32> = (0..self.degree.len() as u32).filter(|v| self.degree(*v) == 1).collect();
        // narrow ones first: their parent branch may be a bump itself
        leaves.sort_by(|a, b| self.vertex(*a).r.total_cmp(&self.vertex(*b).r).then(a.cmp(b)));
        let mut next = 0;
        while let Some(&leaf) = leaves.get(next) {
            next += 1;
            if self.degree(leaf) != 1 {
                continue;
            }
            let Some((edges, to)) = self.twig(leaf, &self.degree) else { continue };
            let (u, v) = (self.vertex(leaf).r, self.vertex(to).r);
            let length: f64 = edges.iter().map(|e| self.length(*e)).sum();
            if u <= v && length + u - v < BUMP * 2.0 * u {
                self.cut(&edges, to);
                if self.degree(to) == 1 {
                    leaves.push(to);
                }
            }
        }
    }
}
