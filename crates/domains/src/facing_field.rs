//! Forces of the field and of contact along facing beams, and their derivatives, tile by tile: a station, then a stretch in each lane.
//!
//! Each station is evaluated once for both its stretches, and so are its force and its own block of the tangent. Forces and tangent come from one evaluation of
//! the field. Contact is evaluated stretch by stretch, where a bound of the cubics does not leave a tile apart.

use super::domain::Configuration;
use super::facing::FacingStretch;
use super::facing_lanes::derivatives;
use super::facing_local::{FacingBeams, SIGNS};
use super::facing_side::{Opening, back, onto};
use super::facing_tangent::{self, PLACES, add_block, block, couple, matrix};
use super::facing_tiles::{STATIONS, STRETCHES, SeenStations, SegmentPart, Tile, TileSide, following};
use bimorph_multibody::batch::{Kernel, LANES, Lane8, SimdReal, load, store};
use bimorph_multibody::planar::{HalfTurn, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use nalgebra::Vector4;

/// Forces to be added: those of the field with −½V² (or its change with V), and those of contact.
pub(super) struct FieldForces<'a> {
    pub(super) beams: &'a FacingBeams,
    pub(super) at: Configuration<'a>,
    /// Factor on the derivatives of the capacitance (V²).
    pub(super) factor: f64,
    /// Contact acts, too.
    pub(super) contact: bool,
    /// To which forces are added.
    pub(super) r: Option<&'a mut [Pose]>,
    /// To which their derivatives are added.
    pub(super) tangent: Option<(&'a Pattern, &'a mut BodyMatrix)>,
    /// Becomes false where a bound of the cubics does not leave both sides apart.
    pub(super) apart: Option<&'a mut bool>,
}

/// First and second derivatives over the ends (w₁, φ₁, w₂, φ₂) of the stretches.
struct StretchSums {
    first: [Lane8; 4],
    second: [Lane8; 10],
}

/// The same over the stations of a side: forces, own derivatives, and those of each with the next station.
struct StationSums {
    first: [[f64; STATIONS]; 2],
    own: [[f64; STATIONS]; 3],
    next: [[f64; STRETCHES]; 4],
}

impl Kernel for FieldForces<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(mut self, simd: W::Simd) {
        if self.tangent.is_some() { self.all::<W, true>(simd) } else { self.all::<W, false>(simd) }
    }
}

