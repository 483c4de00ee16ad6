//! Samples of parameters that vary: distributions, a design, correlations.

use super::design::{Cube, Design};
use super::distribution::{Distribution, Vary, normal_score};
use super::error::{SweepError, bad};
use bimorph_base::Setting;
use nalgebra::DMatrix;
use std::collections::HashSet;

/// Most correlated parameters.
const CORRELATED_MOST: usize = 200;

/// Specification of the samples. [`SampleGenerator::new`] checks it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sampling {
    /// Parameters that vary.
    pub vary: Vec<Vary>,
    /// Samples at each point of the grid.
    pub count: usize,
    /// The same seed draws the same samples.
    pub seed: u64,
    /// How they fill the space.
    pub design: Design,
    /// Correlations of normal and log-normal parameters (of ln x there): two names, and −1 < ρ < 1.
    pub correlations: Vec<(String, String, f64)>,
}

/// Samples that can be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleGenerator {
    /// The specification.
    pub asked: Sampling,
    cube: Cube,
    /// Cholesky's factor of the correlations; `None` without correlations.
    factor: Option<DMatrix<f64>>,
}

impl SampleGenerator {
    /// # Errors
    /// [`SweepError::BadSpec`] for distributions, counts and correlations that mean nothing.
    pub fn new(asked: Sampling) -> Result<Self, SweepError> {
        if asked.vary.is_empty() || asked.count == 0 {
            let expected = "at least one parameter that varies and one sample";
            return Err(bad("samples".into(), expected, &format!("{} of {}", asked.count, asked.vary.len())));
        }
        asked.vary.iter().try_for_each(|vary| vary.distribution.check(&vary.name))?;
        let factor = if asked.correlations.is_empty() { None } else { Some(factor(&asked)?) };
        let cube = Cube::new(asked.design, asked.seed, asked.count, asked.vary.len())?;
        Ok(Self { asked, cube, factor })
    }

    /// The values of sample `k`, parameter by parameter.
    pub fn values(&self, k: usize) -> Vec<(String, Setting)> {
        let shares: Vec<f64> = (0..self.asked.vary.len()).map(|c| self.cube.at(k, c)).collect();
        let own: Vec<f64> = shares.iter().map(|u| normal_score(*u)).collect();
        let score = |c: usize| match &self.factor {
            Some(factor) => (0..=c).map(|j| factor[(c, j)] * own[j]).sum(),
            None => own[c],
        };
        let value = |(c, vary): (usize, &Vary)| {
            (vary.name.clone(), Setting::Number(vary.distribution.quantile(shares[c], score(c))))
        };
        self.asked.vary.iter().enumerate().map(value).collect()
    }

    /// The values below which the fraction `u` of each parameter lies.
    pub fn quantiles(&self, u: f64) -> Vec<(String, Setting)> {
        let value = |vary: &Vary| Setting::Number(vary.distribution.quantile(u, normal_score(u)));
        self.asked.vary.iter().map(|vary| (vary.name.clone(), value(vary))).collect()
    }
}

/// Cholesky's factor of the correlations.
fn factor(asked: &Sampling) -> Result<DMatrix<f64>, SweepError> {
    let n = asked.vary.len();
    if n > CORRELATED_MOST {
        let expected = format!("at most {CORRELATED_MOST} parameters with correlations");
        return Err(bad("correlations".into(), &expected, &n.to_string()));
    }
    let mut matrix = DMatrix::identity(n, n);
    let mut seen = HashSet::with_capacity(asked.correlations.len());
    for (a, b, rho) in &asked.correlations {
        let what = || format!("correlation of \"{a}\" and \"{b}\"");
        let find = |name: &String| {
            let index = asked.vary.iter().position(|vary| vary.name == *name);
            index.ok_or_else(|| bad(what(), "two parameters that vary", name))
        };
        let (i, j) = (find(a)?, find(b)?);
        for k in [i, j] {
            if matches!(asked.vary[k].distribution, Distribution::Uniform { .. }) {
                return Err(bad(what(), "normal or lognormal parameters", &asked.vary[k].name));
            }
        }
        if i == j || rho.is_nan() || rho.abs() >= 1.0 {
            return Err(bad(what(), "two different parameters and a number between -1 and 1", &rho.to_string()));
        }
        if !seen.insert((i.min(j), i.max(j))) {
            return Err(bad(what(), "each pair once", "it twice"));
        }
        (matrix[(i, j)], matrix[(j, i)]) = (*rho, *rho);
    }
    let found = nalgebra::Cholesky::new(matrix).map(|cholesky| cholesky.l());
    found.ok_or_else(|| {
        bad("correlations".into(), "correlations that can be at once", "a matrix that is not positive definite")
    })
}

