//! Facing beams in tiles of eight stretches, laid out in lanes: what their stations are and how long the stretches are.
//!
//! Eight stretches in a row lie between at most nine stations of either side. The first of these is the last of the tile before, so that eight lanes hold both.

use super::approach::MaterialPoint;
use super::facing_side::{EndWeights, Flank};
use super::facing_stretches::CubicStretch;
use bimorph_multibody::BodyId;
use bimorph_multibody::batch::{LANES, Lane8};
use bimorph_multibody::planar::Pose;

/// Stretches of a tile.
pub(super) const STRETCHES: usize = LANES;
/// Stations of a side of a tile.
pub(super) const STATIONS: usize = STRETCHES + 1;
/// No body: ground, or a lane without a station.
const NONE: u32 = u32::MAX;

/// Stretches in a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tile {
    /// Their place among all.
    pub(super) stretches: std::ops::Range<usize>,
    /// Their lengths; 0 in lanes without a stretch.
    pub(super) length: Lane8,
    /// The stations of each side that moves.
    pub(super) sides: [Option<TileSide>; 2],
}

/// The stations of one side of a tile.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TileSide {
    /// Bodies that bear them.
    pub(super) bodies: [u32; STATIONS],
    /// The first of them.
    pub(super) first: MaterialPoint,
    /// From the centre of mass of its body to each of the others as drawn.
    pub(super) arm: [Lane8; 2],
    /// The first is the last of the tile before.
    pub(super) follows: bool,
    /// Where the stretches are not the segments between the stations: how they follow.
    pub(super) cut: Option<Box<[SegmentPart; STRETCHES]>>,
    /// The bodies in the lanes, where they are neighbours.
    run: Option<BodyRun>,
}

/// A stretch as a part of a segment.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct SegmentPart {
    /// Number of the station where the segment begins.
    pub(super) from: usize,
    /// From the ends of the segment to those of the stretch.
    pub(super) weights: EndWeights,
}

/// Displacement along the axis (m), slope along the gap (1), ∂w/∂θ and ∂²w/∂θ² (m) of a station.
pub(super) const QUANTITIES: usize = 4;

/// Stations of a side at a configuration.
#[derive(Clone, Copy)]
pub(super) struct SeenStations {
    /// The first.
    pub(super) first: [f64; QUANTITIES],
    /// The others.
    pub(super) own: [Lane8; QUANTITIES],
}

impl SeenStations {
    pub(super) const NONE: Self = Self { first: [0.0; QUANTITIES], own: [Lane8::NONE; QUANTITIES] };

    /// A quantity of station `k`.
    #[inline(always)]
    pub(super) fn of(&self, quantity: usize, k: usize) -> f64 {
        if k == 0 { self.first[quantity] } else { self.own[quantity].0[k - 1] }
    }

    /// A quantity of the stations where stretches begin.
    #[inline(always)]
    pub(super) fn starts(&self, quantity: usize) -> Lane8 {
        let mut starts = self.own[quantity];
        starts.0.copy_within(..LANES - 1, 1);
        starts.0[0] = self.first[quantity];
        starts
    }
}

/// A number of each stretch in the lane before it; 0 in the last.
#[inline(always)]
pub(super) fn following(of: &Lane8) -> Lane8 {
    let mut following = *of;
    following.0.copy_within(1.., 0);
    following.0[LANES - 1] = 0.0;
    following
}

/// Bodies of the stations but the first, where each lane has one and they are neighbours in the order of elimination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BodyRun {
    /// The lowest.
    from: usize,
    /// They descend from lane to lane.
    down: bool,
}

impl BodyRun {
    fn of(bodies: &[u32; STATIONS]) -> Option<Self> {
        let own = &bodies[1..];
        if own.contains(&NONE) {
            return None;
        }
        let run = |down: bool| Self { from: own[if down { LANES - 1 } else { 0 }] as usize, down };
        let steps = |step: i64| own.windows(2).all(|pair| i64::from(pair[1]) - i64::from(pair[0]) == step);
        if steps(1) {
            Some(run(false))
        } else if steps(-1) {
            Some(run(true))
        } else {
            None
        }
    }
}

/// Poses in lanes, lane by lane or against them.
#[inline(always)]
fn spread<const DOWN: bool>(from: &[Pose; LANES], to: &mut [Lane8; 3]) {
    for lane in 0..LANES {
        let pose = &from[if DOWN { LANES - 1 - lane } else { lane }];
        (to[0].0[lane], to[1].0[lane], to[2].0[lane]) = (pose.x, pose.y, pose.z);
    }
}

/// Adds poses in lanes, lane by lane or against them.
#[inline(always)]
fn add_spread<const DOWN: bool>(from: &[Lane8; 3], to: &mut [Pose; LANES]) {
    for lane in 0..LANES {
        let pose = &mut to[if DOWN { LANES - 1 - lane } else { lane }];
        *pose += Pose::new(from[0].0[lane], from[1].0[lane], from[2].0[lane]);
    }
}