impl FieldForces<'_> {
    #[inline(always)]
    fn all<W: SimdReal, const CURVED: bool>(&mut self, simd: W::Simd) {
        let (beams, mut seen) = (self.beams, [SeenStations::NONE; 2]);
        for tile in &beams.tiles {
            let z = self.ends::<W, CURVED>(simd, tile, &mut seen);
            let facing = &beams.stretches[tile.stretches.start].facing;
            let length = W::load(simd, &tile.length);
            let scaled = [z[0], z[1] * length, z[2], z[3] * length];
            let open = !self.contact || apart(scaled, facing.gap - facing.touch);
            if !open && let Some(apart) = &mut self.apart {
                **apart = false;
            }
            if open && self.factor == 0.0 {
                continue;
            }
            let (mut first, mut second) = ([W::splat(simd, 0.0); 4], [W::splat(simd, 0.0); 10]);
            if self.factor != 0.0 {
                derivatives::<W, CURVED>(simd, facing, (scaled, length), self.factor, (&mut first, &mut second));
            }
            if open && tile.sides.iter().flatten().all(|own| own.cut.is_none()) {
                self.add_forces(simd, tile, &seen, first);
                if CURVED {
                    self.add_tangents(simd, tile, &seen, (first, second));
                }
                continue;
            }
            let mut sums = StretchSums { first: [Lane8::NONE; 4], second: [Lane8::NONE; 10] };
            store(first, &mut sums.first);
            store(second, &mut sums.second);
            if !open {
                let mut ends = [Lane8::NONE; 4];
                store(z, &mut ends);
                for (lane, stretch) in beams.stretches[tile.stretches.clone()].iter().enumerate() {
                    sums.add_contact(lane, &stretch.facing, &Vector4::from(ends.map(|z| z.0[lane])));
                }
            }
            self.add_all(tile, &seen, &sums);
        }
    }

    /// The ends of the stretches; `seen` is that of the tile before, and becomes that of the tile.
    #[inline(always)]
    fn ends<W: SimdReal, const CURVED: bool>(
        &self,
        simd: W::Simd,
        tile: &Tile,
        seen: &mut [SeenStations; 2],
    ) -> [W; 4] {
        let mut z = [W::splat(simd, 0.0); 4];
        for (side, own) in tile.sides.iter().enumerate() {
            let Some(own) = own else { continue };
            let seen = &mut seen[side];
            stations::<W, CURVED>(simd, &self.beams.frame, own, self.at, seen);
            let ends = match &own.cut {
                None => [&seen.starts(0), &seen.starts(1), &seen.own[0], &seen.own[1]].map(|end| W::load(simd, end)),
                Some(cut) => load(simd, &cut_ends(cut, seen)),
            };
            for (z, end) in z.iter_mut().zip(ends) {
                *z = if side == 0 { end } else { *z - end };
            }
        }
        z
    }

    /// Adds the forces of what is `first` over the ends of stretches that are the segments of both sides.
    #[inline(always)]
    fn add_forces<W: SimdReal>(&mut self, simd: W::Simd, tile: &Tile, seen: &[SeenStations; 2], first: [W; 4]) {
        let Opening { axis, side: turn } = self.beams.frame;
        let Some(r) = &mut self.r else { return };
        let mut over = [Lane8::NONE; 4];
        store(first, &mut over);
        let [starts, turned, ..] = over;
        let following = [&starts, &turned].map(following);
        for (side, own) in tile.sides.iter().enumerate() {
            let Some(own) = own else { continue };
            let (sign, seen) = (SIGNS[side], &seen[side]);
            let force = (first[2] + W::load(simd, &following[0])) * sign;
            let moment = (first[3] + W::load(simd, &following[1])) * (sign * turn);
            let mut pose = [Lane8::NONE; 3];
            store([force * axis.x, force * axis.y, W::load(simd, &seen.own[2]) * force + moment], &mut pose);
            if let Some(body) = own.body(0) {
                let (force, moment) = (sign * starts.0[0], sign * turn * turned.0[0]);
                r[body] += Pose::new(force * axis.x, force * axis.y, seen.first[2] * force + moment);
            }
            own.add_poses(&pose, r);
        }
    }

    /// Adds the derivatives of forces that are `first` and `second` over the ends of such stretches.
    #[inline(always)]
    fn add_tangents<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        tile: &Tile,
        seen: &[SeenStations; 2],
        (first, second): ([W; 4], [W; 10]),
    ) {
        let Some((pattern, tangent)) = &mut self.tangent else { return };
        let (mut force, mut curved) = ([Lane8::NONE; 4], [Lane8::NONE; 10]);
        store(first, &mut force);
        store(second, &mut curved);
        for (side, own) in tile.sides.iter().enumerate() {
            let Some(own) = own else { continue };
            let sums = (&force, &curved, SIGNS[side]);
            facing_tangent::add_side::<W>(simd, &self.beams.frame, (own, &seen[side]), sums, pattern, tangent);
        }
        if let [Some(upper), Some(lower)] = &tile.sides {
            for lane in 0..tile.stretches.len() {
                let ends = [(upper, &seen[0]), (lower, &seen[1])];
                couple(&self.beams.frame, lane, ends, &matrix(&curved, lane), pattern, tangent);
            }
        }
    }

    /// Adds what is `sums` over the ends of the stretches.
    #[inline(always)]
    fn add_all(&mut self, tile: &Tile, seen: &[SeenStations; 2], sums: &StretchSums) {
        for (side, own) in tile.sides.iter().enumerate() {
            if let Some(own) = own {
                let over = over_stations(own, sums, self.tangent.is_some());
                self.add_side(own, &seen[side], SIGNS[side], &over);
            }
        }
        if let ([Some(upper), Some(lower)], Some((pattern, tangent))) = (&tile.sides, &mut self.tangent) {
            for lane in 0..tile.stretches.len() {
                let ends = [(upper, &seen[0]), (lower, &seen[1])];
                couple(&self.beams.frame, lane, ends, &matrix(&sums.second, lane), pattern, tangent);
            }
        }
    }

    /// Adds what is `sums` over the stations of a side.
    #[inline(always)]
    fn add_side(&mut self, own: &TileSide, seen: &SeenStations, sign: f64, sums: &StationSums) {
        let Opening { axis, side } = self.beams.frame;
        if let Some(r) = &mut self.r {
            for k in 0..STATIONS {
                let Some(body) = own.body(k) else { continue };
                let (force, moment) = (sign * sums.first[0][k], sign * sums.first[1][k]);
                r[body] += Pose::new(axis.x * force, axis.y * force, seen.of(2, k) * force + side * moment);
            }
        }
        let Some((pattern, tangent)) = &mut self.tangent else { return };
        for k in 0..STATIONS {
            let Some(body) = own.body(k) else { continue };
            let [h, mixed, turned] = sums.own.map(|own| own[k]);
            let lever = seen.of(2, k);
            let mut block = block(&self.beams.frame, [lever, lever], [h, mixed, mixed, turned]);
            block[(2, 2)] += sign * sums.first[0][k] * seen.of(3, k);
            tangent.diagonal[body] += block;
            let next = if k + 1 < STATIONS { own.body(k + 1) } else { None };
            if let Some(next) = next {
                let levers = [lever, seen.of(2, k + 1)];
                let block = self::block(&self.beams.frame, levers, sums.next.map(|h| h[k]));
                add_block([body, next], &block, pattern, tangent);
            }
        }
    }
}

