//! Equilibria of many variants of one mechanism: in lanes where that is possible, with the bits of each alone.
//!
//! A variant that differs from the first in more than numbers, or meets an event on its path, gets `None`.
//! [`super::statics`] then finds its equilibrium or reports the error.

use super::PortVoltages;
use super::contact_range::within_contact_range;
use super::statics::{OperatingPoint, settled, source_vector};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::batch::LANES;
use bimorph_multibody::planar::Pose;
use bimorph_solve::equilibrium::Path;
use bimorph_solve::equilibrium::batch::{BatchPath, LaneEquilibrium};
use bimorph_solve::path::SourcePath;

/// Lanes for variants like one of them.
#[derive(Debug, Clone)]
pub struct BatchStatics(LaneEquilibrium);

/// A variant to be settled: where from, if not from rest.
pub(crate) type BatchStart<'a> = (&'a CompiledModel, Option<Vec<Pose>>);

/// A variant's sources at the end and at the beginning, and where it begins.
struct BatchEquilibrium {
    number: usize,
    sources: Vec<f64>,
    from: Vec<f64>,
    q: Vec<Pose>,
}

impl BatchStatics {
    /// For variants like `first`; none where it has no lanes.
    pub fn new(first: &CompiledModel) -> Option<Self> {
        let system = &first.parts.system;
        if system.sticks() { None } else { LaneEquilibrium::new(system).map(Self) }
    }

    /// The equilibrium of each variant, from rest or, for all of them, next to where they begin. None for one whose equilibrium has to be
    /// found alone.
    pub fn points(&self, variants: &[BatchStart<'_>], voltages: &PortVoltages) -> Vec<Option<OperatingPoint>> {
        let mut points: Vec<Option<OperatingPoint>> = vec![None; variants.len()];
        let lay = |(number, (compiled, start)): (usize, &BatchStart<'_>)| {
            let system = &compiled.parts.system;
            let sources = source_vector(compiled, voltages).ok().filter(|_| self.0.fits(system) && !system.sticks())?;
            let rest = vec![0.0; sources.len()];
            let from = if start.is_some() { sources.clone() } else { rest };
            let q = start.clone().unwrap_or_else(|| vec![Pose::zeros(); system.bodies()]);
            Some(BatchEquilibrium { number, sources, from, q })
        };
        let laid: Vec<BatchEquilibrium> = variants.iter().enumerate().filter_map(lay).collect();
        if laid.is_empty() {
            return points;
        }
        let mut lanes = self.0.clone();
        for some in laid.chunks(LANES) {
            let path = |laid: &BatchEquilibrium| {
                let (compiled, start) = &variants[laid.number];
                let share = if start.is_some() { 1.0 } else { 0.0 };
                (compiled, share)
            };
            let paths: Vec<SourcePath<'_>> = (some.iter())
                .map(|laid| {
                    let (compiled, share) = path(laid);
                    SourcePath::new(&compiled.parts.system.electrics, &laid.from, &laid.sources, [share, 1.0])
                })
                .collect();
            let ways: Vec<BatchPath<'_>> = (some.iter().zip(&paths))
                .map(|(laid, along)| BatchPath { system: &path(laid).0.parts.system, path: along, q: &laid.q })
                .collect();
            for (laid, arrived) in some.iter().zip(lanes.follow(&ways)) {
                let (compiled, _) = path(laid);
                points[laid.number] = arrived.and_then(|arrived| {
                    let electrics = &compiled.parts.system.electrics;
                    within_contact_range(compiled, &arrived.q, |gap| electrics.is_energised(gap, &laid.sources))
                        .ok()?;
                    let path = Path { iterations: arrived.iterations, passed: Vec::new(), reached: 1.0 };
                    Some(settled(compiled, arrived.q, laid.sources.clone(), path, Vec::new()))
                });
            }
        }
        points
    }
}
