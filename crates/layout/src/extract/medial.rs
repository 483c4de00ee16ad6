//! The medial axis of a polygon with holes: the inner part of the Voronoi diagram of its edges (Blum 1967; Fortune 1987).
//!
//! Every edge of the axis runs midway between two *sites*: an edge of the polygon, or a corner that points inwards. Where both are
//! edges that face each other the axis is the exact centreline of a strip, and twice the distance to them its width. The quadrangles
//! between edges of the axis and their sites tile the polygon, so that every part of its area belongs to one edge.
//!
//! Coordinates are database units from the lower left corner of the polygon's box: a moved polygon has the same axis, bit by bit.

use super::moments::Moments;
use crate::drawing::{GridPoint, Polygon};
use boostvoronoi::prelude::{Builder, BvError, Diagram, SourceCategory};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Boundary element from which an edge of the axis keeps its distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundarySite {
    /// The polygon's edge from the point of this number to the next one of its contour.
    Side(u32),
    /// The point of this number.
    Corner(u32),
}

/// A point of the axis.
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    /// Its place.
    pub at: [f64; 2],
    /// Distance to its sites: 0 in a corner of the polygon that points outwards.
    pub r: f64,
}

/// An edge of the axis.
#[derive(Debug, Clone, Copy)]
pub struct AxisEdge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// The boundary elements on both sides.
    pub sites: [BoundarySite; 2],
    /// The area between them.
    pub cell: Moments,
}

/// The medial axis of one polygon.
#[derive(Debug, Clone, Default)]
pub struct Medial {
    /// The polygon's points, contour by contour.
    pub points: Vec<[f64; 2]>,
    /// For each point, the one after it on its contour.
    pub next: Vec<u32>,
    /// For each point, the one before it on its contour.
    previous: Vec<u32>,
    /// Points of the axis.
    pub vertices: Vec<Vertex>,
    /// Edges of the axis.
    pub edges: Vec<AxisEdge>,
}

/// The diagram of a polygon's edges could not be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("its medial axis could not be computed ({0})")]
pub struct AxisError(String);

impl From<BvError> for AxisError {
    fn from(why: BvError) -> Self {
        Self(why.to_string())
    }
}

/// The Voronoi diagram of segments. Its predicates give up on some outlines that are a few database units wide by a panic.
fn diagram(segments: &[[i32; 4]]) -> Result<Diagram, AxisError> {
    let build = || Ok(Builder::<i32>::default().with_segments(segments.iter())?.build()?);
    MAY_PANIC.set(true);
    let built = catch_unwind(AssertUnwindSafe(build));
    MAY_PANIC.set(false);
    built.unwrap_or_else(|_| Err(AxisError("its edges are too close together".to_owned())))
}

thread_local! {
    static MAY_PANIC: Cell<bool> = const { Cell::new(false) };
}

/// True while this thread does what may end in a panic that is caught: a program's hook has nothing to say of it.
pub fn may_panic() -> bool {
    MAY_PANIC.get()
}

const NOWHERE: u32 = u32::MAX;

impl Medial {
    /// The axis of a polygon whose contours neither cross nor touch along edges.
    ///
    /// # Errors
    /// The diagram could not be made.
    pub fn of(polygon: &Polygon) -> Result<Self, AxisError> {
        let split = super::snap::split(polygon);
        let polygon = split.as_ref().unwrap_or(polygon);
        let [origin, _] = polygon.extent().unwrap_or_default();
        let mut axis = Self::default();
        let mut segments: Vec<[i32; 4]> = Vec::new();
        for contour in &polygon.contours {
            let first = axis.points.len() as u32;
            let shifted: Vec<GridPoint> = contour.iter().map(|p| [p[0] - origin[0], p[1] - origin[1]]).collect();
            for (k, (p, q)) in shifted.iter().zip(shifted.iter().cycle().skip(1)).enumerate() {
                axis.points.push([f64::from(p[0]), f64::from(p[1])]);
                axis.next.push(if k + 1 == shifted.len() { first } else { first + k as u32 + 1 });
                axis.previous.push(first + ((k + shifted.len() - 1) % shifted.len()) as u32);
                segments.push([p[0], p[1], q[0], q[1]]);
            }
        }
        let diagram = diagram(&segments)?;
        let cells = diagram.cells();
        let site = |cell: usize| {
            let (source, category) = cells[cell].source_index_2();
            let k = source.usize();
            match category {
                SourceCategory::SegmentStart | SourceCategory::SinglePoint => BoundarySite::Corner(k as u32),
                SourceCategory::SegmentEnd => BoundarySite::Corner(axis.next[k]),
                SourceCategory::Segment => BoundarySite::Side(k as u32),
            }
        };
        let places: Vec<[f64; 2]> = diagram.vertices().iter().map(|v| [v.x(), v.y()]).collect();
        // Candidates: finite primary edges, each once, with a verdict where one side decides it.
        let mut found: Vec<([u32; 2], [BoundarySite; 2], Option<bool>)> = Vec::new();
        for edge in diagram.edges() {
            let twin = edge.twin()?;
            if edge.is_secondary() || twin.usize() < edge.id().usize() {
                continue;
            }
            let other = diagram.edge(twin)?;
            let (Some(a), Some(b)) = (edge.vertex0(), other.vertex0()) else { continue };
            let sites = [site(edge.cell()?.usize()), site(other.cell()?.usize())];
            let ends = [a.usize() as u32, b.usize() as u32];
            let verdict = sites.iter().find_map(|s| match s {
                BoundarySite::Side(k) => {
                    let left = axis.left_of(*k, places[a.usize()]) + axis.left_of(*k, places[b.usize()]);
                    Some(left > 0.0)
                }
                BoundarySite::Corner(_) => None,
            });
            found.push((ends, sites, verdict));
        }
        let inside = spread(&places, &found, |v, s| axis.distance(s, places[v as usize]));
        let mut number = vec![NOWHERE; places.len()];
        for (k, (ends, sites, _)) in found.into_iter().enumerate() {
            if !inside[k] {
                continue;
            }
            let ends = ends.map(|v| {
                let n = &mut number[v as usize];
                if *n == NOWHERE {
                    *n = axis.vertices.len() as u32;
                    let at = places[v as usize];
                    axis.vertices.push(Vertex { at, r: axis.distance(sites[0], at) });
                }
                *n
            });
            let cell = axis.cell(ends, sites);
            axis.edges.push(AxisEdge { ends, sites, cell });
        }
        Ok(axis)
    }

