//! Reduced models in circuits: trained once for the ranges of the ports, with polynomial forces throughout.

use super::ranges::range_inputs;
use super::{FULL_IN_TIME, MOMENTS, trained};
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_model::compile::CompiledModel;
use bimorph_solve::reduced::ReducedSpace;
use bimorph_solve::reduced::polynomial::moving::of_motion;
use bimorph_solve::time::reduced_rodas4::ReducedRodas4;
use std::sync::Arc;

/// Part of a range that an input may lie beyond it (1).
const BEYOND: f64 = 0.1;

/// A reduced model of a circuit. Immutable; shared by sessions.
#[derive(Debug)]
pub struct CircuitReduction {
    /// The method at rest, whose copies step.
    method: ReducedRodas4,
    /// The space.
    pub space: Arc<ReducedSpace>,
    /// Sources of the opened ports with the ranges of the training.
    ranges: Vec<(usize, [f64; 2])>,
    /// Names the coordinates: states of another training mean something else.
    pub tag: u64,
}

impl CircuitReduction {
    /// Trains a model for its option `ranges`, with ports `names` that are `sources`; `shortest` is about the shortest time in which something moves (s).
    ///
    /// # Errors
    /// Why the full model is taken.
    pub fn train(
        compiled: &CompiledModel,
        system: &System,
        (names, sources): (&[String], &[usize]),
        shortest: f64,
    ) -> Result<Self, String> {
        let tol = compiled.options.errors().requested();
        if tol < FULL_IN_TIME {
            return Err(format!(
                "at a tolerance of {tol:e} its error in time may be larger; a tol of {FULL_IN_TIME:e} or more takes it"
            ));
        }
        let Some(given) = &compiled.options.ranges else {
            return Err(
                "no range of a port is given; give ranges=\"NAME:LOW:HIGH\" for those that a source drives".into()
            );
        };
        let ranges: Vec<[f64; 2]> = names.iter().map(|name| given.of(name).unwrap_or([0.0; 2])).collect();
        let inputs = range_inputs(system, sources, &ranges);
        let largest = inputs.drive(&vec![1.0; inputs.inputs.len()]);
        let training = trained(&[(system, inputs)], tol, MOMENTS)?;
        let fitted = of_motion(&training, system, &largest, ErrorBudget::of(tol)).ok_or_else(|| {
            "its forces are no polynomials within 0.3 of the tolerance (or friction or gas acts that has none); narrower ranges or a larger tol may have them"
                .to_owned()
        })?;
        let space = Arc::new(fitted.space);
        let share = compiled.options.errors().reduced_statics();
        let method = ReducedRodas4::new(Arc::clone(&space), shortest)
            .with_polynomials(fitted.polynomials, share, fitted.largest)
            .with_ports(sources);
        let tag = tag(&space);
        Ok(Self { method, space, ranges: sources.iter().copied().zip(ranges).collect(), tag })
    }

    /// A copy that steps.
    pub fn method(&self) -> ReducedRodas4 {
        self.method.clone()
    }

    /// The first port that is given more than its range and a tenth of it, with what it is given and the range.
    pub fn beyond(&self, given: &[f64]) -> Option<(usize, f64, [f64; 2])> {
        self.ranges.iter().enumerate().find_map(|(port, (source, range))| {
            let (x, more) = (given[*source], BEYOND * (range[1] - range[0]));
            (x < range[0].min(0.0) - more || x > range[1].max(0.0) + more).then_some((port, x, *range))
        })
    }
}

/// FNV-1a over the directions; the polynomials follow from them.
fn tag(space: &ReducedSpace) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for x in space.directions.iter().flatten().flat_map(|pose| pose.iter()) {
        for byte in x.to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    hash
}
