//! The same polynomials at eight motions at once, one in each lane.
//!
//! Operations are those of [`PolynomialForces`](super::PolynomialForces) in their order, so that a lane has the bits of its motion alone. Sums that go
//! there by groups of rows go here row by row, each with the same additions in the same order. Laws of points have branches, and run lane by lane.

// sums of a fixed number are indexed as they are written
#![allow(clippy::needless_range_loop)]

use super::{PointState, PolynomialMotion};
use crate::reduced::polynomial::rows::{LaneColumns, PolynomialRows};
use bimorph_domains::Law;
use bimorph_multibody::batch::{Kernel, LANES, Lane8, SimdReal, across};

/// Rows that are summed at once: their additions do not wait for each other.
const TOGETHER: usize = 4;

/// Coordinates, rates and accelerations in each lane.
#[derive(Debug, Clone)]
pub struct LaneReducedMotion {
    /// Coordinates.
    pub z: Vec<Lane8>,
    /// Rates.
    pub v: Vec<Lane8>,
    /// Accelerations.
    pub w: Vec<Lane8>,
}

impl LaneReducedMotion {
    /// Of `m` coordinates.
    pub fn zeros(m: usize) -> Self {
        Self { z: vec![Lane8::of(0.0); m], v: vec![Lane8::of(0.0); m], w: vec![Lane8::of(0.0); m] }
    }

    /// All three.
    pub fn all(&mut self) -> [&mut Vec<Lane8>; 3] {
        [&mut self.z, &mut self.v, &mut self.w]
    }

    /// All three.
    pub fn parts(&self) -> [&Vec<Lane8>; 3] {
        [&self.z, &self.v, &self.w]
    }
}

/// Values of monomials in each lane, with 1 behind the last.
#[derive(Debug, Clone)]
struct LaneMonomials {
    values: Vec<Lane8>,
    rates: Vec<Lane8>,
    pushes: Vec<Lane8>,
    /// Derivatives with the coordinates, those of a monomial together.
    slopes: Vec<Lane8>,
}

/// Storage of an evaluation in lanes. Nothing is allocated after [`LanePolynomialForces::new`].
#[derive(Debug, Clone)]
pub struct LanePolynomialForces {
    m: usize,
    at: LaneMonomials,
    /// Coordinates, rates, free strains and the factor of built-in strains; the last two are set by the caller.
    pub given: Vec<Lane8>,
    /// Rates of free strains, then 0.
    pub warming: Vec<Lane8>,
    /// Voltages of members.
    pub volts: Vec<[f64; LANES]>,
    combined: Vec<Lane8>,
    reversed: Vec<Lane8>,
    stress: Vec<Lane8>,
    push: Vec<Lane8>,
    shape: Vec<Lane8>,
    shape_rate: Vec<Lane8>,
    points: Vec<[PointState; LANES]>,
    strain_slopes: Vec<Lane8>,
    inertia_slopes: Vec<Lane8>,
    shape_slopes: Vec<Lane8>,
    /// Of each pair of shapes: stiffness and damping of the points.
    of_shapes: Vec<[Lane8; 2]>,
    /// R.
    pub force: Vec<Lane8>,
    /// ∂R/∂t.
    pub forcing: Vec<Lane8>,
    /// By columns.
    pub mass: Vec<Lane8>,
    /// By columns.
    pub damping: Vec<Lane8>,
    /// By columns.
    pub stiffness: Vec<Lane8>,
}

