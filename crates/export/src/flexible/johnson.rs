//! Johnson's noise of what conducts between ports: by the temperature of the surroundings, and by the rises of heaters.

use super::heat::HeatCourses;
use bimorph_analysis::readout::ports::{OpenedPorts, PortResponse};
use bimorph_domains::drive::Electrics;
use nalgebra::DMatrix;

/// Conductances that make noise.
#[derive(Debug, Clone, PartialEq)]
pub struct ConductedNoise {
    /// Temperature of the surroundings (K).
    pub temperature: f64,
    /// Electrical ports, by their place among all.
    pub ports: Vec<usize>,
    /// Conductance between these (S).
    pub conductance: DMatrix<f64>,
    /// Of each lag of heat, what noise a kelvin of it adds (S).
    pub heated: Vec<DMatrix<f64>>,
}

impl ConductedNoise {
    /// Those of a mechanism whose resistances do not depend on temperature.
    pub fn new(electrics: &Electrics, opened: &OpenedPorts, heat: &HeatCourses, temperature: f64) -> Self {
        let ports: Vec<usize> =
            (0..opened.answers.len()).filter(|&k| opened.answers[k] == PortResponse::Current).collect();
        let n = ports.len();
        let states = electrics.heating.states();
        let source = |k: usize| opened.sources[ports[k]];
        let between = |i, k| electrics.conductance_between(&vec![0.0; states], source(i), source(k));
        let conductance = DMatrix::from_fn(n, n, between);
        let heated = heat.shares.column_iter().map(|share| {
            let mut rise = vec![0.0; states];
            rise.iter_mut().zip(share.iter()).for_each(|(rise, share)| *rise = *share);
            DMatrix::from_fn(n, n, |i, k| electrics.heated_noise(&rise, source(i), source(k)))
        });
        let heated = heated.collect();
        Self { temperature, ports, conductance, heated }
    }
}
