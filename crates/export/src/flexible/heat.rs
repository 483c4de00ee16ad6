//! Heat of a written model: temperatures as sums of lags of products of voltages, and of heat that is given.
//!
//! The steady rise of a heater is a quadratic form of the sources, T = Σ Q_ij·u_i·u_j + Σ Z_i·W_i, and lags behind it with one time constant.
//! Heaters of the same time constant share the lag of each product; all temperatures are then sums of these lags.

use super::ports::SourceText;
use bimorph_domains::drive::Electrics;
use nalgebra::DMatrix;

/// A lag of a product of two sources, or of heat.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatLagCourse {
    /// Time constant (s); 0: it follows at once.
    pub tau: f64,
    /// Its steady value in kelvin: a product of terms.
    pub steady: String,
}

/// All lags, and what they bring.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatCourses {
    /// The lags.
    pub lags: Vec<HeatLagCourse>,
    /// Rise of each heater per kelvin of each lag, heaters × lags.
    pub shares: DMatrix<f64>,
}

impl HeatCourses {
    /// Those of a mechanism with these sources.
    pub fn new(electrics: &Electrics, sources: &[SourceText]) -> Self {
        let heating = &electrics.heating;
        let heaters = &heating.heaters;
        let mut taus: Vec<f64> = heaters.iter().map(|heater| heater.time_constant.max(0.0)).collect();
        taus.sort_by(f64::total_cmp);
        taus.dedup();
        let (mut lags, mut columns) = (Vec::new(), Vec::new());
        for tau in taus {
            let of = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
                let own = |k: usize| heaters[k].time_constant.max(0.0) == tau;
                (0..heaters.len()).map(|k| if own(k) { value(k) } else { 0.0 }).collect()
            };
            let mut put = |rises: Vec<f64>, factors: Vec<String>| {
                let most = rises.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a });
                if most != 0.0 {
                    lags.push(HeatLagCourse { tau, steady: format!("{most:e} * {}", factors.join(" * ")) });
                    columns.push(rises.iter().map(|rise| rise / most).collect::<Vec<f64>>());
                }
            };
            for i in 0..electrics.voltages() {
                for j in 0..=i {
                    let (Some(one), Some(other)) = (sources[i].text(), sources[j].text()) else { continue };
                    let twice = if i == j { 1.0 } else { 2.0 };
                    put(of(&|k| twice * heating.entry(k, i, j)), vec![one, other]);
                }
            }
            for (i, source) in sources.iter().enumerate().skip(electrics.voltages()) {
                if let Some(text) = source.text() {
                    put(of(&|k| heating.per_watt(k, i)), vec![text]);
                }
            }
        }
        let shares = DMatrix::from_fn(heaters.len(), lags.len(), |k, l| columns[l][k]);
        Self { lags, shares }
    }
}
