//! The reduced linear model of a mechanism about an operating point.
//!
//! With u the deviations of what is given to the ports from the operating point, in volts and amperes as a circuit has them, and
//! y what the ports answer and the signals show:
//! ```text
//! ẋ_j = ω_j·w_j
//! ẇ_j = −ω_j·x_j − Σ_k D_jk·w_k + ω_j·(Σ_q B_jq·u_q + Σ_l B'_jl·h_l)      j: modes that are kept
//! ḣ_l = (u_q(l) − h_l)/τ_l                                              l: lags of heaters
//! y   = y₀ + X·x + W·w + H·h + E·u + F·u̇
//! ```
//! x_j is the share of mode j, in micrometres of its largest displacement shown as volts, and w_j its rate over ω_j. D
//! is the whole damping matrix between the modes that are kept, not only its diagonal. E, F and H contain conductance,
//! capacitance and the static correction, which is the static response of all omitted modes. So the model is exact at
//! DC, and near every resonance that is kept. Directions of the static correction may be among the modes:
//! [`super::reduce`].
//!
//! Reference: R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics" (2006), §11.4, mode-acceleration.

use bimorph_device::PortKind;
use nalgebra::{Complex, DMatrix, DVector};

/// A port of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedPort {
    /// Its name in the netlist, or of the quantity.
    pub name: String,
    /// Kind of the port: its input and its output.
    pub kind: PortKind,
    /// Volts per unit of what lies across one that is not electrical.
    pub across: f64,
    /// Voltage at the operating point of a port that is given one (V); none where a flow is given, or there is no such point.
    pub bias: Option<f64>,
}

impl ReducedPort {
    /// Meaning of a volt and an ampere at the port, in ASCII.
    pub fn meaning(&self) -> String {
        let plain = |unit: &str| unit.replace('·', " ").replace('²', "^2");
        let ((_, given), (_, answered)) = (self.kind.given(), self.kind.answered());
        let flow = if matches!(self.kind, PortKind::Moment | PortKind::MomentRate) { "1e-3" } else { "1" };
        match self.kind {
            PortKind::Electrical => self.bias.map_or("a voltage".into(), |v| format!("{v:e} V at the operating point")),
            kind if kind.given_flow() => {
                format!("1 A is {flow} {}, 1 V is {:e} {}", plain(given), 1.0 / self.across, plain(answered))
            }
            _ => format!("1 V is {:e} {}", 1.0 / self.across, plain(given)),
        }
    }
}

/// A signal of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalShown {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Volts per unit.
    pub scale: f64,
}

/// A mode that is kept, or a direction of the static correction that swings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReducedMode {
    /// Its number among the undamped modes at the operating point, from 1; none for a direction of the static correction.
    pub number: Option<usize>,
    /// Angular frequency (rad/s).
    pub omega: f64,
}

/// The lag of heat behind one port.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatLag {
    /// Index of the port.
    pub port: usize,
    /// Time constant (s).
    pub tau: f64,
}

/// The model. p ports, n modes, l lags; r rows of y: the p ports, then the signals.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedModel {
    /// Ports.
    pub ports: Vec<ReducedPort>,
    /// Signals.
    pub signals: Vec<SignalShown>,
    /// Modes, ascending.
    pub modes: Vec<ReducedMode>,
    /// Lags.
    pub lags: Vec<HeatLag>,
    /// D, n × n (1/s).
    pub damping: DMatrix<f64>,
    /// B, n × p (V/V, V/A).
    pub push: DMatrix<f64>,
    /// B', n × l.
    pub push_lagged: DMatrix<f64>,
    /// y₀ (r): currents, or voltages across, at the operating point.
    pub at_rest: DVector<f64>,
    /// X, r × n.
    pub place: DMatrix<f64>,
    /// W, r × n.
    pub rate: DMatrix<f64>,
    /// H, r × l.
    pub lagged: DMatrix<f64>,
    /// E, r × p.
    pub direct: DMatrix<f64>,
    /// F, r × p (s).
    pub change: DMatrix<f64>,
}

impl ReducedModel {
    /// Number of rows of y.
    pub fn rows(&self) -> usize {
        self.ports.len() + self.signals.len()
    }

    /// Name of row `row` of y.
    pub fn row_name(&self, row: usize) -> &str {
        match row.checked_sub(self.ports.len()) {
            None => &self.ports[row].name,
            Some(k) => &self.signals[k].name,
        }
    }

    /// Matrix of the shares x of the modes at angular frequency `omega` (rad/s), n × n.
    fn matrix(&self, omega: f64) -> DMatrix<Complex<f64>> {
        let n = self.modes.len();
        DMatrix::from_fn(n, n, |j, k| {
            let own = self.modes[j].omega;
            let stiff = if j == k { own - omega * omega / own } else { 0.0 };
            Complex::new(stiff, omega * self.damping[(j, k)] / self.modes[k].omega)
        })
    }