impl Tile {
    /// The tiles of all stretches between two sides, but those between anchored stations: nothing there moves.
    pub(super) fn all(sides: &[Flank; 2], stretches: &[CubicStretch]) -> Vec<Self> {
        let mut tiles = Vec::with_capacity(stretches.len().div_ceil(STRETCHES));
        let moves = |stretch: &CubicStretch| {
            sides.iter().zip(stretch.segments).any(|(side, from)| {
                side.stations[from..from + 2].iter().any(|station| station.point.body != BodyId::Ground)
            })
        };
        let (mut begin, mut before) = (0, [None; 2]);
        while let Some(skipped) = stretches[begin..].iter().position(moves) {
            begin += skipped;
            // segments so short that a cut stands for both their ends are skipped by stretches
            let fits = |end: &usize| {
                let spans = |side: usize| stretches[end - 1].segments[side] - stretches[begin].segments[side];
                (0..2).all(|side| sides[side].fixed || spans(side) < STRETCHES)
            };
            let most = stretches.len().min(begin + STRETCHES);
            let end = (begin + 1..=most).rev().find(fits).unwrap_or(begin + 1);
            let (length, own) = (Lane8::NONE, &stretches[begin..end]);
            let mut tile = Self { stretches: begin..end, length, sides: [None, None] };
            for (lane, stretch) in own.iter().enumerate() {
                tile.length.0[lane] = stretch.facing.length;
            }
            for (side, flank) in sides.iter().enumerate().filter(|(_, flank)| !flank.fixed) {
                tile.sides[side] = Some(TileSide::new(flank, own, side, before[side]));
                let [first, last] = [begin, end - 1].map(|stretch| stretches[stretch].segments[side]);
                // in the last lane
                before[side] = (last + 1 - first == STRETCHES).then_some(last + 1);
            }
            tiles.push(tile);
            begin = end;
        }
        tiles
    }
}

impl TileSide {
    /// `before` is the station in the last lane of the tile before.
    fn new(flank: &Flank, stretches: &[CubicStretch], side: usize, before: Option<usize>) -> Self {
        let first = stretches[0].segments[side];
        let (mut bodies, mut arm) = ([NONE; STATIONS], [Lane8::NONE; 2]);
        let last = stretches[stretches.len() - 1].segments[side] + 1;
        for (k, station) in flank.stations[first..=last].iter().enumerate() {
            if let BodyId::Free(body) = station.point.body {
                bodies[k] = body as u32;
                if let Some(lane) = k.checked_sub(1) {
                    (arm[0].0[lane], arm[1].0[lane]) = (station.point.arm.x, station.point.arm.y);
                }
            }
        }
        let part = |lane: usize| {
            let stretch = stretches.get(lane)?;
            Some(SegmentPart { from: stretch.segments[side] - first, weights: stretch.weights[side].clone() })
        };
        let whole = |lane| part(lane).is_none_or(|part| part.from == lane && part.weights.is_none());
        let cut =
            (!(0..STRETCHES).all(whole)).then(|| Box::new(std::array::from_fn(|lane| part(lane).unwrap_or_default())));
        let run = BodyRun::of(&bodies);
        Self { bodies, first: flank.stations[first].point, arm, follows: before == Some(first), cut, run }
    }

    /// The body of a station; none: ground, or no station.
    #[inline(always)]
    pub(super) fn body(&self, k: usize) -> Option<usize> {
        (self.bodies[k] != NONE).then_some(self.bodies[k] as usize)
    }

    /// Of displacements `q` of all bodies those in the lanes.
    #[inline(always)]
    pub(super) fn poses(&self, q: &[Pose]) -> [Lane8; 3] {
        let mut poses = [Lane8::NONE; 3];
        if let Some(run) = &self.run
            && let Some(of) = q[run.from..].first_chunk::<LANES>()
        {
            if run.down {
                spread::<true>(of, &mut poses)
            } else {
                spread::<false>(of, &mut poses)
            }
            return poses;
        }
        for lane in 0..LANES {
            if let Some(body) = self.body(lane + 1) {
                let pose = &q[body];
                (poses[0].0[lane], poses[1].0[lane], poses[2].0[lane]) = (pose.x, pose.y, pose.z);
            }
        }
        poses
    }

    /// Adds forces in lanes to those of all bodies.
    #[inline(always)]
    pub(super) fn add_poses(&self, poses: &[Lane8; 3], r: &mut [Pose]) {
        if let Some(run) = &self.run
            && let Some(to) = r[run.from..].first_chunk_mut::<LANES>()
        {
            return if run.down { add_spread::<true>(poses, to) } else { add_spread::<false>(poses, to) };
        }
        for lane in 0..LANES {
            if let Some(body) = self.body(lane + 1) {
                r[body] += Pose::new(poses[0].0[lane], poses[1].0[lane], poses[2].0[lane]);
            }
        }
    }
}
