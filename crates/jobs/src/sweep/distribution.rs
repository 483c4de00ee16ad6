//! How a parameter varies: a distribution, by its quantiles.

use super::error::{SweepError, bad};
use bimorph_base::Setting;
use bimorph_netlist::parse_setting;
use std::str::FromStr;

/// The distribution of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Gauss' distribution.
    Normal {
        /// Mean, in the parameter's own unit.
        mean: f64,
        /// Standard deviation, not negative.
        deviation: f64,
    },
    /// Every value from `low` to `high` alike.
    Uniform {
        /// Least value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// ln x is normal: a product of many small factors.
    LogNormal {
        /// Median, positive.
        median: f64,
        /// Standard deviation of ln x (1), about the relative one of x where it is small.
        deviation: f64,
    },
}

/// A parameter that varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// A netlist parameter.
    pub name: String,
    /// Its distribution.
    pub distribution: Distribution,
}

impl Distribution {
    /// The value below which the fraction `u` lies, 0 < u < 1, and `score`, the same fraction's quantile of the standard normal distribution.
    pub fn quantile(&self, u: f64, score: f64) -> f64 {
        match *self {
            Self::Normal { mean, deviation } => mean + deviation * score,
            Self::Uniform { low, high } => low + (high - low) * u,
            Self::LogNormal { median, deviation } => median * (deviation * score).exp(),
        }
    }

    /// # Errors
    /// [`SweepError::BadSpec`] for numbers that are no distribution.
    pub fn check(&self, name: &str) -> Result<(), SweepError> {
        let (fits, expected) = match *self {
            Self::Normal { deviation, .. } => {
                (deviation >= 0.0 && self.is_finite(), "a mean and a deviation from 0, and numbers that are finite")
            }
            Self::Uniform { low, high } => {
                (low.is_finite() && high.is_finite() && low <= high && (high - low).is_finite(), "a low and a high end")
            }
            Self::LogNormal { median, deviation } => {
                let sound = median > 0.0 && (0.0..=50.0).contains(&deviation) && self.is_finite();
                (sound, "a median above 0 and a deviation of its logarithm from 0 to 50, and numbers that are finite")
            }
        };
        if fits { Ok(()) } else { Err(bad(format!("distribution of \"{name}\""), expected, &format!("{self:?}"))) }
    }
}

impl Distribution {
    /// Whether what is drawn is finite: ten deviations from the middle, where no sample ever comes.
    fn is_finite(&self) -> bool {
        [-10.0, 10.0].iter().all(|score| self.quantile(0.5, *score).is_finite())
    }
}

impl FromStr for Vary {
    type Err = SweepError;

    /// `NAME=normal:MEAN:DEVIATION`, `NAME=uniform:LOW:HIGH`, `NAME=lognormal:MEDIAN:DEVIATION_OF_LN`; numbers may carry a netlist suffix.
    fn from_str(text: &str) -> Result<Self, SweepError> {
        let forms = "NAME=normal:MEAN:DEVIATION, NAME=uniform:LOW:HIGH or NAME=lognormal:MEDIAN:DEVIATION";
        let refused = |got: &str| bad(format!("variation \"{text}\""), forms, got);
        let (name, given) = text.split_once('=').ok_or_else(|| refused("no \"=\""))?;
        let parts: Vec<&str> = given.split(':').map(str::trim).collect();
        let [kind, first, second] = parts[..] else { return Err(refused(given)) };
        let read = |text: &str| number(text).ok_or_else(|| refused(text));
        let (a, b) = (read(first)?, read(second)?);
        let distribution = match kind {
            "normal" => Distribution::Normal { mean: a, deviation: b },
            "uniform" => Distribution::Uniform { low: a, high: b },
            "lognormal" => Distribution::LogNormal { median: a, deviation: b },
            other => return Err(refused(other)),
        };
        let name = name.trim();
        if name.is_empty() {
            return Err(refused("no name"));
        }
        distribution.check(name)?;
        Ok(Self { name: name.to_owned(), distribution })
    }
}

