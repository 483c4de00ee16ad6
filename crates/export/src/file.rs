//! The file of an export as text, with a summary of the model in it: what the command writes and a server sends.

use super::compare::{ModelFit, fit};
use super::flexible::{FlexibleModel, flexible};
use super::linear::{ReducedPort, SignalShown};
use super::model_options::model_options;
use super::names::{self, Pins};
use super::{ExportError, ExportRequest, flexible_verilog_a, lumped, lumped_spice, lumped_verilog_a, spice, verilog_a};
use bimorph_analysis::mesh::{beyond, twice};
use bimorph_model::compile::CompiledModel;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Longest line of a file, roughly (byte).
const LINE: usize = 64;
/// Unknowns beyond which parts that may touch keep the mesh of a deck.
const FINE_ENOUGH: usize = 3000;

/// Language of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FileLanguage {
    /// A SPICE subcircuit of R, L, C and linear sources; of a nonlinear model with B sources.
    #[default]
    Spice,
    /// A Verilog-A module.
    VerilogA,
}

/// Request for a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileRequest {
    /// Its language.
    pub language: FileLanguage,
    /// A nonlinear model, without an operating point, in place of the linear one about it: the whole of rigid parts that slide, otherwise a
    /// reduced one for the ranges of the request.
    pub nonlinear: bool,
    /// Name of the subcircuit or module; none: that of the netlist.
    pub name: Option<String>,
    /// Ports, signals, operating point and band.
    pub model: ExportRequest,
}

/// A file as text.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportedFile {
    /// The file.
    pub text: String,
    /// Name of its subcircuit or module.
    pub name: String,
    /// Its pins, in order: a positive and a negative one for each port, then one for each signal.
    pub pins: Vec<String>,
    /// Its model.
    pub content: FileContent,
    /// Limitations that the numbers do not show, as sentences.
    pub warnings: Vec<String>,
}

/// Model of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum FileContent {
    /// The linear model about an operating point.
    Linear(LinearSummary),
    /// The whole nonlinear model.
    Nonlinear {
        /// Directions in which parts slide.
        directions: usize,
        /// Gaps.
        gaps: usize,
    },
    /// A reduced nonlinear model.
    Reduced(ReducedSummary),
}

/// Summary of a reduced nonlinear model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReducedSummary {
    /// Coordinates.
    pub coordinates: usize,
    /// Degree of the polynomials.
    pub degree: usize,
    /// Strains of the full model.
    pub strains: usize,
    /// Lags of heat.
    pub lags: usize,
    /// Largest relative error of equilibria in the ranges (1).
    pub error: f64,
    /// Equilibria of the full model that were compared.
    pub compared: usize,
    /// Range of each port, in the order of the pins (V, N, W, …).
    pub ranges: Vec<[f64; 2]>,
}

/// Summary of a linear model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinearSummary {
    /// Number of each mode among the undamped modes at the operating point, from 1; none for a direction of the static correction.
    pub numbers: Vec<Option<usize>>,
    /// Frequency of each mode (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Quality factor of each mode (1); infinite without damping.
    pub quality: Vec<f64>,
    /// Lags of heat.
    pub lags: usize,
    /// Largest relative deviation from the exact small-signal answer (1).
    pub error: f64,
    /// Band of that comparison (Hz).
    pub band_hz: [f64; 2],
    /// Mechanical unknowns of the full model.
    pub unknowns: usize,
}

/// The model on four times the segments where parts may touch and none are given: simulators step over a contact that closes point by point along a
/// beam, and stop at one that closes at few points.
fn for_contact(compiled: &CompiledModel) -> Cow<'_, CompiledModel> {
    let (system, options) = (&compiled.parts.system, &compiled.options);
    let touches = (0..system.members.len()).any(|member| system.touching(member).is_some());
    let given = options.segments.is_some() || options.band.is_some();
    if !touches || given || compiled.unknowns() > FINE_ENOUGH {
        return Cow::Borrowed(compiled);
    }
    let tol = options.errors().requested();
    let finer = twice(compiled, tol).and_then(|finer| twice(&finer, tol));
    finer.map_or(Cow::Borrowed(compiled), Cow::Owned)
}

impl FileRequest {
    /// The file of a model on the mesh that it has in a circuit. `source` is the name of its netlist.
    ///
    /// # Errors
    /// See [`ExportError`].
    pub fn write(&self, compiled: &Arc<CompiledModel>, source: &str) -> Result<ExportedFile, ExportError> {
        Ok(self.write_with_ports(compiled, source)?.0)
    }