impl LanePolynomialForces {
    /// Storage.
    pub fn new(of: &PolynomialMotion) -> Self {
        let none = |count: usize| vec![Lane8::of(0.0); count];
        let (m, count) = (of.stiffness.nrows(), of.chain.count());
        let mut values = none(count + 1);
        values[count] = Lane8::of(1.0);
        let at = LaneMonomials { values, rates: none(count + 1), pushes: none(count + 1), slopes: none(count * m) };
        let shapes = of.shapes.count;
        let members = of.members.iter().map(|points| points.member + 1).max().unwrap_or(0);
        Self {
            m,
            at,
            given: none(of.linear.columns()),
            warming: none(of.rests.columns()),
            volts: vec![[0.0; LANES]; members],
            combined: none(count + 1),
            reversed: none(count + 1),
            stress: none(of.strains.count),
            push: none(of.inertia.count),
            shape: none(shapes),
            shape_rate: none(shapes),
            points: vec![[PointState::default(); LANES]; of.mix.ncols()],
            strain_slopes: none(of.strains.count * m),
            inertia_slopes: none(of.inertia.count * m),
            shape_slopes: none(shapes * m),
            of_shapes: vec![[Lane8::of(0.0); 2]; shapes * shapes],
            force: none(m),
            forcing: none(m),
            mass: none(m * m),
            damping: none(m * m),
            stiffness: none(m * m),
        }
    }

    /// The force R at a motion, in the lanes that are `active`.
    pub fn residual(&mut self, of: &PolynomialMotion, motion: &LaneReducedMotion, active: &[bool; LANES]) {
        across(Begin { forces: self, of, motion });
        if !self.points.is_empty() {
            self.press(of, active);
        }
        across(End { forces: self, of });
    }

    /// Mass, damping, stiffness and ∂R/∂t where the residual was taken last.
    pub fn matrices(&mut self, of: &PolynomialMotion) {
        across(Matrices { forces: self, of });
    }

    /// The laws of all points in each lane.
    fn press(&mut self, of: &PolynomialMotion, active: &[bool; LANES]) {
        let none: f64 = std::iter::empty::<f64>().sum();
        for points in &of.members {
            let volts = self.volts[points.member];
            for (k, law) in points.laws.iter().enumerate() {
                let point = points.first + k;
                let sum = |point: usize, of_shapes: &[Lane8]| {
                    let mut sum = [none; LANES];
                    for (share, y) in of.mix.column(point).iter().zip(of_shapes) {
                        for lane in 0..LANES {
                            sum[lane] += share * y.0[lane];
                        }
                    }
                    sum
                };
                let motion = |point: usize| {
                    let approaches = sum(point, &self.shape);
                    let rates = if of.resists { sum(point, &self.shape_rate) } else { [0.0; LANES] };
                    approaches.into_iter().zip(rates)
                };
                let active = |lane: &usize| active[*lane];
                if let Some(comb) = law.comb() {
                    let motions = motion(point).zip(motion(point + 1)).enumerate();
                    for (lane, (along, across)) in motions.filter(|(lane, _)| active(lane)) {
                        let both = PointState::of_comb((comb, law.loss), [along, across], volts[lane]);
                        (self.points[point][lane], self.points[point + 1][lane]) = (both[0], both[1]);
                    }
                } else if law.law != Some(Law::Across) {
                    for (lane, motion) in motion(point).enumerate().filter(|(lane, _)| active(lane)) {
                        self.points[point][lane] = PointState::of(law, motion, volts[lane]);
                    }
                }
            }
        }
    }
}

/// Monomials at a motion, and what strains, inertia and shapes make of them.
struct Begin<'a> {
    forces: &'a mut LanePolynomialForces,
    of: &'a PolynomialMotion,
    motion: &'a LaneReducedMotion,
}