    /// The side that ends where this one starts.
    pub fn before(&self, k: u32) -> u32 {
        self.previous[k as usize]
    }

    /// Start and end of a side.
    pub fn side(&self, k: u32) -> [[f64; 2]; 2] {
        [self.points[k as usize], self.points[self.next[k as usize] as usize]]
    }

    /// Twice the area of the triangle over a side: positive on its left, inside.
    fn left_of(&self, k: u32, p: [f64; 2]) -> f64 {
        let [a, b] = self.side(k);
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    }

    /// The point of a site nearest to `p`, which lies in the site's cell.
    pub fn foot(&self, site: BoundarySite, p: [f64; 2]) -> [f64; 2] {
        match site {
            BoundarySite::Corner(k) => self.points[k as usize],
            BoundarySite::Side(k) => {
                let [a, b] = self.side(k);
                let d = [b[0] - a[0], b[1] - a[1]];
                let t = ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / (d[0] * d[0] + d[1] * d[1]);
                let t = t.clamp(0.0, 1.0);
                [a[0] + t * d[0], a[1] + t * d[1]]
            }
        }
    }

    fn distance(&self, site: BoundarySite, p: [f64; 2]) -> f64 {
        let f = self.foot(site, p);
        (p[0] - f[0]).hypot(p[1] - f[1])
    }

    /// Corners of the area of an edge: from vertex to vertex over the feet on both sites.
    pub fn outline(&self, ends: [u32; 2], sites: [BoundarySite; 2]) -> [[f64; 2]; 6] {
        let [p, q] = ends.map(|v| self.vertices[v as usize].at);
        let [a, b] = sites;
        [p, self.foot(a, p), self.foot(a, q), q, self.foot(b, q), self.foot(b, p)]
    }

    fn cell(&self, ends: [u32; 2], sites: [BoundarySite; 2]) -> Moments {
        Moments::of(&self.outline(ends, sites))
    }
}

/// Inner edges: those decided by a side, and those between two corners that are connected with them.
fn spread(
    places: &[[f64; 2]],
    found: &[([u32; 2], [BoundarySite; 2], Option<bool>)],
    distance: impl Fn(u32, BoundarySite) -> f64,
) -> Vec<bool> {
    let mut verdict = vec![None; places.len()];
    let mut inside: Vec<Option<bool>> = found.iter().map(|f| f.2).collect();
    for (ends, sites, known) in found {
        for v in ends {
            // corners of the polygon belong to inner and outer edges alike
            if known.is_some() && distance(*v, sites[0]) > 0.0 {
                verdict[*v as usize] = *known;
            }
        }
    }
    // edges at each vertex that wait for a verdict
    let mut waiting: std::collections::HashMap<u32, Vec<usize>> = std::collections::HashMap::new();
    for k in (0..found.len()).filter(|k| inside[*k].is_none()) {
        found[k].0.iter().for_each(|v| waiting.entry(*v).or_default().push(k));
    }
    let mut open: Vec<u32> = (0..places.len() as u32).filter(|v| verdict[*v as usize].is_some()).collect();
    while let Some(v) = open.pop() {
        let known = verdict[v as usize];
        for k in waiting.remove(&v).unwrap_or_default() {
            if inside[k].is_some() {
                continue;
            }
            inside[k] = known;
            for u in found[k].0 {
                if verdict[u as usize].is_none() {
                    verdict[u as usize] = known;
                    open.push(u);
                }
            }
        }
    }
    inside.into_iter().map(|known| known == Some(true)).collect()
}
