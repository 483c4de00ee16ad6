//! The mechanism of a chart on one mesh, before and after release.

use super::spec::{ChartError, Formulation};
use crate::AnalysisError;
use bimorph_base::Setting;
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation as Bodies, draw};
use bimorph_structure::FrontEnd;

/// The compiled mechanism, with what a release needs.
#[derive(Debug, Clone)]
pub(super) struct ChartVariant {
    initial: CompiledModel,
    released: Option<CompiledModel>,
}

impl ChartVariant {
    /// Compiles `source` for one band.
    pub(super) fn new(
        source: &dyn FrontEnd,
        options: &CompileOptions,
        band: Option<f64>,
        release: Option<&str>,
    ) -> Result<Self, ChartError> {
        let initial = draw(source, &options.with_band(band))?.compile()?;
        let released = release.map(|name| released(source, &initial, name)).transpose()?;
        Ok(Self { initial, released })
    }

    /// The mechanism in motion.
    pub(super) fn moving(&self) -> &CompiledModel {
        self.released.as_ref().unwrap_or(&self.initial)
    }

    /// The mechanism whose equilibrium is the beginning; none: rest.
    pub(super) fn held(&self) -> Option<&CompiledModel> {
        self.released.as_ref().map(|_| &self.initial)
    }
}

/// The mechanism at one model order in every formulation of a chart.
#[derive(Debug, Clone)]
pub(super) struct FormulationModels {
    /// In the bodies' own coordinates.
    pub(super) bodies: ChartVariant,
    joints: Vec<(Formulation, Result<ChartVariant, String>)>,
}

impl FormulationModels {
    /// Compiles `source` for one band, once for each formulation that discretizes it differently.
    pub(super) fn new(
        source: &dyn FrontEnd,
        options: &CompileOptions,
        band: Option<f64>,
        release: Option<&str>,
        formulations: &[Formulation],
    ) -> Result<Self, ChartError> {
        let bodies = ChartVariant::new(source, &options.with_formulation(Bodies::Compliant), band, release)?;
        let compiled = |&one: &Formulation| {
            let options = options.with_formulation(one.compiled_as()?);
            // what bodies can be made of may not suit joints: points that say so
            Some((one, ChartVariant::new(source, &options, band, release).map_err(|e| e.to_string())))
        };
        Ok(Self { bodies, joints: formulations.iter().filter_map(compiled).collect() })
    }

    /// The model in a formulation, or the reason why it does not exist.
    pub(super) fn of(&self, formulation: Formulation) -> Result<&ChartVariant, &str> {
        match self.joints.iter().find(|(one, _)| *one == formulation) {
            Some((_, model)) => model.as_ref().map_err(String::as_str),
            None => Ok(&self.bodies),
        }
    }
}

/// The same netlist with one parameter at 0.
///
/// # Errors
/// `BadRequest` for an unknown or non-numeric parameter; errors of a compilation.
pub fn released(source: &dyn FrontEnd, initial: &CompiledModel, name: &str) -> Result<CompiledModel, ChartError> {
    if !initial.parameters.iter().any(|(p, value)| p == name && matches!(value, Setting::Number(_))) {
        let known: Vec<&str> = initial.parameters.iter().map(|(p, _)| p.as_str()).collect();
        let detail = format!("no numeric parameter of that name; the netlist has {}", known.join(", "));
        return Err(AnalysisError::BadRequest { what: format!("release \"{name}\""), detail }.into());
    }
    Ok(draw(source, &initial.requested_options().with_parameter(name, 0.0))?.compile()?)
}