impl Kernel for Begin<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { forces, of, motion: LaneReducedMotion { z, v, w } } = self;
        let LanePolynomialForces { m, at, given, stress, push, combined, shape, shape_rate, points, .. } = forces;
        given[..*m].copy_from_slice(z);
        given[*m..2 * *m].copy_from_slice(v);
        let of_lanes = |x: &Lane8| W::load(simd, x);
        let LaneMonomials { values, rates, pushes, .. } = at;
        for (k, &[before, i]) in of.chain.links.iter().enumerate() {
            let (a, b, c) = (of_lanes(&values[before]), of_lanes(&rates[before]), of_lanes(&pushes[before]));
            let (x, v, w) = (of_lanes(&z[i]), of_lanes(&v[i]), of_lanes(&w[i]));
            (a * x).store(&mut values[k]);
            (b * x + a * v).store(&mut rates[k]);
            (c * x + (b * v) * 2.0 + a * w).store(&mut pushes[k]);
        }
        stress.fill(Lane8::of(0.0));
        add_products::<W>(simd, of.strains.of_rows(), values, stress);
        add_products::<W>(simd, &of.rests, &given[2 * *m..], stress);
        push.fill(Lane8::of(0.0));
        add_products::<W>(simd, of.inertia.of_rows(), pushes, push);
        combined.fill(Lane8::of(0.0));
        add_combined::<W>(simd, &of.strains, stress, combined);
        add_combined::<W>(simd, &of.inertia, push, combined);
        if !points.is_empty() {
            shape.fill(Lane8::of(0.0));
            add_products::<W>(simd, of.shapes.of_rows(), values, shape);
            if of.resists {
                shape_rate.fill(Lane8::of(0.0));
                add_products::<W>(simd, of.shapes.of_rows(), rates, shape_rate);
            }
        }
    }
}

/// Forces of points and loads over the monomials, and the force over the coordinates.
struct End<'a> {
    forces: &'a mut LanePolynomialForces,
    of: &'a PolynomialMotion,
}

impl Kernel for End<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { forces, of } = self;
        let LanePolynomialForces { m, at, given, combined, reversed, shape, points, force, .. } = forces;
        if !points.is_empty() {
            shape.fill(Lane8::of(0.0));
            for (point, states) in points.iter().enumerate() {
                let mut pressed = Lane8::of(0.0);
                for lane in 0..LANES {
                    pressed.0[lane] = states[lane].force;
                }
                let pressed = W::load(simd, &pressed);
                for (to, share) in shape.iter_mut().zip(of.mix.column(point).iter()) {
                    (W::load(simd, to) + W::splat(simd, *share) * pressed).store(to);
                }
            }
            add_combined::<W>(simd, &of.shapes, shape, combined);
        }
        if of.loaded {
            add_combined::<W>(simd, &of.works, &[Lane8::of(-1.0)], combined);
        }
        force.fill(Lane8::of(0.0));
        add_products::<W>(simd, &of.linear, given, force);
        reversed.copy_from_slice(combined);
        add_gradient::<W>(simd, of, (&given[..*m], &at.values), reversed, force);
    }
}

/// Mass, damping, stiffness and ∂R/∂t.
struct Matrices<'a> {
    forces: &'a mut LanePolynomialForces,
    of: &'a PolynomialMotion,
}

impl Kernel for Matrices<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { forces, of } = self;
        forces.differentiate::<W>(simd, of);
        forces.fill_matrices::<W>(simd, of);
        if !forces.points.is_empty() {
            forces.add_point_matrices::<W>(simd, of);
        }
        let LanePolynomialForces { m, at, combined, stiffness, .. } = &mut *forces;
        for &[k, i, j, others] in &of.chain.pairs {
            let value = W::load(simd, &combined[k]) * W::load(simd, &at.values[others]);
            for place in [j * *m + i, i * *m + j] {
                (W::load(simd, &stiffness[place]) + value).store(&mut stiffness[place]);
            }
        }
        forces.fill_forcing::<W>(simd, of);
    }
}

