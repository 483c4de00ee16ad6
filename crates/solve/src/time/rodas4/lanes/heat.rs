//! Free strains of heated beams in each lane: exponentials variant by variant, what they do to each heater in all lanes at once.
//!
//! As [`bimorph_domains::drive::Ramp`] has them for sources that hold their voltages: towards a rise that stays the same.

use bimorph_domains::Ramp;
use bimorph_domains::lag::Lag;
use bimorph_domains::thermal::HeatConductor;
use bimorph_multibody::batch::{LANES, Lane8, SimdReal};
use bimorph_multibody::scalar::StoredReal;

/// Time constants that a heater is compared with: those of the last heaters.
const COMPARED: usize = 4;

/// A heater in each variant.
#[derive(Debug, Clone, Copy)]
struct LaneHeater {
    /// Which of the lags is its own.
    lag: usize,
    /// Thermal expansion (1/K).
    expansion: Lane8,
    /// Rise at the start, and at last (K).
    start: Lane8,
    steady: Lane8,
    /// Time constant (s); 1 without one.
    time_constant: Lane8,
}

/// Exponentials of a time over a time constant, in each variant: [`Lag`].
#[derive(Debug, Clone, Copy)]
struct LaneLag {
    /// (s); 0: none.
    time_constant: Lane8,
    decay: Lane8,
    x: Lane8,
    first: Lane8,
}

/// The heaters of a mechanism.
#[derive(Debug, Clone)]
pub(in crate::time) struct LaneHeat {
    heaters: Vec<LaneHeater>,
    lags: Vec<LaneLag>,
    /// Time constants as they are, heater by heater (s).
    time_constants: Vec<Lane8>,
}

impl LaneHeat {
    /// For so many heaters as these.
    pub(in crate::time) fn new(heaters: &[HeatConductor]) -> Self {
        let none = Lane8::NONE;
        let heater = |_: &HeatConductor| LaneHeater {
            lag: 0,
            expansion: none,
            start: none,
            steady: none,
            time_constant: Lane8::of(1.0),
        };
        let time_constants = heaters.iter().map(|h| Lane8::of(h.time_constant)).collect();
        let mut new = Self { heaters: heaters.iter().map(heater).collect(), lags: Vec::new(), time_constants };
        new.share();
        new
    }

    pub(in crate::time) fn count(&self) -> usize {
        self.heaters.len()
    }

    /// Puts the heaters of a variant into one lane.
    pub(in crate::time) fn set_lane(&mut self, lane: usize, ramp: &Ramp<'_>) {
        let all = ramp.electrics.heating.heaters.iter().enumerate();
        for ((to, tau), (k, heater)) in self.heaters.iter_mut().zip(&mut self.time_constants).zip(all) {
            let lags = heater.time_constant > 0.0;
            tau.set_lane(lane, if lags { heater.time_constant } else { 0.0 });
            to.time_constant.set_lane(lane, if lags { heater.time_constant } else { 1.0 });
            to.expansion.set_lane(lane, heater.expansion);
            to.start.set_lane(lane, ramp.rise[k]);
            to.steady.set_lane(lane, ramp.steady_at_start(k));
        }
        self.share();
    }

    /// Heaters with the same time constants in all lanes have one lag.
    fn share(&mut self) {
        self.lags.clear();
        for (heater, tau) in self.heaters.iter_mut().zip(&self.time_constants) {
            let first = self.lags.len().saturating_sub(COMPARED);
            let known = self.lags[first..].iter().position(|lag| lag.time_constant.0 == tau.0);
            heater.lag = match known {
                Some(k) => first + k,
                None => {
                    let none = Lane8::NONE;
                    self.lags.push(LaneLag { time_constant: *tau, decay: none, x: none, first: none });
                    self.lags.len() - 1
                }
            };
        }
    }

    /// Goes to the time of each lane (s), where it is one.
    pub(in crate::time) fn at(&mut self, s: [Option<f64>; LANES]) {
        for lag in &mut self.lags {
            for (k, s) in s.iter().enumerate() {
                let Some(s) = *s else { continue };
                let tau = lag.time_constant.lane(k);
                // without a lag it is there at once
                let [decay, x, first] = if tau > 0.0 { Lag::new(tau, s).towards() } else { [0.0, 1.0, 1.0] };
                lag.decay.set_lane(k, decay);
                lag.x.set_lane(k, x);
                lag.first.set_lane(k, first);
            }
        }
    }

    /// The free strain of each heater at that time.
    #[inline(always)]
    pub(in crate::time) fn expansions<W: SimdReal>(&self, simd: W::Simd, to: &mut [Lane8]) {
        for (heater, to) in self.heaters.iter().zip(to) {
            (W::load(simd, &heater.expansion) * self.rise::<W>(simd, heater)).store(to);
        }
    }

    /// Its rate of change (1/s).
    #[inline(always)]
    pub(in crate::time) fn rates<W: SimdReal>(&self, simd: W::Simd, to: &mut [Lane8]) {
        for (heater, to) in self.heaters.iter().zip(to) {
            let of = |x: &Lane8| W::load(simd, x);
            let slope = (of(&heater.steady) - self.rise::<W>(simd, heater)) / of(&heater.time_constant);
            (of(&heater.expansion) * slope).store(to);
        }
    }

    #[inline(always)]
    fn rise<W: SimdReal>(&self, simd: W::Simd, heater: &LaneHeater) -> W {
        let (lag, of) = (&self.lags[heater.lag], |x: &Lane8| W::load(simd, x));
        of(&heater.start) * of(&lag.decay) + of(&lag.x) * (of(&heater.steady) * of(&lag.first))
    }
}
