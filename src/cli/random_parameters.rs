//! Options of random parameters.

use super::failure::Failure;
use bimorph::jobs::sweep::{Design, SampleGenerator, Sampling, Vary};
use clap::Args;

/// Samples of parameters that vary.
#[derive(Debug, Args)]
pub(crate) struct SamplingArgs {
    /// A random parameter: NAME=normal:MEAN:DEVIATION, NAME=uniform:LOW:HIGH or NAME=lognormal:MEDIAN:DEVIATION_OF_LN.
    /// Repeatable; beside --param the samples are drawn at every point of the grid (process corners)
    #[arg(long, value_name = "NAME=DISTRIBUTION", requires = "samples")]
    vary: Vec<Vary>,

    /// Samples of what varies
    #[arg(long, value_name = "N", requires = "vary")]
    samples: Option<usize>,

    /// The same seed draws the same samples
    #[arg(long, default_value_t = 0, requires = "vary")]
    seed: u64,

    /// How samples fill the space: random, lhs (Latin hypercube) or sobol (scrambled Sobol sequence; powers of two fill best)
    #[arg(long, default_value = "lhs", requires = "vary")]
    design: Design,

    /// Correlation of two normal or lognormal parameters (of ln x there), -1 < R < 1. Repeatable
    #[arg(long, value_name = "A,B=R", value_parser = correlation, requires = "vary")]
    correlate: Vec<(String, String, f64)>,
}

impl SamplingArgs {
    /// The requested samples; `None` without random parameters.
    pub(crate) fn samples(&self) -> Result<Option<SampleGenerator>, Failure> {
        let Some(count) = self.samples else { return Ok(None) };
        let asked = Sampling {
            vary: self.vary.clone(),
            count,
            seed: self.seed,
            design: self.design,
            correlations: self.correlate.clone(),
        };
        Ok(Some(SampleGenerator::new(asked)?))
    }
}

/// `A,B=R`.
fn correlation(text: &str) -> Result<(String, String, f64), String> {
    let parsed = text.rsplit_once('=').and_then(|(names, r)| Some((names.split_once(',')?, r.trim().parse().ok()?)));
    let ((a, b), r) =
        parsed.ok_or_else(|| format!("expected A,B=R with a number R, such as wh,wc=0.8, got \"{text}\""))?;
    Ok((a.trim().to_owned(), b.trim().to_owned(), r))
}