/// Stations of a side at a configuration; `seen` is that of the tile before.
#[inline(always)]
fn stations<W: SimdReal, const CURVED: bool>(
    simd: W::Simd,
    frame: &Opening,
    own: &TileSide,
    at: Configuration<'_>,
    seen: &mut SeenStations,
) {
    seen.first = if own.follows {
        seen.own.map(|of| of.0[LANES - 1])
    } else {
        let first = frame.deflection(&own.first, at.q, at.linear);
        [first.w, first.slope, first.gradient.z, first.bend]
    };
    let poses = own.poses(at.q);
    let [x, y, turn] = load::<W, 3>(simd, &poses);
    let arm = load::<W, 2>(simd, &own.arm);
    let (nx, ny) = (frame.axis.x, frame.axis.y);
    let (moved, lies) = if at.linear {
        ([-(arm[1] * turn), arm[0] * turn], arm)
    } else {
        let (sin, cos) = (turn * 0.5).sin_cos(simd);
        let moved = HalfTurn::of([sin, cos]).rotation_minus_identity(arm);
        (moved, [arm[0] + moved[0], arm[1] + moved[1]])
    };
    let w = (x + moved[0]) * nx + (y + moved[1]) * ny;
    let [deflection, slope, lever, bend] = &mut seen.own;
    w.store(deflection);
    (turn * frame.side).store(slope);
    (lies[0] * ny - lies[1] * nx).store(lever);
    if CURVED {
        let bent = if at.linear { W::splat(simd, 0.0) } else { -(lies[0] * nx + lies[1] * ny) };
        bent.store(bend);
    }
}

/// Ends of stretches that are parts of segments.
fn cut_ends(cut: &[SegmentPart; STRETCHES], seen: &SeenStations) -> [Lane8; 4] {
    let mut ends = [Lane8::NONE; 4];
    for (lane, part) in cut.iter().enumerate() {
        let k = part.from;
        let z = onto(&part.weights, Vector4::new(seen.of(0, k), seen.of(1, k), seen.of(0, k + 1), seen.of(1, k + 1)));
        for (end, z) in ends.iter_mut().zip(z.iter()) {
            end.0[lane] = *z;
        }
    }
    ends
}