    /// Change of y with a current out of the node of each mode's rate at angular frequency `omega` (rad/s), r × n; none at an undamped
    /// resonance.
    pub(super) fn response_to_modes(&self, omega: f64) -> Option<DMatrix<Complex<f64>>> {
        let n = self.modes.len();
        if n == 0 {
            return Some(DMatrix::zeros(self.rows(), 0));
        }
        let pushed = DMatrix::from_fn(n, n, |j, k| Complex::from(if j == k { -self.modes[j].omega } else { 0.0 }));
        let x = self.matrix(omega).lu().solve(&pushed)?;
        Some(DMatrix::from_fn(self.rows(), n, |r, j| self.by_mode(omega, r, j)) * x)
    }

    /// Shares x of the modes per unit of each input at angular frequency `omega` (rad/s), n × p; none at an undamped resonance.
    fn shares(&self, omega: f64) -> Option<DMatrix<Complex<f64>>> {
        let n = self.modes.len();
        if n == 0 {
            return Some(DMatrix::zeros(0, self.ports.len()));
        }
        let matrix = self.matrix(omega);
        let mut force =
            DMatrix::from_fn(n, self.ports.len(), |j, q| Complex::from(self.modes[j].omega * self.push[(j, q)]));
        for (l, lag) in self.lags.iter().enumerate() {
            let behind = Complex::new(1.0, omega * lag.tau).inv();
            for j in 0..n {
                force[(j, lag.port)] += behind * (self.modes[j].omega * self.push_lagged[(j, l)]);
            }
        }
        matrix.lu().solve(&force)
    }

    /// Δy/Δu at angular frequency `omega` (rad/s), r × p; none at an undamped resonance.
    pub fn response(&self, omega: f64) -> Option<DMatrix<Complex<f64>>> {
        let x = self.shares(omega)?;
        let by_mode = DMatrix::from_fn(self.rows(), self.modes.len(), |r, j| self.by_mode(omega, r, j));
        let mut y = by_mode * x;
        for r in 0..self.rows() {
            for q in 0..self.ports.len() {
                y[(r, q)] += Complex::new(self.direct[(r, q)], omega * self.change[(r, q)]);
            }
            for (l, lag) in self.lags.iter().enumerate() {
                y[(r, lag.port)] += Complex::new(1.0, omega * lag.tau).inv() * self.lagged[(r, l)];
            }
        }
        Some(y)
    }

    /// Row `row` of y per unit share of mode `mode`.
    fn by_mode(&self, omega: f64, row: usize, mode: usize) -> Complex<f64> {
        Complex::new(self.place[(row, mode)], omega / self.modes[mode].omega * self.rate[(row, mode)])
    }

    /// Magnitudes of the terms that [`ReducedModel::response`] sums, mode by mode and the rest, r × p: the scale for a
    /// value where they cancel.
    pub fn parts(&self, omega: f64) -> DMatrix<f64> {
        let mut parts = DMatrix::from_fn(self.rows(), self.ports.len(), |r, q| {
            self.direct[(r, q)].hypot(omega * self.change[(r, q)])
        });
        for r in 0..self.rows() {
            for (l, lag) in self.lags.iter().enumerate() {
                parts[(r, lag.port)] += self.lagged[(r, l)].abs() / 1f64.hypot(omega * lag.tau);
            }
            for q in 0..self.ports.len() {
                parts[(r, q)] += (0..self.modes.len()).map(|j| self.share_of(omega, r, q, j)).sum::<f64>();
            }
        }
        parts
    }

    /// Magnitude of what mode `mode` alone contributes to row `row` per unit of input `port`.
    pub fn share_of(&self, omega: f64, row: usize, port: usize, mode: usize) -> f64 {
        let own = self.modes[mode].omega;
        let mut push = self.push[(mode, port)].abs();
        for (l, lag) in self.lags.iter().enumerate().filter(|(_, lag)| lag.port == port) {
            push += self.push_lagged[(mode, l)].abs() / 1f64.hypot(omega * lag.tau);
        }
        let stiff = Complex::new(own - omega * omega / own, omega * self.damping[(mode, mode)] / own);
        self.by_mode(omega, row, mode).norm() * own * push / stiff.norm()
    }

    /// Upper bound of a modal contribution, r × p: the product of the row's largest output factor, the input's largest
    /// input factor and the nearest resonance. A coupling below the rounding fraction of it counts as zero.
    pub fn reach(&self, omega: f64) -> DMatrix<f64> {
        let n = self.modes.len();
        let seen: Vec<f64> =
            (0..self.rows()).map(|r| (0..n).map(|j| self.by_mode(omega, r, j).norm()).fold(0.0, f64::max)).collect();
        let pushed: Vec<f64> = (0..self.ports.len())
            .map(|q| {
                let lagged = |j: usize| -> f64 {
                    let of = self.lags.iter().enumerate().filter(|(_, lag)| lag.port == q);
                    of.map(|(l, _)| self.push_lagged[(j, l)].abs()).sum()
                };
                (0..n).map(|j| self.push[(j, q)].abs() + lagged(j)).fold(0.0, f64::max)
            })
            .collect();
        let nearest = (0..n).map(|j| {
            let own = self.modes[j].omega;
            let (stiff, drag) = (1.0 - (omega / own).powi(2), omega * self.damping[(j, j)] / (own * own));
            1.0 / stiff.hypot(drag).max(f64::EPSILON)
        });
        let nearest = nearest.fold(1.0, f64::max);
        DMatrix::from_fn(self.rows(), self.ports.len(), |r, q| nearest * seen[r] * pushed[q])
    }
}