    /// As [`FileRequest::write`], with the ports of the model in the order of the pins.
    ///
    /// # Errors
    /// See [`ExportError`].
    pub fn write_with_ports(
        &self,
        compiled: &Arc<CompiledModel>,
        source: &str,
    ) -> Result<(ExportedFile, Vec<ReducedPort>), ExportError> {
        let name = match &self.name {
            Some(name) => names::checked(name)?.to_owned(),
            None => names::from_file(source.rsplit_once('.').map_or(source, |(stem, _)| stem)),
        };
        if self.nonlinear { self.whole(compiled, source, name) } else { self.linear(compiled, source, name) }
    }

    fn linear(
        &self,
        compiled: &Arc<CompiledModel>,
        source: &str,
        name: String,
    ) -> Result<(ExportedFile, Vec<ReducedPort>), ExportError> {
        let fitted = fit(compiled, &self.model)?;
        let model = &fitted.model;
        let pins = Pins::of(&model.ports, &model.signals)?;
        let warnings = self.warnings(compiled, &fitted);
        let about = self.about(compiled, &fitted, source, &warnings);
        let (rows, ports, modes, lags) = (model.rows(), model.ports.len(), model.modes.len(), model.lags.len());
        let couplings = rows * (2 * ports + 2 * modes + lags) + modes * (modes + ports + lags) + (modes + rows).pow(2);
        bimorph_base::budget::lay_out(LINE.saturating_mul(couplings));
        let text = match self.language {
            FileLanguage::Spice => spice::write(&fitted, &pins, &name, &about),
            FileLanguage::VerilogA => verilog_a::write(&fitted, &pins, &name, &about),
        };
        let content = FileContent::Linear(LinearSummary {
            numbers: model.modes.iter().map(|mode| mode.number).collect(),
            frequencies_hz: model.modes.iter().map(|mode| mode.omega / TAU).collect(),
            quality: model.modes.iter().enumerate().map(|(j, mode)| mode.omega / model.damping[(j, j)]).collect(),
            lags,
            error: fitted.error,
            band_hz: fitted.band,
            unknowns: fitted.unknowns,
        });
        let pins = pins.all().map(str::to_owned).collect();
        Ok((ExportedFile { text, name, pins, content, warnings }, fitted.model.ports))
    }

    /// The nonlinear model.
    fn whole(
        &self,
        compiled: &CompiledModel,
        source: &str,
        name: String,
    ) -> Result<(ExportedFile, Vec<ReducedPort>), ExportError> {
        let model = match lumped::lump(compiled, &self.model) {
            Err(ExportError::NotLumped { why }) if !self.model.ranges.is_empty() => match self.language {
                FileLanguage::VerilogA => return self.reduced(compiled, source, name),
                FileLanguage::Spice => return Err(ExportError::NotLumped { why: format!("{why}, as a subcircuit") }),
            },
            model => model?,
        };
        let pins = Pins::of(&model.ports, &model.signals)?;
        let version = env!("CARGO_PKG_VERSION");
        let (directions, gaps) = (model.coordinates.len(), model.gaps.len());
        let mut about = vec![
            format!("{source}, the whole nonlinear model, written by bimorph {version} export"),
            format!("{directions} direction(s) in which parts slide, {gaps} gap(s)"),
        ];
        about.extend(model.signals.iter().map(meaning));
        let rows = model.ports.len() + model.signals.len();
        bimorph_base::budget::lay_out((2 * LINE).saturating_mul(rows * (model.ports.len() + directions + gaps)));
        let text = match self.language {
            FileLanguage::Spice => lumped_spice::write(&model, &pins, &name, &about),
            FileLanguage::VerilogA => lumped_verilog_a::write(&model, &pins, &name, &about),
        };
        let content = FileContent::Nonlinear { directions, gaps };
        let pins = pins.all().map(str::to_owned).collect();
        Ok((ExportedFile { text, name, pins, content, warnings: Vec::new() }, model.ports))
    }