impl LanePolynomialForces {
    #[inline(always)]
    fn differentiate<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion) {
        let (m, one) = (self.m, of.chain.count());
        let LaneMonomials { values, slopes, .. } = &mut self.at;
        for &[k, i] in &of.chain.touched {
            let [before, last] = of.chain.links[k];
            let through = match before == one {
                true => W::splat(simd, 0.0),
                false => W::load(simd, &slopes[before * m + i]) * W::load(simd, &self.given[last]),
            };
            let own = if last == i { W::load(simd, &values[before]) } else { W::splat(simd, 0.0) };
            (through + own).store(&mut slopes[k * m + i]);
        }
    }

    #[inline(always)]
    fn fill_matrices<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion) {
        let Self { m, at, strain_slopes, inertia_slopes, mass, damping, stiffness, .. } = self;
        for (to, from) in stiffness.iter_mut().zip(of.stiffness.iter()) {
            W::splat(simd, *from).store(to);
        }
        for (to, from) in damping.iter_mut().zip(of.damping.iter()) {
            W::splat(simd, *from).store(to);
        }
        mass.fill(Lane8::of(0.0));
        fill_slopes::<W>(simd, of, &of.strains, (&at.slopes, *m), strain_slopes);
        add_gram::<W>(simd, strain_slopes, *m, stiffness);
        fill_slopes::<W>(simd, of, &of.inertia, (&at.slopes, *m), inertia_slopes);
        add_gram::<W>(simd, inertia_slopes, *m, mass);
    }

    #[inline(always)]
    fn add_point_matrices<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion) {
        let Self { m, at, shape_slopes, of_shapes, points, damping, stiffness, .. } = self;
        let (m, shapes) = (*m, of.shapes.count);
        fill_slopes::<W>(simd, of, &of.shapes, (&at.slopes, m), shape_slopes);
        of_shapes.fill([Lane8::of(0.0); 2]);
        for (point, states) in points.iter().enumerate() {
            let mut both = [Lane8::of(0.0); 2];
            for lane in 0..LANES {
                both[0].0[lane] = states[lane].stiffness;
                both[1].0[lane] = states[lane].damping;
            }
            let shares = of.mix.column(point);
            for (a, first) in shares.iter().enumerate() {
                for (b, second) in shares.iter().enumerate().take(a + 1) {
                    for (to, of_point) in of_shapes[a * shapes + b].iter_mut().zip(&both) {
                        let more = W::load(simd, of_point) * *first * *second;
                        (W::load(simd, to) + more).store(to);
                    }
                }
            }
            if of.combs.contains(&point) {
                let mut mixed = Lane8::of(0.0);
                for lane in 0..LANES {
                    let [own, other] = states[lane].mixed;
                    mixed.0[lane] = 0.5 * (own + other);
                }
                let (mixed, next) = (W::load(simd, &mixed), of.mix.column(point + 1));
                for a in 0..shapes {
                    for b in 0..=a {
                        let to = &mut of_shapes[a * shapes + b][0];
                        let shared = W::splat(simd, shares[a] * next[b] + next[a] * shares[b]);
                        (W::load(simd, to) + mixed * shared).store(to);
                    }
                }
            }
        }
        for (which, to) in [stiffness, damping].into_iter().enumerate().take(if of.resists { 2 } else { 1 }) {
            for a in 0..shapes {
                for b in 0..=a {
                    let both = W::load(simd, &of_shapes[a * shapes + b][which]);
                    for i in 0..m {
                        for j in 0..m {
                            let slope = |shape: usize, i: usize| W::load(simd, &shape_slopes[shape * m + i]);
                            let one = slope(a, i) * slope(b, j);
                            let two = if a == b { W::splat(simd, 0.0) } else { slope(b, i) * slope(a, j) };
                            let place = j * m + i;
                            (W::load(simd, &to[place]) + both * (one + two)).store(&mut to[place]);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn fill_forcing<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion) {
        let Self { m, at, given, warming, stress, reversed, forcing, .. } = self;
        let m = *m;
        stress.fill(Lane8::of(0.0));
        add_products::<W>(simd, &of.rests, warming, stress);
        reversed.fill(Lane8::of(0.0));
        add_combined::<W>(simd, &of.strains, stress, reversed);
        forcing.fill(Lane8::of(0.0));
        add_gradient::<W>(simd, of, (&given[..m], &at.values), reversed, forcing);
        for i in 0..m {
            let mut sum = W::splat(simd, 0.0);
            for (k, rate) in warming.iter().enumerate() {
                sum += W::splat(simd, of.linear.at(i, 2 * m + k)) * W::load(simd, rate);
            }
            (W::load(simd, &forcing[i]) + sum).store(&mut forcing[i]);
        }
    }
}

/// `to +=` sums of columns, each with its weight in each lane.
#[inline(always)]
fn add_products<W: SimdReal>(simd: W::Simd, columns: &LaneColumns, weights: &[Lane8], to: &mut [Lane8]) {
    let n = columns.columns();
    for (first, to) in to.chunks_mut(TOGETHER).enumerate() {
        let (group, half) = (first * TOGETHER / LANES, first * TOGETHER % LANES);
        let lanes = columns.group(group);
        let mut sums = [W::splat(simd, 0.0); TOGETHER];
        for k in 0..n {
            let (weight, column) = (W::load(simd, &weights[k]), &lanes[k].0);
            for i in 0..TOGETHER {
                sums[i] += W::splat(simd, column[half + i]) * weight;
            }
        }
        for (to, sum) in to.iter_mut().zip(sums) {
            (W::load(simd, to) + sum).store(to);
        }
    }
}

/// `to +=` the coefficients of each monomial in the sum of the rows with these weights.
#[inline(always)]
fn add_combined<W: SimdReal>(simd: W::Simd, rows: &PolynomialRows, weights: &[Lane8], to: &mut [Lane8]) {
    add_products::<W>(simd, rows.of_monomials(), weights, to);
}

/// `to +=` the gradient of the sum with these coefficients, which are used up.
#[inline(always)]
fn add_gradient<W: SimdReal>(
    simd: W::Simd,
    of: &PolynomialMotion,
    (x, values): (&[Lane8], &[Lane8]),
    coefficients: &mut [Lane8],
    to: &mut [Lane8],
) {
    for (k, &[before, i]) in of.chain.links.iter().enumerate().rev() {
        let c = W::load(simd, &coefficients[k]);
        (W::load(simd, &to[i]) + c * W::load(simd, &values[before])).store(&mut to[i]);
        (W::load(simd, &coefficients[before]) + c * W::load(simd, &x[i])).store(&mut coefficients[before]);
    }
}

/// Derivatives of rows with the `m` coordinates, those of a row together.
#[inline(always)]
fn fill_slopes<W: SimdReal>(
    simd: W::Simd,
    of: &PolynomialMotion,
    rows: &PolynomialRows,
    (slopes, m): (&[Lane8], usize),
    out: &mut [Lane8],
) {
    out.fill(Lane8::of(0.0));
    let columns = rows.of_rows();
    for (row, out) in out.chunks_exact_mut(m).enumerate() {
        let lanes = columns.group(row / LANES);
        for &[k, i] in &of.chain.touched {
            let c = W::splat(simd, lanes[k].0[row % LANES]);
            (W::load(simd, &out[i]) + c * W::load(simd, &slopes[k * m + i])).store(&mut out[i]);
        }
    }
}

/// `to +=` the products Jᵀ·J of derivatives: every eighth row together, as a register sums them.
#[inline(always)]
fn add_gram<W: SimdReal>(simd: W::Simd, slopes: &[Lane8], m: usize, to: &mut [Lane8]) {
    for i in 0..m {
        for j in 0..=i {
            let mut sums = [W::splat(simd, 0.0); LANES];
            for (row, of) in slopes.chunks_exact(m).enumerate() {
                sums[row % LANES] += W::load(simd, &of[i]) * W::load(simd, &of[j]);
            }
            let [a, b, c, d, e, f, g, h] = sums;
            let sum = ((a + b) + (c + d)) + ((e + f) + (g + h));
            let (place, other) = (j * m + i, i * m + j);
            (W::load(simd, &to[place]) + sum).store(&mut to[place]);
            if i != j {
                (W::load(simd, &to[other]) + sum).store(&mut to[other]);
            }
        }
    }
}
