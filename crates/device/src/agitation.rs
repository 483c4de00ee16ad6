//! Thermal agitation in time: the random force of gas and dampers at temperature, determined by a seed.
//!
//! Time is cut into cells of τ = 1/(2·band). In each the random force of [`bimorph_multibody::agitation`] is constant, with the
//! variance 2·k_B·T·C/τ, so that its one-sided spectral density is
//! ```text
//! S_F(f) = 4·k_B·T·C·sinc²(f·τ)        sinc x = sin πx/(πx)
//! ```
//! flat to 1 % up to a tenth of the band, half of it at 0.89 times the band. Over a step that crosses cells the mean of the
//! force acts, which is the same push. The numbers of a cell follow from the seed and the cell's place alone: a
//! step that is taken again, in other pieces, in another process, meets the same force, and trials stay pure.

pub use super::contract::Agitation;
use super::contract::DeviceError;
use bimorph_analysis::modes::modes;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::agitation::{self, BOLTZMANN};
use bimorph_multibody::planar::Pose;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Default band, in lowest natural frequencies (1).
const BAND: f64 = 20.0;
/// Highest band (Hz): beyond what any mechanism feels.
const HIGHEST: f64 = 1e12;
/// Cells that one step may cross: beyond, the mean of the force says too little.
const MAX_CELLS: f64 = 2.0;

/// An agitation of a model.
#[derive(Debug, Clone)]
pub(super) struct ThermalForce {
    seed: u64,
    /// Length of a cell (s).
    pub(super) cell: f64,
    /// √(2·k_B·T/τ) [√(J/s)].
    size: f64,
    /// Force of one cell.
    force: Vec<Pose>,
    /// Mean force over the step that begins and lasts so: Newton's iteration requests one step several times.
    mean: Vec<Pose>,
    over: Option<(f64, f64)>,
}

/// A normally distributed number of variance 1 (G. E. P. Box, M. E. Muller, Ann. Math. Statist. 29, 1958), to 2⁻⁵³ of a turn.
fn normal(numbers: &mut ChaCha8Rng) -> f64 {
    let mut share = || ((numbers.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53);
    let (radius, turn) = ((-2.0 * share().ln()).sqrt(), 2.0 * std::f64::consts::PI * share());
    radius * turn.cos()
}

impl ThermalForce {
    /// Of a model whose surroundings are at `temperature` (K).
    ///
    /// # Errors
    /// [`DeviceError::BadRequest`] for an invalid band, or a missing one.
    pub(super) fn new(asked: &Agitation, compiled: &CompiledModel, temperature: f64) -> Result<Self, DeviceError> {
        let refused = |expected: &str, got: String| DeviceError::BadRequest {
            what: "noise band",
            expected: expected.into(),
            got,
        };
        let band = match asked.band {
            Some(band) => band,
            None => {
                let lowest = modes(compiled, 1, &[]).map_err(|why| {
                    refused("one that is given, in hertz", format!("none, and the lowest mode was not found ({why})"))
                })?;
                BAND * lowest.frequencies_hz.first().copied().unwrap_or(0.0)
            }
        };
        if !(band > 0.0 && band <= HIGHEST) {
            return Err(refused("a frequency above 0 and at most 1e12 Hz", format!("{band:e}")));
        }
        let cell = 0.5 / band;
        let size = (2.0 * BOLTZMANN * temperature / cell).sqrt();
        let still = vec![Pose::zeros(); compiled.parts.system.bodies()];
        Ok(Self { seed: asked.seed, cell, size, force: still.clone(), mean: still, over: None })
    }

    /// The mean force over the last step passed to [`ThermalForce::over`].
    pub(super) fn mean(&self) -> &[Pose] {
        &self.mean
    }

    /// Finds the mean force over the `dt` seconds from `start`; or the longest step that may be taken.
    ///
    /// # Errors
    /// That step (s).
    pub(super) fn over(&mut self, compiled: &CompiledModel, start: f64, dt: f64) -> Result<(), f64> {
        if self.over == Some((start, dt)) {
            return Ok(());
        }
        // times are sums of steps: an excess over the end of a cell by rounding does not enter the next cell
        let rounding = 1e-9;
        let (from, to) = (start / self.cell, (start + dt) / self.cell);
        if to - from > MAX_CELLS * (1.0 + rounding) {
            return Err(self.cell);
        }
        self.over = None;
        self.mean.fill(Pose::zeros());
        let (first, last) = ((from + rounding).floor(), (to - rounding).floor());
        let mut cell = first;
        while cell <= last.max(first) {
            let share = ((cell + 1.0).min(to) - cell.max(from)) / (to - from);
            let share = if first >= last { 1.0 } else { share };
            let mut numbers = ChaCha8Rng::seed_from_u64(self.seed);
            numbers.set_stream(cell as u64);
            let system = &compiled.parts.system;
            agitation::force(&system.model, || normal(&mut numbers), &mut self.force);
            for (mean, force) in self.mean.iter_mut().zip(&self.force) {
                *mean += force * (share * self.size);
            }
            cell += 1.0;
        }
        self.over = Some((start, dt));
        Ok(())
    }
}
