//! Thermal noise of the linear model about its operating point.
//!
//! Forces F of drag C have the spectral density 4·k·T·C. They act on each direction that is kept by φ_jᵀ·F. They act on each row of y by the static response of
//! all other directions, r_iᵀ·F with r_i = K⁻¹·l_i − Σ_j φ_j·(φ_jᵀ·l_i)/λ_j and l_i the gradient of the row. The noise is exact at rest, and near every
//! resonance that is kept. Currents of conductance have 4·k·T·G with the temperatures of the operating point ([`bimorph_device`] computes the same).

use super::basis::Basis;
use super::linear::ReducedModel;
use super::mechanism::{LinearizedMechanism, dot};
use super::reduce::{MICROMETRE, OutputRow};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_device::scale::PortScale;
use bimorph_device::surroundings;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_multibody::agitation::BOLTZMANN;
use bimorph_multibody::forces::add_damping;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_solve::frequency::refined::Refined;
use nalgebra::{Complex, DMatrix, DVector};

/// Part of the noise of a row at rest, and of the product of two sources, below which one is rounding (1).
const NONE: f64 = 1e-10;

/// Noise of a linear model with n directions and r rows of y, p of which are those of ports.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinearNoise {
    /// Temperature of the surroundings (K).
    pub temperature: f64,
    /// Roots of the spectral densities of the forces in the equations of the directions, as currents of the file, and of what the other directions
    /// add to each row, n + r (A/√Hz, V/√Hz).
    pub sizes: DVector<f64>,
    /// Correlation of these (1).
    pub correlation: DMatrix<f64>,
    /// Rows that show a rate: the rate of the noise adds to them (r).
    pub rates: Vec<bool>,
    /// Spectral densities of currents between ports, p × p (A²/Hz).
    pub currents: DMatrix<f64>,
}

impl LinearNoise {
    /// One-sided spectral density of each row of y of a model at angular frequency `omega` (rad/s) (A²/Hz, V²/Hz); none at an undamped resonance.
    pub fn densities(&self, model: &ReducedModel, omega: f64) -> Option<Vec<f64>> {
        let modes = model.modes.len();
        let by_modes = model.response_to_modes(omega)?;
        let own = |row: usize| if self.rates[row] { Complex::new(0.0, omega) } else { Complex::from(1.0) };
        let gain = DMatrix::from_fn(model.rows(), self.sizes.len(), |row, k| match k.checked_sub(modes) {
            None => by_modes[(row, k)] * self.sizes[k],
            Some(other) if other == row => own(row) * self.sizes[k],
            Some(_) => Complex::from(0.0),
        });
        let moved = &gain * self.correlation.map(Complex::from) * gain.adjoint();
        let conducted = |row: usize| if row < model.ports.len() { self.currents[(row, row)] } else { 0.0 };
        Some((0..model.rows()).map(|row| moved[(row, row)].re + conducted(row)).collect())
    }
}

impl LinearizedMechanism<'_> {
    /// Noise of the model with these directions.
    pub fn noise(&self, basis: &Basis) -> LinearNoise {
        let system = self.system();
        let (n, rows) = (basis.lambda.len(), self.rows());
        let scales: Vec<PortScale> =
            self.ports.kinds.iter().zip(&self.across).map(|(kind, across)| PortScale::new(*kind, *across)).collect();
        let p = scales.len();
        let answered = |row: usize| if row < p { scales[row].answered } else { self.shown[row - p].1.scale };
        bimorph_base::budget::lay_out_matrix(n + rows.len(), 2 * (n + rows.len()) + DOF * system.bodies());
        let mut loss = LossDerivatives::of(system);
        if let Some(loss) = &mut loss {
            loss.at(system, &self.q, |_| Pose::zeros());
        }
        let dragged = |x: &[Pose]| {
            let mut drag = vec![Pose::zeros(); x.len()];
            add_damping(&system.model, x, &mut drag);
            if let Some(loss) = &loss {
                loss.add_damping(|j| x[j], &mut drag);
            }
            drag
        };
        let warm = 4.0 * BOLTZMANN * surroundings(self.compiled);
        // displacements that a unit of each source stands for
        let direction = |(x, lambda): (&Vec<Pose>, &f64)| {
            let scale = -self.largest(x) / (MICROMETRE * lambda);
            x.iter().map(|x| x * scale).collect::<Vec<Pose>>()
        };
        let mut sources: Vec<Vec<Pose>> = basis.shapes.iter().zip(&basis.lambda).map(direction).collect();
        let mut refined = Refined::new(system, &self.q, &self.drive);
        for (row, read) in rows.iter().enumerate() {
            bimorph_base::budget::check();
            let gradient = self.gradient(*read);
            let mut whole = gradient.clone();
            self.yielded(&mut refined, &mut whole);
            let mut rest = whole.clone();
            for (x, lambda) in basis.shapes.iter().zip(&basis.lambda) {
                let share = dot(x, &gradient) / lambda;
                rest.iter_mut().zip(x).for_each(|(rest, x)| *rest -= x * share);
            }
            let size = |x: &[Pose]| dot(x, &dragged(x));
            let scale = if size(&rest) > NONE * NONE * size(&whole) { answered(row) } else { 0.0 };
            rest.iter_mut().for_each(|x| *x *= scale);
            sources.push(rest);
        }
        let pushed: Vec<Vec<Pose>> = sources.iter().map(|x| dragged(x)).collect();
        let count = sources.len();
        let product = |i: usize, k: usize| 0.5 * warm * (dot(&sources[i], &pushed[k]) + dot(&sources[k], &pushed[i]));
        let sizes = DVector::from_fn(count, |i, _| product(i, i).max(0.0).sqrt());
        let correlation = DMatrix::from_fn(count, count, |i, k| match sizes[i] * sizes[k] {
            0.0 => 0.0,
            _ if i == k => 1.0,
            size => Some(product(i, k) / size).filter(|share| share.abs() > NONE).unwrap_or(0.0),
        });
        let rates = rows.iter().map(|row| matches!(row, OutputRow::Change(_) | OutputRow::Current(_))).collect();
        LinearNoise { temperature: surroundings(self.compiled), sizes, correlation, rates, currents: self.johnson() }
    }

    /// Gradient of a row over displacements.
    fn gradient(&self, row: OutputRow) -> Vec<Pose> {
        let (off, cold) = (vec![0.0; self.drive.volts.len()], vec![0.0; self.rise.len()]);
        let mut unit = vec![Pose::zeros(); self.q.len()];
        let mut gradient = unit.clone();
        for k in 0..unit.len() {
            bimorph_base::budget::check();
            for d in 0..DOF {
                unit[k][d] = 1.0;
                gradient[k][d] = self.read(row, &unit, &off, &cold);
                unit[k][d] = 0.0;
            }
        }
        gradient
    }

    /// Johnson's noise of what conducts between electrical ports (A²/Hz).
    fn johnson(&self) -> DMatrix<f64> {
        let electrics = &self.system().electrics;
        let t = surroundings(self.compiled);
        let electrical = |k: usize| self.ports.answers[k] == PortResponse::Current;
        let p = self.ports.len();
        DMatrix::from_fn(p, p, |i, k| {
            if !electrical(i) || !electrical(k) {
                return 0.0;
            }
            let (a, b) = (self.ports.sources[i], self.ports.sources[k]);
            let (conducted, heated) =
                (electrics.conductance_between(&self.rise, a, b), electrics.heated_noise(&self.rise, a, b));
            4.0 * BOLTZMANN * (t * conducted + heated)
        })
    }
}
