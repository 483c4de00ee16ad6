//! Monomials one factor at a time: values, derivatives in time, and first and second derivatives of sums of them.
//!
//! A monomial is the product of a shorter one and a coordinate, and a coordinate that of itself and 1, so each value takes one product. In the reverse
//! order the same products give the gradient of a sum with given coefficients (reverse accumulation).

use super::monomials::Monomials;
use bimorph_multibody::batch::LANES;
use nalgebra::DMatrix;

/// Monomials of degree 1 to 3 in the order of [`Monomials`].
#[derive(Debug, Clone)]
pub(super) struct MonomialChain {
    size: usize,
    /// The monomial and the coordinate whose product each is; the constant 1 has the place behind the last.
    pub(super) links: Vec<[usize; 2]>,
    /// Monomials with the coordinates that they have.
    pub(super) touched: Vec<[usize; 2]>,
    /// The same by runs.
    runs: Vec<MonomialRun>,
    /// Monomials with two of their factors, and the place of the product of the others.
    pub(super) pairs: Vec<[usize; 4]>,
}

/// Neighbours that are products of one monomial with coordinates in their order.
#[derive(Debug, Clone, Copy)]
struct MonomialRun {
    /// The monomial; the constant 1 has the place behind the last.
    of: usize,
    first_coordinate: usize,
    first: usize,
    count: usize,
}

/// Values at a state.
#[derive(Debug, Clone)]
pub(super) struct MonomialValues {
    /// Values, then 1, then zeros to a multiple of the lanes.
    pub(super) values: Vec<f64>,
    /// Their first and second derivatives in time.
    pub(super) rates: Vec<f64>,
    pub(super) pushes: Vec<f64>,
    /// Derivatives with the coordinates, those of a monomial together.
    slopes: Vec<f64>,
}

impl MonomialChain {
    /// Of monomials of degree 3 at most.
    pub(super) fn new(of: &Monomials) -> Self {
        let one = of.count();
        let place = |factors: &[usize]| of.factors.iter().position(|known| known == factors).unwrap_or(one);
        let mut chain =
            Self { size: of.size, links: Vec::new(), touched: Vec::new(), runs: Vec::new(), pairs: Vec::new() };
        for (k, factors) in of.factors.iter().enumerate() {
            let (last, before) = factors.split_last().map_or((0, &[][..]), |(last, before)| (*last, before));
            let shorter = place(before);
            chain.links.push([shorter, last]);
            match chain.runs.last_mut().filter(|run| run.of == shorter && run.first_coordinate + run.count == last) {
                Some(run) => run.count += 1,
                None => chain.runs.push(MonomialRun { of: shorter, first_coordinate: last, first: k, count: 1 }),
            }
            let mut coordinates = factors.clone();
            coordinates.dedup();
            chain.touched.extend(coordinates.into_iter().map(|i| [k, i]));
            for i in 0..factors.len() {
                for j in 0..i {
                    let others: Vec<usize> =
                        (0..factors.len()).filter(|f| *f != i && *f != j).map(|f| factors[f]).collect();
                    chain.pairs.push([k, factors[i], factors[j], place(&others)]);
                }
            }
        }
        chain
    }

    /// Number of monomials.
    pub(super) fn count(&self) -> usize {
        self.links.len()
    }

    /// Groups of lanes that the monomials and the constant take.
    pub(super) fn groups(&self) -> usize {
        (self.count() + 1).div_ceil(LANES)
    }

    /// Storage.
    pub(super) fn storage(&self) -> MonomialValues {
        let zeros = vec![0.0; self.groups() * LANES];
        let mut values = zeros.clone();
        values[self.count()] = 1.0;
        MonomialValues { values, rates: zeros.clone(), pushes: zeros, slopes: vec![0.0; self.count() * self.size] }
    }

    /// Values and their derivatives in time at coordinates, rates and accelerations.
    #[inline(always)]
    pub(super) fn place(&self, [x, v, w]: [&[f64]; 3], at: &mut MonomialValues) {
        let MonomialValues { values, rates, pushes, .. } = at;
        for &MonomialRun { of, first_coordinate, first, count } in &self.runs {
            let (a, b, c) = (values[of], rates[of], pushes[of]);
            let given = x[first_coordinate..].iter().zip(&v[first_coordinate..]).zip(&w[first_coordinate..]);
            let run = first..first + count;
            let of_run = values[run.clone()].iter_mut().zip(&mut rates[run.clone()]).zip(&mut pushes[run]);
            for (((value, rate), push), ((x, v), w)) in of_run.zip(given) {
                *value = a * x;
                *rate = b * x + a * v;
                *push = c * x + 2.0 * (b * v) + a * w;
            }
        }
    }

    /// `to +=` the gradient at the placed state of the sum with these coefficients, which are used up.
    #[inline(always)]
    pub(super) fn add_gradient(&self, x: &[f64], at: &MonomialValues, coefficients: &mut [f64], to: &mut [f64]) {
        for (k, &[of, i]) in self.links.iter().enumerate().rev() {
            let c = coefficients[k];
            to[i] += c * at.values[of];
            coefficients[of] += c * x[i];
        }
    }