/// True where the cubics of all stretches come closer by at most `room` (m), as their Bernstein coefficients do; slopes times length.
#[inline(always)]
fn apart<W: SimdReal>([w, slope, w_end, slope_end]: [W; 4], room: f64) -> bool {
    let (near, far) = (w + slope * (1.0 / 3.0), w_end - slope_end * (1.0 / 3.0));
    let mut most = Lane8::NONE;
    (-w).max(-near).max((-far).max(-w_end)).store(&mut most);
    let mut open = true;
    for way in most.0 {
        open &= way <= room;
    }
    open
}

impl StretchSums {
    /// Adds the contact of a stretch whose ends lie at `z`.
    #[cold]
    #[inline(never)]
    fn add_contact(&mut self, lane: usize, facing: &FacingStretch, z: &Vector4<f64>) {
        let (first, second) = facing.contact(z);
        for (sum, x) in self.first.iter_mut().zip(first.iter()) {
            sum.0[lane] += x;
        }
        for (sum, place) in self.second.iter_mut().zip(PLACES) {
            sum.0[lane] += second[place];
        }
    }
}

/// Sums over the stations of a side, from those over the stretches; second derivatives where it is `curved`.
fn over_stations(own: &TileSide, sums: &StretchSums, curved: bool) -> StationSums {
    let mut over = StationSums { first: [[0.0; STATIONS]; 2], own: [[0.0; STATIONS]; 3], next: [[0.0; STRETCHES]; 4] };
    let Some(cut) = &own.cut else {
        let s = &sums.second;
        for lane in 0..STRETCHES {
            for i in 0..2 {
                over.first[i][lane] += sums.first[i].0[lane];
                over.first[i][lane + 1] += sums.first[2 + i].0[lane];
            }
            if curved {
                for (own, [start, end]) in over.own.iter_mut().zip([[0, 7], [1, 8], [4, 9]]) {
                    own[lane] += s[start].0[lane];
                    own[lane + 1] += s[end].0[lane];
                }
                for (next, place) in over.next.iter_mut().zip([2, 3, 5, 6]) {
                    next[lane] = s[place].0[lane];
                }
            }
        }
        return over;
    };
    for (lane, part) in cut.iter().enumerate() {
        let first = back(&part.weights, Vector4::from(sums.first.map(|sum| sum.0[lane])));
        let (a, b) = (part.from, part.from + 1);
        for i in 0..2 {
            over.first[i][a] += first[i];
            over.first[i][b] += first[2 + i];
        }
        if curved {
            let mut h = matrix(&sums.second, lane);
            if let Some(weights) = &part.weights {
                h = weights.tr_mul(&h) * **weights;
            }
            for (k, (i, j)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                over.own[k][a] += h[(i, j)];
                over.own[k][b] += h[(2 + i, 2 + j)];
            }
            for (k, (i, j)) in [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().enumerate() {
                over.next[k][a] += h[(i, 2 + j)];
            }
        }
    }
    over
}

#[cfg(test)]
mod tests {
    use super::super::approach::MaterialPoint;
    use super::super::contact_loss::Loss;
    use super::super::domain::Domain;
    use super::super::edge_field::EdgeField;
    use super::super::facing_side::Flank;
    use super::super::facing_stretches::{CubicStretch, stretches};
    use super::super::from_structure::{FromStructure, Station};
    use super::*;
    use bimorph_multibody::BodyId;
    use bimorph_structure::{Impact, InsulatingLayer};
    use nalgebra::{Matrix3, Vector2};

    struct Random(u64);

    impl Random {
        fn of(&mut self, size: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            size * (2.0 * (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 1.0)
        }
    }

    /// A side of a gap of 200 µm whose stations lie at these fractions, on bodies in turn from `first` on, every `step`-th of them; the first station is anchored without one.
    fn side(at: &[f64], first: Option<usize>, step: isize, random: &mut Random) -> Flank {
        let count = at.len();
        let station = |(k, at): (usize, &f64)| {
            let body = match (first, k) {
                (None, _) | (Some(0), 0) => BodyId::Ground,
                (Some(_), k) if step < 0 => BodyId::Free(count - k),
                (Some(first), k) => BodyId::Free(first + step as usize * k),
            };
            let arm = Vector2::new(random.of(4e-6), random.of(2e-6));
            Station { at: at * 200e-6, point: MaterialPoint { body, arm } }
        };
        Flank::new(at.iter().enumerate().map(station).collect(), Vec::new())
    }

    /// Beams whose sides have these stations.
    fn beams(cuts: [&[f64]; 2], lower: Option<usize>, edges: EdgeField, random: &mut Random) -> FacingBeams {
        // bodies of a side that moves alone are neighbours, up or down
        let step = if lower.is_some() { 2 } else { [1, -1][usize::from(random.of(1.0) > 0.0)] };
        let sides = [side(cuts[0], Some(0), step, random), side(cuts[1], lower, step, random)];
        let angle = random.of(3.0);
        let frame = Opening { axis: Vector2::new(angle.cos(), angle.sin()), side: random.of(1.0).signum() };
        let facing = FacingStretch {
            length: 200e-6,
            gap: 2e-6,
            strength: 8.854e-12 * 2e-6,
            edges,
            insulation: None,
            height: 2e-6,
            touch: 0.1e-6,
            chord: false,
            alone: false,
        };
        let of = |cut: super::super::facing_stretches::Interval| CubicStretch {
            facing: FacingStretch { length: cut.length, ..facing },
            segments: cut.segments,
            weights: cut.weights,
        };
        let all = stretches(&sides).into_iter().map(of).collect();
        FacingBeams::new(frame, sides, all, Loss::new(&Impact::default()))
    }

    /// Force and tangent tile by tile are those stretch by stretch, to rounding, and so is the change with the voltage: one or both sides moving, cut alike and not, in 2 to 29
    /// stretches. Laws of the fringe field, insulation, contact and sizes of displacements vary.
    #[test]
    fn tiles_are_stretches() {
        let mut random = Random(7);
        let even = |n: usize| (0..=n).map(|k| k as f64 / n as f64).collect::<Vec<_>>();
        let laws = [
            EdgeField::None,
            EdgeField::Parallel { factor: 3e5, inverse: 5e5 },
            EdgeField::between_bars(2e-6, 1e-6, 2e-6),
        ];
        let cuts = [(2, 2), (9, 9), (8, 5), (23, 7)];
        let mut touched = 0;
        for (k, (upper, lower)) in cuts.into_iter().flat_map(|cut| [(0, cut), (1, cut), (2, cut)]) {
            for below in [None, Some(1)] {
                let mut tiled = beams([&even(upper), &even(lower)], below, laws[k], &mut random);
                for stretch in tiled.stretches.iter_mut().filter(|_| k == 2) {
                    stretch.facing.insulation = Some(InsulatingLayer { thickness: 0.1e-6, permittivity: 4.0 });
                }
                let plain = FacingBeams { tiles: Vec::new(), ..tiled.clone() };
                assert!(!tiled.tiles.is_empty());
                let count = 2 * (upper + lower) + 4;
                let pairs: Vec<_> = (0..count).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
                let pattern = Pattern::new(count, &pairs);
                for (volts, linear, size) in
                    [(10.0, false, 1.2e-6), (10.0, true, 0.4e-6), (0.0, false, 2.4e-6), (5.0, false, 1e-9)]
                {
                    let pose = |_| Pose::new(random.of(size), random.of(size), random.of(size * 1e4));
                    let q: Vec<Pose> = (0..count).map(pose).collect();
                    let at = Configuration { q: &q, linear };
                    touched += usize::from(plain.bearing(at) > 0.0);
                    let of = |beams: &FacingBeams| {
                        let mut r =
                            [vec![Pose::zeros(); count], vec![Pose::zeros(); count], vec![Pose::zeros(); count]];
                        let mut tangents = [BodyMatrix::new(&pattern), BodyMatrix::new(&pattern)];
                        beams.add_force(at, volts, &mut r[0]);
                        beams.add_force_change(at, volts, 0.3, &mut r[1]);
                        beams.add_tangent(at, volts, &pattern, &mut tangents[0]);
                        beams.add_force_and_tangent(at, volts, &pattern, (&mut r[2], &mut tangents[1]));
                        (r, tangents)
                    };
                    let ((r, k), (r_plain, k_plain)) = (of(&tiled), of(&plain));
                    for (r, plain) in r.iter().zip(&r_plain) {
                        let most = plain.iter().map(Pose::norm).fold(0.0, f64::max);
                        assert!(r.iter().zip(plain).all(|(a, b)| (a - b).norm() <= 1e-12 * most));
                    }
                    for (k, plain) in k.iter().zip(&k_plain) {
                        for (blocks, plain) in [(&k.diagonal, &plain.diagonal), (&k.below, &plain.below)] {
                            let most = plain.iter().map(Matrix3::norm).fold(0.0, f64::max);
                            assert!(blocks.iter().zip(plain).all(|(a, b)| (a - b).norm() <= 1e-12 * most));
                        }
                    }
                }
            }
        }
        assert!(touched > 10, "{touched}");
    }

    /// Of ten stretches whose first and last two stations are anchored, eight move and fill one tile. Its force is that stretch by stretch, to rounding, also with a stretch between
    /// anchored stations among the eight.
    #[test]
    fn anchored_stretches_have_no_lanes() {
        let mut random = Random(11);
        let even: Vec<f64> = (0..=10).map(|k| f64::from(k) / 10.0).collect();
        for anchored in [&[0, 1, 9, 10][..], &[0, 1, 5, 6, 9, 10]] {
            let drawn = beams([&even, &[0.0, 1.0]], None, EdgeField::between_bars(2e-6, 1e-6, 2e-6), &mut random);
            let [mut upper, lower] = drawn.sides;
            anchored.iter().for_each(|&k| upper.stations[k].point.body = BodyId::Ground);
            let sides = [Flank::new(upper.stations, Vec::new()), lower];
            let tiled = FacingBeams::new(drawn.frame, sides, drawn.stretches, drawn.loss);
            assert!(matches!(tiled.tiles.as_slice(), [tile] if tile.stretches == (1..9)));
            let plain = FacingBeams { tiles: Vec::new(), ..tiled.clone() };
            let q: Vec<Pose> = (0..12).map(|_| Pose::new(random.of(1e-6), random.of(1e-6), random.of(1e-2))).collect();
            let force = |beams: &FacingBeams| {
                let mut r = vec![Pose::zeros(); 12];
                beams.add_force(Configuration { q: &q, linear: false }, 10.0, &mut r);
                r
            };
            let (r, plain) = (force(&tiled), force(&plain));
            let most = plain.iter().map(Pose::norm).fold(0.0, f64::max);
            assert!(most > 0.0 && r.iter().zip(&plain).all(|(a, b)| (a - b).norm() <= 1e-12 * most));
        }
    }

    /// Members whose bodies get other numbers have the force and the bound of displacements of those bodies, to the bit.
    #[test]
    fn members_follow_their_bodies() {
        let mut random = Random(3);
        let even: Vec<f64> = (0..=9).map(|k| f64::from(k) / 9.0).collect();
        let own = beams([&even, &even], None, EdgeField::None, &mut random);
        let count = 12;
        let other = |body: BodyId| match body {
            BodyId::Free(k) => BodyId::Free(count - 1 - k),
            BodyId::Ground => BodyId::Ground,
        };
        let moved = own.clone().moved(&|point| MaterialPoint { body: other(point.body), ..point });
        let q: Vec<Pose> = (0..count).map(|k| Pose::new(1e-8 * k as f64, 2e-8 * k as f64, 1e-5 * k as f64)).collect();
        let turned: Vec<Pose> = q.iter().rev().copied().collect();
        assert_eq!(own.closing_bound(&q).to_bits(), moved.closing_bound(&turned).to_bits());
        let force = |beams: &FacingBeams, q: &[Pose]| {
            let mut r = vec![Pose::zeros(); count];
            beams.add_force(Configuration { q, linear: false }, 10.0, &mut r);
            r
        };
        let (one, two) = (force(&own, &q), force(&moved, &turned));
        assert!(one.iter().zip(two.iter().rev()).all(|(a, b)| a == b) && one[5].norm() > 0.0);
    }
}
