//! Samples of random parameters.

use super::{Violation, number, required};
use crate::proto;
use bimorph_jobs::sweep::{Design, Distribution, SampleGenerator, Sampling, Vary};
use proto::sweep_vary::Distribution as Wire;

/// The request as a message.
pub(super) fn to_wire(asked: &Sampling) -> proto::SweepSamples {
    let vary = |vary: &Vary| proto::SweepVary {
        name: vary.name.clone(),
        distribution: Some(match vary.distribution {
            Distribution::Normal { mean, deviation } => Wire::Normal(proto::SweepNormal { mean, deviation }),
            Distribution::Uniform { low, high } => Wire::Uniform(proto::SweepUniform { low, high }),
            Distribution::LogNormal { median, deviation } => {
                Wire::LogNormal(proto::SweepLogNormal { median, deviation })
            }
        }),
    };
    let design = match asked.design {
        Design::Random => proto::sweep_samples::Design::Random,
        Design::LatinHypercube => proto::sweep_samples::Design::LatinHypercube,
        Design::Sobol => proto::sweep_samples::Design::Sobol,
    };
    let correlation =
        |(a, b, value): &(String, String, f64)| proto::SweepCorrelation { a: a.clone(), b: b.clone(), value: *value };
    proto::SweepSamples {
        vary: asked.vary.iter().map(vary).collect(),
        count: u32::try_from(asked.count).unwrap_or(u32::MAX),
        seed: asked.seed,
        design: design.into(),
        correlations: asked.correlations.iter().map(correlation).collect(),
    }
}

/// Checked samples. Nothing is laid out for them.
pub(super) fn from_wire(samples: proto::SweepSamples) -> Result<SampleGenerator, Violation> {
    use proto::sweep_samples::Design as WireDesign;
    let design = match WireDesign::try_from(samples.design) {
        Ok(WireDesign::Random) => Design::Random,
        Ok(WireDesign::Unspecified | WireDesign::LatinHypercube) => Design::LatinHypercube,
        Ok(WireDesign::Sobol) => Design::Sobol,
        Err(_) => {
            return Err(Violation::new("spec.samples.design", format!("{} is no design", samples.design)));
        }
    };
    let vary = |(i, vary): (usize, proto::SweepVary)| {
        let field = format!("spec.samples.vary[{i}]");
        let read = |name: &str, value: f64| number(&format!("{field}.{name}"), value, false);
        let distribution = match required(&format!("{field}.distribution"), vary.distribution)? {
            Wire::Normal(n) => Distribution::Normal {
                mean: read("normal.mean", n.mean)?,
                deviation: read("normal.deviation", n.deviation)?,
            },
            Wire::Uniform(u) => {
                Distribution::Uniform { low: read("uniform.low", u.low)?, high: read("uniform.high", u.high)? }
            }
            Wire::LogNormal(l) => Distribution::LogNormal {
                median: read("log_normal.median", l.median)?,
                deviation: read("log_normal.deviation", l.deviation)?,
            },
        };
        if vary.name.is_empty() {
            return Err(Violation::new(format!("{field}.name"), "the parameter has no name"));
        }
        Ok(Vary { name: vary.name, distribution })
    };
    let asked = Sampling {
        vary: samples.vary.into_iter().enumerate().map(vary).collect::<Result<_, _>>()?,
        count: samples.count as usize,
        seed: samples.seed,
        design,
        correlations: samples.correlations.into_iter().map(|c| (c.a, c.b, c.value)).collect(),
    };
    SampleGenerator::new(asked).map_err(|error| Violation::new("spec.samples", error.to_string()))
}