    /// Changes of the values and their derivatives in time at the placed state, where coordinates, rates and accelerations change.
    #[inline(always)]
    pub(super) fn place_change(
        &self,
        [x, v, w]: [&[f64]; 3],
        [dx, dv, dw]: [&[f64]; 3],
        at: &MonomialValues,
        change: &mut MonomialValues,
    ) {
        change.values[self.count()] = 0.0;
        for (k, &[of, i]) in self.links.iter().enumerate() {
            let (a, b, c) = (at.values[of], at.rates[of], at.pushes[of]);
            let (da, db, dc) = (change.values[of], change.rates[of], change.pushes[of]);
            change.values[k] = da * x[i] + a * dx[i];
            change.rates[k] = db * x[i] + b * dx[i] + da * v[i] + a * dv[i];
            change.pushes[k] = dc * x[i] + c * dx[i] + 2.0 * (db * v[i] + b * dv[i]) + da * w[i] + a * dw[i];
        }
    }

    /// `to +=` the change of the gradient of a sum, where coordinates change by `dx` and values as placed; `coefficients` and their changes are used up.
    #[inline(always)]
    pub(super) fn add_gradient_change(
        &self,
        [x, dx]: [&[f64]; 2],
        [at, change]: [&MonomialValues; 2],
        [coefficients, changes]: [&mut [f64]; 2],
        to: &mut [f64],
    ) {
        for (k, &[of, i]) in self.links.iter().enumerate().rev() {
            let (c, dc) = (coefficients[k], changes[k]);
            to[i] += dc * at.values[of] + c * change.values[of];
            coefficients[of] += c * x[i];
            changes[of] += dc * x[i] + c * dx[i];
        }
    }

    /// Derivatives with the coordinates at the placed state.
    #[inline(always)]
    pub(super) fn differentiate(&self, x: &[f64], at: &mut MonomialValues) {
        let (m, one) = (self.size, self.count());
        for &[k, i] in &self.touched {
            let [of, last] = self.links[k];
            let through = if of == one { 0.0 } else { at.slopes[of * m + i] * x[last] };
            at.slopes[k * m + i] = through + if last == i { at.values[of] } else { 0.0 };
        }
    }

    /// Calls `see` with each monomial, coordinate and derivative that is not zero everywhere.
    #[inline(always)]
    pub(super) fn each_slope(&self, at: &MonomialValues, mut see: impl FnMut(usize, usize, f64)) {
        for &[k, i] in &self.touched {
            see(k, i, at.slopes[k * self.size + i]);
        }
    }

    /// `to +=` the second derivatives at the placed state of the sum with these coefficients.
    #[inline(always)]
    pub(super) fn add_curvature(&self, at: &MonomialValues, coefficients: &[f64], to: &mut DMatrix<f64>) {
        for &[k, i, j, others] in &self.pairs {
            let value = coefficients[k] * at.values[others];
            to[(i, j)] += value;
            to[(j, i)] += value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Values, rates, gradient and curvature are those of `Monomials` to 1e-13, and accelerations the central differences of rates to 1e-6, whose own
    /// error it is.
    #[test]
    fn a_chain_has_the_values_of_its_monomials() {
        let of = Monomials::new(3, 3);
        let chain = MonomialChain::new(&of);
        let (x, v, w) = ([0.7, -0.4, 1.3], [0.2, 0.5, -0.3], [1.0, -2.0, 0.6]);
        let mut at = chain.storage();
        chain.place([&x, &v, &w], &mut at);
        let n = of.count();
        assert!((DVector::from_column_slice(&at.values[..n]) - of.values(&x)).amax() < 1e-13);
        let slopes = of.derivatives(&x);
        let rates = &slopes * DVector::from_column_slice(&v);
        assert!((DVector::from_column_slice(&at.rates[..n]) - rates).amax() < 1e-13);
        chain.differentiate(&x, &mut at);
        let mut found = DMatrix::zeros(n, 3);
        chain.each_slope(&at, |k, i, slope| found[(k, i)] = slope);
        assert!((found - &slopes).amax() < 1e-13);
        let c = DVector::from_iterator(n, (1..=n).map(|k| k as f64));
        let mut coefficients = vec![0.0; chain.groups() * LANES];
        coefficients[..n].copy_from_slice(c.as_slice());
        let (mut curvature, mut known) = (DMatrix::zeros(3, 3), DMatrix::zeros(3, 3));
        chain.add_curvature(&at, &coefficients, &mut curvature);
        of.add_curvature(&c, &x, &mut known);
        assert!((curvature - &known).amax() < 1e-11 * known.amax());
        let mut gradient = [0.0; 3];
        chain.add_gradient(&x, &at, &mut coefficients, &mut gradient);
        assert!((DVector::from_column_slice(&gradient) - slopes.tr_mul(&c)).amax() < 1e-11 * c.amax());
        let h = 1e-6;
        let rates = |h: f64| {
            let mut at = chain.storage();
            let moved = |k: usize| x[k] + h * v[k] + 0.5 * h * h * w[k];
            chain.place([&[0, 1, 2].map(moved), &[0, 1, 2].map(|k| v[k] + h * w[k]), &w], &mut at);
            DVector::from_column_slice(&at.rates[..n])
        };
        let pushes = (rates(h) - rates(-h)) / (2.0 * h);
        assert!((DVector::from_column_slice(&at.pushes[..n]) - &pushes).amax() < 1e-6 * pushes.amax());
    }
}