#[cfg(test)]
mod tests {
    //! Samples have the specified moments.
    use super::*;

    #[test]
    fn moments_and_correlation() {
        let vary = ["w=normal:2:0.1", "E=lognormal:5:0.2", "g=uniform:1:3"].map(|text| text.parse().unwrap()).to_vec();
        for design in [Design::Random, Design::LatinHypercube, Design::Sobol] {
            let asked = Sampling {
                vary: vary.clone(),
                count: 4096,
                seed: 3,
                design,
                correlations: vec![("w".into(), "E".into(), -0.7)],
            };
            let samples = SampleGenerator::new(asked).unwrap();
            let column = |c: usize| -> Vec<f64> {
                let number =
                    |(_, value): &(String, Setting)| if let Setting::Number(x) = value { *x } else { f64::NAN };
                (0..4096).map(|k| number(&samples.values(k)[c])).collect()
            };
            let moments = |x: &[f64]| {
                let mean = x.iter().sum::<f64>() / x.len() as f64;
                (mean, (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt())
            };
            let (w, e, g) = (column(0), column(1).iter().map(|x| (x / 5.0).ln()).collect::<Vec<_>>(), column(2));
            // five standard errors of 4096 independent samples
            for (x, mean, deviation) in [(&w, 2.0, 0.1), (&e, 0.0, 0.2), (&g, 2.0, 2.0 / 12f64.sqrt())] {
                let (m, s) = moments(x);
                assert!((m - mean).abs() < 5.0 * deviation / 64.0 && (s / deviation - 1.0).abs() < 0.06, "{m} {s}");
            }
            let product: Vec<f64> = w.iter().zip(&e).map(|(w, e)| (w - 2.0) * e / (0.1 * 0.2)).collect();
            assert!((moments(&product).0 + 0.7).abs() < 0.06, "{}", moments(&product).0);
        }
    }

    #[test]
    fn correlations_that_cannot_be() {
        let vary: Vec<Vary> = ["a=normal:0:1", "b=normal:0:1", "c=uniform:0:1", "d=normal:0:1"]
            .map(|text| text.parse().unwrap())
            .to_vec();
        let with = |pairs: &[(&str, &str, f64)]| {
            let correlations = pairs.iter().map(|(a, b, rho)| ((*a).to_owned(), (*b).to_owned(), *rho)).collect();
            SampleGenerator::new(Sampling { vary: vary.clone(), count: 2, correlations, ..Sampling::default() })
        };
        assert!(with(&[("a", "b", 0.5)]).is_ok());
        for pairs in [
            &[("a", "x", 0.5)][..],
            &[("a", "a", 0.5)],
            &[("a", "c", 0.5)],
            &[("a", "b", 1.0)],
            &[("a", "b", f64::NAN)],
            &[("a", "b", 0.5), ("a", "b", 0.25)],
            &[("a", "b", 0.5), ("b", "a", 0.5)],
            &[("a", "b", 0.9), ("b", "d", 0.9), ("a", "d", -0.9)],
        ] {
            assert!(with(pairs).is_err(), "{pairs:?}");
        }
    }
}