/// The quantile of the standard normal distribution, 0 < u < 1, to some 1e-16 relative.
///
/// M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution", Applied Statistics 37 (1988), PPND16.
// digits as published
#[allow(clippy::excessive_precision)]
#[rustfmt::skip]
pub(super) fn normal_score(u: f64) -> f64 {
    const A: [f64; 8] = [
        3.387_132_872_796_366_608, 1.331_416_678_917_843_774_5e2, 1.971_590_950_306_551_442_7e3, 1.373_169_376_550_946_112_5e4,
        4.592_195_393_154_987_145_7e4, 6.726_577_092_700_870_085_3e4, 3.343_057_558_358_812_810_5e4, 2.509_080_928_730_122_672_7e3,
    ];
    const B: [f64; 8] = [
        1.0, 4.231_333_070_160_091_125_2e1, 6.871_870_074_920_579_083e2, 5.394_196_021_424_751_107_7e3,
        2.121_379_430_158_659_586_7e4, 3.930_789_580_009_271_061e4, 2.872_908_573_572_194_267_4e4, 5.226_495_278_852_854_561e3,
    ];
    const C: [f64; 8] = [
        1.423_437_110_749_683_577_34, 4.630_337_846_156_545_295_9, 5.769_497_221_460_691_405_5, 3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58, 2.417_807_251_774_506_117_7e-1, 2.272_384_498_926_918_458_33e-2, 7.745_450_142_783_414_076_4e-4,
    ];
    const D: [f64; 8] = [
        1.0, 2.053_191_626_637_758_821_87, 1.676_384_830_183_803_849_4, 6.897_673_349_851_000_045_5e-1,
        1.481_039_764_274_800_745_9e-1, 1.519_866_656_361_645_719_66e-2, 5.475_938_084_995_344_946e-4, 1.050_750_071_644_416_843_24e-9,
    ];
    const E: [f64; 8] = [
        6.657_904_643_501_103_777_2, 5.463_784_911_164_114_369_9, 1.784_826_539_917_291_335_8, 2.965_605_718_285_048_912_3e-1,
        2.653_218_952_657_612_309_3e-2, 1.242_660_947_388_078_438_6e-3, 2.711_555_568_743_487_578_15e-5, 2.010_334_399_292_288_132_65e-7,
    ];
    const F: [f64; 8] = [
        1.0, 5.998_322_065_558_879_376_9e-1, 1.369_298_809_227_358_053_1e-1, 1.487_536_129_085_061_485_25e-2,
        7.868_691_311_456_132_591e-4, 1.846_318_317_510_054_681_8e-5, 1.421_511_758_316_445_888_7e-7, 2.044_263_103_389_939_785_64e-15,
    ];
    let ratio = |top: &[f64; 8], below: &[f64; 8], r: f64| {
        let polynomial = |of: &[f64; 8]| of.iter().rev().fold(0.0, |sum, c| sum * r + c);
        polynomial(top) / polynomial(below)
    };
    let q = u - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(&A, &B, 0.180_625 - q * q);
    }
    let tail = if q < 0.0 { u } else { 1.0 - u };
    let r = (-tail.ln()).sqrt();
    let score = if r <= 5.0 { ratio(&C, &D, r - 1.6) } else { ratio(&E, &F, r - 5.0) };
    if q < 0.0 { -score } else { score }
}

/// A finite number as the netlist language writes it.
pub fn number(text: &str) -> Option<f64> {
    match parse_setting(text) {
        Ok(Setting::Number(value)) if value.is_finite() => Some(value),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    //! Quantiles are those of the distributions; slips are refused.
    use super::*;

    /// Numbers: `statistics.NormalDist().inv_cdf` of Python 3.11.
    #[test]
    fn scores_of_the_normal_distribution() {
        for (u, expected) in SCORES {
            let score = normal_score(u);
            assert!((score - expected).abs() <= 2e-15 * expected.abs().max(1e-3), "{u}: {score} {expected}");
        }
        assert_eq!(normal_score(0.5), 0.0);
        assert_eq!(normal_score(0.25), -normal_score(0.75));
    }

    const SCORES: [(f64, f64); 6] = [
        (0.1, -1.2815515655446008),
        (0.3, -0.5244005127080407),
        (0.93, 1.4757910281791708),
        (0.9999, 3.7190164854557084),
        (1e-08, -5.61200124417479),
        (1e-14, -7.650628092935268),
    ];

    #[test]
    fn variations_read_as_they_are_written() {
        let vary: Vary = "w=normal:2u:0.05u".parse().unwrap();
        assert_eq!(vary.name, "w");
        let Distribution::Normal { mean, deviation } = vary.distribution else { panic!("{vary:?}") };
        assert!((mean - 2e-6).abs() < 1e-20 && (deviation - 5e-8).abs() < 1e-22);
        let quantile = |text: &str, u: f64| text.parse::<Vary>().unwrap().distribution.quantile(u, normal_score(u));
        assert_eq!(quantile("g=uniform:1:3", 0.25), 1.5);
        assert!((quantile("E=lognormal:165e9:0.1", 0.5) - 165e9).abs() < 1.0);
        for text in [
            "w",
            "w=normal",
            "w=normal:1",
            "w=normal:1:-1",
            "w=normal:nan:1",
            "w=uniform:3:1",
            "w=lognormal:0:1",
            "w=lognormal:1:-1",
            "=normal:1:1",
            "w=gauss:1:1",
            "w=normal:1:2:3",
            "w=normal:1:1e999",
        ] {
            assert!(text.parse::<Vary>().is_err(), "{text}");
        }
    }
}
