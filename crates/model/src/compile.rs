//! From what a front end reads to a ready model: structure → mesh → bodies and joints.

use crate::discretize::{Assembly, DiscretizeError, discretize_like, order, permanent_strain};
use crate::options::OptionError;
use crate::refine::imperfection;
use crate::refine::mesh_search::{self, Mesh};
use bimorph_base::{Diagnostic, Diagnostics, Setting};
use bimorph_multibody::joint_coordinates::sprung_loops::UnsupportedModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::equations::Joints;
use bimorph_structure::{Fringe, FrontEnd, Structure};
use std::sync::Arc;
use thiserror::Error;

pub use crate::options::{Anchors, CompileOptions, Formulation, FringeFields, Junctions, Scheme};

/// A ready model with everything it came from.
#[derive(Debug, Clone)]
pub struct CompiledModel {
    /// The structure.
    pub structure: Arc<Structure>,
    /// Netlist parameters with the values they took.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings of the netlist.
    pub warnings: Diagnostics,
    /// The options it was compiled with.
    pub options: CompileOptions,
    /// Requested values of options that were chosen.
    pub requested: RequestedChoices,
    /// Bodies, joints, gaps and electrics, and where the drawing's parts went.
    pub parts: Assembly,
    /// Segments of each beam, and the error estimated for them where a band was given or an analysis chose them.
    pub order: Mesh,
    /// The system in joint coordinates where the formulation has them; or why they cannot be had.
    pub joints: Option<Result<Arc<Joints>, UnsupportedModel>>,
    /// Its lowest mode, where that was looked for: in a circuit.
    pub lowest: Option<LowestMode>,
    /// Modes above that whose errors are known, where they were looked for: in a circuit.
    pub higher: Arc<[HigherMode]>,
}

/// Choices that were left to the model: the options have what was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RequestedChoices {
    /// The scheme; auto: that of the formulation.
    pub scheme: Scheme,
    /// The formulation; auto: that of the run.
    pub formulation: Formulation,
}

/// A mode above the lowest about the equilibrium without voltages.
#[derive(Debug, Clone, PartialEq)]
pub struct HigherMode {
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Quality by the drag and dampers of the drawing (1); infinite without.
    pub quality: f64,
    /// Estimated relative error of the frequency by the mesh (1).
    pub error: f64,
    /// Displacements of the bodies, of modal mass 1 kg.
    pub shape: Vec<Pose>,
}

/// The lowest mode about the equilibrium without voltages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowestMode {
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Quality by the drag and dampers of the drawing (1); infinite without.
    pub quality: f64,
    /// Estimated relative error of the frequency by the mesh (1).
    pub error: f64,
}

impl CompiledModel {
    /// Mechanical unknowns of the formulation.
    pub fn unknowns(&self) -> usize {
        match &self.joints {
            Some(Ok(joints)) => joints.tree.coordinates,
            _ => self.parts.system.model.unknowns(),
        }
    }

    /// The same model for analyses with another tolerance (1).
    #[must_use]
    pub fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { options: self.options.with_tolerance(tolerance), ..self.clone() }
    }

    /// The same drawing on another mesh.
    ///
    /// # Errors
    /// See [`DiscretizeError`].
    pub fn with_order(&self, order: Mesh) -> Result<Self, DiscretizeError> {
        let rigid = |segments: &[usize]| segments.iter().map(|n| *n == 0).collect::<Vec<_>>();
        let like = (rigid(&self.order.segments) == rigid(&order.segments)).then_some(&self.parts);
        let parts = laid_out(&self.structure, &self.options, &order.segments, like)?;
        Ok(Self {
            structure: Arc::clone(&self.structure),
            parameters: self.parameters.clone(),
            warnings: self.warnings.clone(),
            options: self.options.clone(),
            requested: self.requested,
            joints: in_joints_of(&parts, &self.options),
            parts,
            order,
            lowest: None,
            higher: Arc::default(),
        })
    }

    /// The options that were requested, for a variant of the same drawing.
    pub fn requested_options(&self) -> CompileOptions {
        self.options.with_formulation(self.requested.formulation).with_scheme(self.requested.scheme)
    }

    /// The drawing that it was compiled from.
    pub fn parsed(&self) -> ParsedStructure {
        let mut warnings = self.warnings.clone();
        warnings.items.retain(|warning| warning.code != BEYOND_TABLE);
        ParsedStructure {
            structure: Arc::clone(&self.structure),
            parameters: self.parameters.clone(),
            warnings,
            options: self.options.clone(),
            requested: self.requested,
        }
    }

    /// The same model for steps whose times a caller sets, where `auto` is compliant.
    #[must_use]
    pub fn for_given_steps(self) -> Self {
        match self.options.formulation {
            Formulation::Auto => Self { options: self.options.with_formulation(Formulation::Compliant), ..self },
            _ => self,
        }
    }
}

/// The code of the warning about junctions outside the calibrated range.
const BEYOND_TABLE: &str = "W017";

/// Errors of a compilation.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CompileError {
    /// An option is out of its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The netlist has errors.
    #[error("{0}")]
    Netlist(Diagnostics),
    /// The structure cannot be made into a model.
    #[error(transparent)]
    Structure(#[from] DiscretizeError),
}

/// A netlist as drawn with its options settled, before any mesh.
#[derive(Debug, Clone)]
pub struct ParsedStructure {
    /// The structure.
    pub structure: Arc<Structure>,
    /// Netlist parameters with the values they took.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings of the netlist.
    pub warnings: Diagnostics,
    /// The options, with what one of them says of another.
    pub options: CompileOptions,
    /// Requested values of options that were chosen.
    pub requested: RequestedChoices,
}