    /// The nonlinear model of flexible parts.
    fn reduced(
        &self,
        compiled: &CompiledModel,
        source: &str,
        name: String,
    ) -> Result<(ExportedFile, Vec<ReducedPort>), ExportError> {
        let model = flexible(&for_contact(compiled), &self.model)?;
        let pins = Pins::of(&model.ports, &model.signals)?;
        let of = &model.fitted.model;
        let points = of.approaches.mix.nrows();
        let polynomials = of.closures.strains.coefficients.nrows() + of.approaches.shapes.coefficients.nrows();
        let terms = (1 + of.size()).saturating_mul(polynomials + model.rows.len()).saturating_mul(of.monomials.count());
        bimorph_base::budget::lay_out(LINE.saturating_mul(terms.saturating_add(4 * points)));
        let mut warnings: Vec<String> = beyond(compiled.options.errors(), mesh_error(compiled)).into_iter().collect();
        if model.fitted.error > self.model.within {
            warnings.push(format!(
                "equilibria in the ranges deviate by {:.1e} from the full model, more than --within {:.1e}; take a narrower --range, or a \
                 smaller --within, which adds coordinates",
                model.fitted.error, self.model.within
            ));
        }
        if model.fitted.missed > 0 {
            warnings.push(format!(
                "{} of {} equilibria lie beyond a pull-in where the file has none: it goes back at other inputs than the full model; take a narrower \
                 --range, or a smaller --within, which adds coordinates",
                model.fitted.missed,
                model.fitted.compared + model.fitted.missed
            ));
        }
        let about = about_reduced(compiled, &model, source, &warnings);
        let text = flexible_verilog_a::write(&model, &pins, &name, &about);
        let content = FileContent::Reduced(ReducedSummary {
            coordinates: of.size(),
            degree: of.monomials.degree(),
            strains: model.strains,
            lags: model.heat.lags.len(),
            error: model.fitted.error,
            compared: model.fitted.compared,
            ranges: model.ranges.clone(),
        });
        let pins = pins.all().map(str::to_owned).collect();
        Ok((ExportedFile { text, name, pins, content, warnings }, model.ports))
    }

    /// Limitations of the file that its numbers do not show.
    fn warnings(&self, compiled: &CompiledModel, fitted: &ModelFit) -> Vec<String> {
        let mut warnings: Vec<String> = beyond(compiled.options.errors(), mesh_error(compiled)).into_iter().collect();
        let within = self.model.within;
        if fitted.error > within {
            let (modes, error) = (fitted.model.modes.len(), fitted.error);
            warnings.push(format!("{modes} modes deviate by {error:.1e}, more than --within {within:.1e}"));
        }
        if fitted.model.modes.is_empty() {
            warnings.push(
                "the file has no mode, and answers at once at every frequency: none that ports and signals see lies below --to; take a \
                 higher --to, or where they see no motion at this operating point, a --port voltage or NODE.x with --ports or --signals"
                    .to_owned(),
            );
        }
        if fitted.jumped {
            warnings.push(
                "the part pulled in, snapped or buckled on the way to this operating point: the file is about where it went, \
                 and knows no way back"
                    .to_owned(),
            );
        }
        warnings
    }

    /// The lines at the head of the file.
    fn about(&self, compiled: &CompiledModel, fitted: &ModelFit, source: &str, warnings: &[String]) -> Vec<String> {
        let version = env!("CARGO_PKG_VERSION");
        let model = &fitted.model;
        let bias: Vec<String> = self.model.bias.iter().map(|(n, v)| format!("{n}={v:e} V")).collect();
        let at = if bias.is_empty() { "all ports at 0 V".into() } else { bias.join(", ") };
        let (row, port, hertz) = &fitted.worst;
        let mut about = vec![
            format!("{source}, linear about the operating point, written by bimorph {version} export"),
            format!("operating point: {at}"),
            format!("full model: {} unknowns, {}", fitted.unknowns, model_options(compiled).trim_end()),
            mesh_note(compiled),
            format!(
                "kept: {} modes, {} lags of heat, static correction for the rest",
                model.modes.len(),
                model.lags.len()
            ),
            format!(
                "largest relative deviation from the full model, {:.3e} Hz to {:.3e} Hz at {} frequencies: {:.1e}",
                fitted.band[0], fitted.band[1], fitted.compared, fitted.error
            ),
        ];
        if fitted.error > 0.0 {
            about.push(format!("  found at {hertz:.4e} Hz from port {port} to {row}"));
        }
        about.push(match self.language {
            FileLanguage::Spice => {
                "noise: that of resistors at the temperature of the simulator alone, without that of drag".to_owned()
            }
            FileLanguage::VerilogA => format!(
                "noise: of drag at {:e} K and of resistances as warm as at the operating point; spectral densities deviate by {:.1e} at these frequencies",
                fitted.noise.temperature, fitted.noise_error
            ),
        });
        about.extend(warnings.iter().map(|warning| format!("warning: {warning}")));
        about.extend(model.signals.iter().map(meaning));
        about
    }
}