/// Draws a netlist that has been read: the part of a compilation that depends on the values of parameters alone.
///
/// # Errors
/// See [`CompileError`].
pub fn draw(source: &dyn FrontEnd, options: &CompileOptions) -> Result<ParsedStructure, CompileError> {
    options.check()?;
    let requested = RequestedChoices { scheme: options.scheme, formulation: options.formulation };
    let options = options.in_effect();
    let loaded = source.load(&options.set).map_err(CompileError::Netlist)?;
    let mut structure = if options.without_circuit { loaded.structure.without_circuit() } else { loaded.structure };
    let mut warnings = loaded.warnings;
    if let Some(law) = options.fringe.law() {
        structure.prescribe_fringe(law);
        // of the range of the law that is replaced, and of the factor that it cancels
        warnings.items.retain(|d| !(d.code == "W025" || d.code == "W026" && law != Fringe::Exact));
    }
    let structure = Arc::new(structure);
    Ok(ParsedStructure { structure, parameters: loaded.parameters, warnings, options, requested })
}

impl ParsedStructure {
    /// The same in another formulation, cut by its scheme where none was requested.
    #[must_use]
    pub fn in_formulation(self, formulation: Formulation) -> Self {
        let requested = self.options.with_scheme(self.requested.scheme);
        Self { options: requested.with_formulation(formulation).in_effect(), ..self }
    }

    /// The model on the mesh that the options specify.
    ///
    /// # Errors
    /// See [`CompileError`].
    pub fn compile(self) -> Result<CompiledModel, CompileError> {
        let order = match (self.options.band, self.options.segments) {
            (Some(band), None) => mesh_search::choose(&self.structure, &self.options, band)?,
            _ => {
                let segments = order::a_priori(&self.structure, &self.options)?;
                Mesh { segments, estimated_error: None, modes_in_band: 0, passes: 0 }
            }
        };
        Ok(self.on(order)?)
    }

    /// The model on a given mesh.
    ///
    /// # Errors
    /// See [`DiscretizeError`].
    pub fn on(mut self, order: Mesh) -> Result<CompiledModel, DiscretizeError> {
        let parts = laid_out(&self.structure, &self.options, &order.segments, None)?;
        self.warnings.items.extend(beyond_table(&self.structure, &self.options, &parts));
        Ok(CompiledModel {
            joints: in_joints_of(&parts, &self.options),
            structure: self.structure,
            parameters: self.parameters,
            warnings: self.warnings,
            options: self.options,
            requested: self.requested,
            parts,
            order,
            lowest: None,
            higher: Arc::default(),
        })
    }
}

/// Warning about junctions outside the calibrated range.
fn beyond_table(structure: &Structure, options: &CompileOptions, parts: &Assembly) -> Option<Diagnostic> {
    if options.junctions != Junctions::Calibrated {
        return None;
    }
    let found = parts.beyond_table(structure)?;
    let more = if found.count > 1 { format!(" ({} such beams in all)", found.count) } else { String::new() };
    let name = &structure.beams[found.first].name;
    let message = format!("the junctions of `{name}` are beyond what they were calibrated for: {}{more}", found.why);
    let help =
        "the accuracy given in docs/explanation/junctions.md does not hold there; compare with `--junctions offset`";
    Some(Diagnostic::warning(BEYOND_TABLE, message, help))
}

/// Bodies and joints, with the requested imperfection.
fn laid_out(
    structure: &Structure,
    options: &CompileOptions,
    segments: &[usize],
    other: Option<&Assembly>,
) -> Result<Assembly, DiscretizeError> {
    let mut parts = discretize_like(structure, options, segments, other)?;
    for (arm, strain) in
        permanent_strain::arms(&parts, &structure.yields).iter().zip(structure.yields.iter().map(|y| y.strain))
    {
        permanent_strain::strain(&mut parts, arm, strain);
    }
    if let Some(share) = options.imperfection {
        imperfection::apply(&mut parts, share * structure.extent());
    }
    Ok(parts)
}

/// The system in joint coordinates, where the formulation has them.
fn in_joints_of(parts: &Assembly, options: &CompileOptions) -> Option<Result<Arc<Joints>, UnsupportedModel>> {
    match options.formulation {
        Formulation::Rcr | Formulation::RcrElastic => Some(Joints::elastic(&parts.system).map(Arc::new)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    //! Structures beyond the limits are rejected before any allocation.
    use super::*;
    use bimorph_base::Bundle;
    use bimorph_netlist::NetlistSource;

    #[test]
    fn options_are_bounded_before_anything_is_laid_out() {
        let mut text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [n0] [l=1u w=1u]\n".to_owned();
        for k in 0..21 {
            text += &format!("beam2d p [n{k} n{}] [l=100u w=2u]\n", k + 1);
        }
        let source = NetlistSource::new(&Bundle::from_text("chain.net", &text));
        let asked = |options: CompileOptions| draw(&source, &options).and_then(ParsedStructure::compile).map(|_| ());
        let refused = asked(CompileOptions { tol: 2.0, ..CompileOptions::default() });
        assert!(matches!(&refused, Err(CompileError::Option(r)) if r.option == "tol"), "{refused:?}");
        // 21 beams of 100 000 segments each, every one of them within its own range
        let fine = asked(CompileOptions { segments: Some(100_000), ..CompileOptions::default() });
        assert_eq!(fine, Err(DiscretizeError::TooFine { segments: 2_100_000 }.into()));
        let sharp = asked(CompileOptions { band: Some(1e12), tol: 1e-300, ..CompileOptions::default() });
        assert!(matches!(sharp, Err(CompileError::Structure(DiscretizeError::TooFine { .. }))), "{sharp:?}");
    }
}