/// The lines at the head of a reduced nonlinear model.
fn about_reduced(compiled: &CompiledModel, model: &FlexibleModel, source: &str, warnings: &[String]) -> Vec<String> {
    let (of, version) = (&model.fitted.model, env!("CARGO_PKG_VERSION"));
    let range = |(port, [low, high]): (&ReducedPort, &[f64; 2])| {
        let ((what, unit), plain) = (port.kind.given(), |unit: &str| unit.replace('·', " ").replace('²', "^2"));
        format!("range of port {}: {what} {low:e} to {high:e} {}", port.name, plain(unit))
    };
    let mut about = vec![
        format!("{source}, reduced nonlinear model, written by bimorph {version} export"),
        format!("full model: {} strains, {}", model.strains, model_options(compiled).trim_end()),
        mesh_note(compiled),
    ];
    about.extend(model.ports.iter().zip(&model.ranges).map(range));
    about.extend([
        format!(
            "{} coordinates, polynomials of degree {}, {} strains of closures, {} shapes of gaps, {} lags of heat",
            of.size(),
            of.monomials.degree(),
            of.closures.strains.coefficients.nrows(),
            of.approaches.shapes.coefficients.nrows(),
            model.heat.lags.len()
        ),
        format!(
            "largest relative deviation from the full model in {} equilibria in these ranges: displacements {:.1e}, capacitances {:.1e}",
            model.fitted.compared, model.fitted.errors[0], model.fitted.errors[1]
        ),
        masses(model),
        format!("slowest coordinate at rest: {:e} Hz", 1.0 / (TAU * of.mass[0].sqrt())),
        format!(
            "{} fast coordinates follow their forces at once",
            model.fitted.follows.iter().filter(|follows| **follows).count()
        ),
        sudden(model),
    ]);
    about.extend(warnings.iter().map(|warning| format!("warning: {warning}")));
    about.extend(model.signals.iter().map(meaning));
    about
}

/// The masses of a model.
fn masses(model: &FlexibleModel) -> String {
    let of = &model.fitted.model;
    match of.mass_slopes.iter().filter(|slope| **slope != 0.0).count() {
        0 => {
            let varies = of.damping_slopes.iter().any(|slope| *slope != 0.0);
            let damping = if varies { " (damping is linear in the coordinates)" } else { "" };
            format!(
                "constant masses{damping}: that of the slowest coordinate changes by {:.1e} in them",
                of.mass_change
            )
        }
        count => format!(
            "masses and damping linear in the coordinates, {count} slopes of masses: that of the slowest coordinate is off by {:.1e} in them",
            of.mass_change
        ),
    }
}

/// The modes at rest that are in a model.
fn sudden(model: &FlexibleModel) -> String {
    let highest = model.motion.modes.iter().map(|mode| mode.lambda.sqrt() / TAU).fold(0.0, f64::max);
    match model.motion.modes.len() {
        0 => "no modes at rest are among the coordinates: dynamics by the shapes of equilibria and two moments of each input".to_owned(),
        count => format!(
            "modes at rest among the coordinates: {count}, up to {highest:.3e} Hz; another up to 32 times the lowest frequency has at most {:.1e} of the motion after a step of an input",
            model.motion.left_out
        ),
    }
}

/// Meaning of a volt of a signal.
fn meaning(signal: &SignalShown) -> String {
    format!("signal {}: 1 V is {:e} {}", signal.name, 1.0 / signal.scale, signal.unit)
}

/// The estimate of the mesh, or of its lowest mode where that is all that is known; a model without beams has no mesh.
fn mesh_error(compiled: &CompiledModel) -> Option<f64> {
    let lowest = || compiled.lowest.map(|lowest| lowest.error.abs());
    if compiled.structure.beams.is_empty() { Some(0.0) } else { compiled.order.estimated_error.or_else(lowest) }
}

/// Estimated error of the full model by its mesh, as a sentence.
pub fn mesh_note(compiled: &CompiledModel) -> String {
    match mesh_error(compiled) {
        Some(error) if compiled.options.band.is_none() && compiled.options.segments.is_none() => format!(
            "the equilibrium and the lowest frequencies of the full model: estimated error {error:.1e} at most, from its mesh; --band HZ covers all below it"
        ),
        Some(error) => {
            format!("frequencies of the full model: estimated error {error:.1e} at most in the band, from its mesh")
        }
        None => "frequencies of the full model: the error of its mesh is unknown; --band HZ estimates it".to_owned(),
    }
}
