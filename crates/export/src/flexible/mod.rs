//! The nonlinear model of flexible parts: a reduced model as polynomials, trained for ranges of the ports.
//!
//! The mechanism is reduced to few coordinates over the box of all ranges ([`bimorph_solve::reduced`]), and written as polynomials of them
//! ([`bimorph_solve::reduced::polynomial`]) with the laws of its gaps, contacts and films as they are. Voltages heat as in the full model, with
//! one lag for each time constant. Charge and force come from one energy.

pub mod heat;
pub mod johnson;
pub mod motions;
pub mod ports;
pub mod text;

use super::linear::{ReducedPort, SignalShown};
use super::lumped::floating_gap;
use super::mechanism::{port_names, refuse_driven};
use super::{ExportError, ExportRequest};
use bimorph_analysis::readout::expression::Quantity;
use bimorph_analysis::readout::ports::{OpenedPorts, PortResponse};
use bimorph_analysis::readout::signal::{Signal, SignalView};
use bimorph_analysis::reduced::ranges::range_inputs;
use bimorph_base::ErrorBudget;
use bimorph_device::PortKind;
use bimorph_device::scale::PortScale;
use bimorph_device::surroundings;
use bimorph_domains::thermal::HeatConductor;
use bimorph_domains::{Domain, Law, PointLaw, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::reduced::polynomial::shapes::Probe;
use bimorph_solve::reduced::polynomial::statics::{FittedPolynomials, fitted};
use bimorph_solve::reduced::space::spanned;
use bimorph_solve::reduced::{InputBox, ReductionError, TrainingCase, TrainingOptions, train};
use bimorph_structure::OhmicContact;
use heat::HeatCourses;
use johnson::ConductedNoise;
use motions::{SuddenMotion, sudden_motion};
use ports::{SourceText, sum_of};

/// Moments of each input for motion.
const MOMENTS: usize = 2;

/// Output of a port or signal.
#[derive(Debug, Clone, PartialEq)]
pub enum FlexibleOutput {
    /// Current of an electrical port: the conducted one as an expression, and the share of each gap's charge.
    Current(Option<String>, Vec<f64>),
    /// A probe of the polynomials.
    Probe(usize),
    /// Its rate.
    ProbeRate(usize),
    /// Ambient temperature (K) and rise of a heater.
    Temperature(f64, usize),
    /// Charge of a member with points.
    Charge(usize),
    /// Its capacitance.
    Capacitance(usize),
    /// Force of its voltage.
    Pull(usize),
    /// Smallest distance among its points.
    Distance(usize),
    /// Force of its contact.
    Bearing(usize),
    /// Conductance of its contact of these metals.
    Conductance(usize, OhmicContact),
    /// A constant.
    Constant(f64),
    /// Nothing.
    Nothing,
}

/// The model.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibleModel {
    /// Ports.
    pub ports: Vec<ReducedPort>,
    /// Signals.
    pub signals: Vec<SignalShown>,
    /// Volts or amperes of the circuit per unit of each row.
    pub scales: Vec<f64>,
    /// The polynomials with their error.
    pub fitted: FittedPolynomials,
    /// Voltage of each member with points, as an expression; none: 0.
    pub volts: Vec<Option<String>>,
    /// Size of each input as an expression, in the order of the works behind that of the dead loads.
    pub inputs: Vec<Option<String>>,
    /// Names of the members with points.
    pub names: Vec<String>,
    /// Heat.
    pub heat: HeatCourses,
    /// Free strain per kelvin of each heater (1/K).
    pub expansion: Vec<f64>,
    /// The output of each port, then of each signal, in SI.
    pub rows: Vec<FlexibleOutput>,
    /// Range of each port.
    pub ranges: Vec<[f64; 2]>,
    /// Noise of what conducts.
    pub johnson: ConductedNoise,
    /// Strains of the full model.
    pub strains: usize,
    /// Modes at rest among the directions, and what others would have of a sudden motion.
    pub motion: SuddenMotion,
}

/// The model of a request, trained for its ranges to its tolerance.
///
/// # Errors
/// [`ExportError::NotFlexible`] where something acts that the polynomials do not have, or the space cannot be trained;
/// [`ExportError::BadRange`] for a range of no port.
pub fn flexible(compiled: &CompiledModel, request: &ExportRequest) -> Result<FlexibleModel, ExportError> {
    let (names, across): (Vec<_>, Vec<_>) = port_names(compiled, request)?.into_iter().unzip();
    let opened = OpenedPorts::find(compiled, &names)?;
    let system = opened.system.as_deref().unwrap_or(&compiled.parts.system);
    if let Some(k) = opened.kinds.iter().position(|kind| *kind == PortKind::Rate) {
        return Err(ExportError::Turning { port: names[k].clone() });
    }
    refuse_driven(compiled)?;
    writable(compiled, system)?;
    let ranges = ranges(request, &names)?;
    let scaled: Vec<PortScale> =
        opened.kinds.iter().zip(&across).map(|(kind, across)| PortScale::new(*kind, *across)).collect();
    let port = |k: usize| {
        let (kind, scale) = (opened.kinds[k], scaled[k]);
        let across = if kind.given_flow() { scale.answered } else { 1.0 / scale.given };
        ReducedPort { name: names[k].clone(), kind, across, bias: None }
    };
    let ports: Vec<ReducedPort> = (0..names.len()).map(port).collect();
    let given: Vec<f64> = scaled.iter().map(|scale| scale.given).collect();
    let sources = SourceText::all(&system.electrics, &opened, &ports, &given);
    let mut reader = RowReader { compiled, system, sources: &sources, read: Vec::new() };
    let mut rows = Vec::new();
    for (answer, &source) in opened.answers.iter().zip(&opened.sources) {
        rows.push(reader.of_port(answer, source)?);
    }
    let mut signals = Vec::new();
    for (name, scale) in &request.signals {
        let signal = Signal::find(compiled, name)?;
        rows.push(reader.of_signal(&signal)?);
        signals.push(SignalShown { name: name.clone(), unit: signal.unit(), scale: *scale });
    }
    let read = reader.read;
    let probe = |signal: &Signal| -> Box<Probe<'_>> {
        let signal = *signal;
        Box::new(move |q: &[Pose]| signal.value(compiled, &SignalView { q, v: &[], rise: &[], volts: &[] }))
    };
    let probes: Vec<Box<Probe<'_>>> = read.iter().map(probe).collect();
    let probes: Vec<&Probe<'_>> = probes.iter().map(|probe| &**probe).collect();
    let apart: Vec<usize> = rows.iter().filter_map(read_gap).collect();
    let (fitted, motion, strains) =
        trained(system, &range_inputs(system, &opened.sources, &ranges), &probes, (request.within, &apart))?;
    let points = &fitted.model.approaches.members;
    let electrics = &system.electrics;
    let gap_name = |g: usize| compiled.parts.gap_names.get(g).cloned().unwrap_or_else(|| "a film or spring".to_owned());
    let volts = points.iter().map(|points| sum_of(&sources, |s| electrics.gap_rows[(points.member, s)]));
    let heaters = &electrics.heating.heaters;
    let heat = HeatCourses::new(electrics, &sources);
    Ok(FlexibleModel {
        johnson: ConductedNoise::new(electrics, &opened, &heat, surroundings(compiled)),
        scales: scaled.iter().map(|s| s.answered).chain(signals.iter().map(|s| s.scale)).collect(),
        volts: volts.collect(),
        inputs: (0..electrics.inputs.len()).map(|k| sources[electrics.voltages() + k].text()).collect(),
        names: points
            .iter()
            .map(|points| match points.merged.len() {
                1 => gap_name(points.member),
                count => format!("{count} gaps and films, of which the first is {}", gap_name(points.member)),
            })
            .collect(),
        heat,
        expansion: heaters.iter().map(|heater| heater.expansion).collect(),
        rows: rows.into_iter().map(|row| by_points(row, &fitted)).collect(),
        ports,
        signals,
        ranges,
        strains,
        motion,
        fitted,
    })
}

/// The gap that a row shows.
fn read_gap(row: &FlexibleOutput) -> Option<usize> {
    match row {
        FlexibleOutput::Charge(g)
        | FlexibleOutput::Capacitance(g)
        | FlexibleOutput::Pull(g)
        | FlexibleOutput::Distance(g)
        | FlexibleOutput::Bearing(g)
        | FlexibleOutput::Conductance(g, _) => Some(*g),
        _ => None,
    }
}

/// A row whose gap is counted among the members with points.
fn by_points(row: FlexibleOutput, fitted: &FittedPolynomials) -> FlexibleOutput {
    let members = &fitted.model.approaches.members;
    let place = |g: usize| members.iter().position(|points| points.member == g);
    let of = |g: usize, make: fn(usize) -> FlexibleOutput| place(g).map_or(FlexibleOutput::Nothing, make);
    match row {
        FlexibleOutput::Charge(g) => of(g, FlexibleOutput::Charge),
        FlexibleOutput::Capacitance(g) => of(g, FlexibleOutput::Capacitance),
        FlexibleOutput::Pull(g) => of(g, FlexibleOutput::Pull),
        FlexibleOutput::Distance(g) => of(g, FlexibleOutput::Distance),
        FlexibleOutput::Bearing(g) => of(g, FlexibleOutput::Bearing),
        FlexibleOutput::Conductance(g, metals) => {
            place(g).map_or(FlexibleOutput::Nothing, |m| FlexibleOutput::Conductance(m, metals))
        }
        FlexibleOutput::Current(text, shares) => {
            FlexibleOutput::Current(text, members.iter().map(|points| shares[points.member]).collect())
        }
        other => other,
    }
}

/// Refuses what the polynomials do not have.
fn writable(compiled: &CompiledModel, system: &System) -> Result<(), ExportError> {
    let heating = &system.electrics.heating;
    let dependent = heating.heaters.iter().position(HeatConductor::depends_on_temperature);
    if let Some(k) = dependent.or(heating.is_hot().then_some(0)) {
        let beam = compiled.structure.beams[compiled.parts.heaters[k]].name.clone();
        return Err(ExportError::HotResistance { beam });
    }
    let refused = |why: String| Err(ExportError::NotFlexible { why });
    if let Some(gap) = floating_gap(compiled, system) {
        return refused(format!(
            "an electrode of \"{gap}\" floats, which joins gaps; tie it to a port, a source or ground"
        ));
    }
    for (g, member) in system.members.iter().enumerate() {
        let name = || compiled.parts.gap_names.get(g).map_or("a member", String::as_str).to_owned();
        if member.slides() {
            return refused(format!("friction acts across stop \"{}\"; leave out `friction`", name()));
        }
        let laws = member.point_laws();
        if laws.iter().any(|law| !law.is_plain()) {
            return refused(
                "gas flows through holes or a slit, whose law is not written; leave out the gas".to_owned(),
            );
        }
        if laws.is_empty() && member.is_gas() {
            return refused(
                "gas acts that compresses or slides between fingers; give filmstates=0, or leave out the gas"
                    .to_owned(),
            );
        }
        if laws.is_empty() && member.is_active(1.0) {
            return refused(format!(
                "\"{}\" measures its gap along chords, with forces of no energy; give another fringe law",
                name()
            ));
        }
    }
    Ok(())
}

/// The range of each port, in the unit of what is given to it; 0 where none is.
fn ranges(request: &ExportRequest, names: &[String]) -> Result<Vec<[f64; 2]>, ExportError> {
    if let Some((name, _)) = request.ranges.iter().find(|(name, _)| !names.contains(name)) {
        return Err(ExportError::BadRange { name: name.clone(), ports: names.join(", ") });
    }
    let of = |name: &String| request.ranges.iter().find(|(n, _)| n == name).map_or([0.0; 2], |(_, range)| *range);
    Ok(names.iter().map(of).collect())
}

/// The polynomials of the space for a box, the modes in it, and the strains of the full model.
fn trained(
    system: &System,
    inputs: &InputBox,
    probes: &[&Probe<'_>],
    (within, apart): (f64, &[usize]),
) -> Result<(FittedPolynomials, SuddenMotion, usize), ExportError> {
    let refused = |error: ReductionError| ExportError::NotFlexible { why: reason(&error) };
    let joints = spanned(system).map_err(refused)?;
    let mut motion = sudden_motion(system, inputs, probes, ErrorBudget::of(within).sudden_mode());
    let motions: Vec<Vec<Pose>> = motion.modes.iter().map(|mode| mode.shape.clone()).collect();
    let case = TrainingCase { system, inputs: inputs.clone(), motions: &motions };
    let training =
        train(&joints, &[case], TrainingOptions { errors: ErrorBudget::of(within), moments: MOMENTS, beyond: true })
            .map_err(refused)?;
    if training.space.size() == 0 {
        return Err(refused(ReductionError::NoInput));
    }
    for mode in motion.modes.split_off(training.motions) {
        motion.left_out = motion.left_out.max(mode.share);
    }
    let found = fitted(&training.space, system, inputs, probes, (within, apart));
    if found.compared == 0 {
        return Err(ExportError::NotFlexible { why: "the full model has no equilibrium in these ranges".to_owned() });
    }
    if found.error.is_finite() && found.error > 1.0 {
        let why =
            format!("its polynomials deviate by {:.1e} from the full model; take a narrower --range", found.error);
        return Err(ExportError::NotFlexible { why });
    }
    if !found.error.is_finite() {
        let why = "its polynomials have no equilibrium next to one of the full model; take a narrower --range, or a smaller --within";
        return Err(ExportError::NotFlexible { why: why.to_owned() });
    }
    Ok((found, motion, joints.tree.coordinates))
}

/// Why a space cannot be trained, with a way out for an export.
fn reason(error: &ReductionError) -> String {
    match error {
        ReductionError::NoInput => "nothing acts on it in these ranges; give a port a wider --range".to_owned(),
        ReductionError::TooManyInputs { count, most } => {
            format!("{count} independent inputs act on it, more than {most}; give fewer ports a --range")
        }
        ReductionError::TooMany { directions, strains } => {
            format!(
                "{directions} directions for {strains} strains would be as dear as the device; raise --within or narrow --range"
            )
        }
        ReductionError::NoSample { detail } => {
            format!("at a few percent of the ranges there is no equilibrium: {detail}")
        }
        other => {
            let text = other.to_string();
            text.split_once("; take").map_or(text.clone(), |(why, _)| why.to_owned())
        }
    }
}

/// Makes rows of what ports answer and signals show.
struct RowReader<'a> {
    compiled: &'a CompiledModel,
    system: &'a System,
    sources: &'a [SourceText],
    /// Displacements that become probes.
    read: Vec<Signal>,
}

impl RowReader<'_> {
    fn of_port(&mut self, answer: &PortResponse, source: usize) -> Result<FlexibleOutput, ExportError> {
        let electrics = &self.system.electrics;
        match answer {
            PortResponse::Current => {
                let conducted = sum_of(self.sources, |s| electrics.conductance[(source, s)]);
                let shares = (0..self.system.members.len()).map(|g| electrics.gap_rows[(g, source)]).collect();
                Ok(FlexibleOutput::Current(conducted, shares))
            }
            PortResponse::Motion(signal) => self.of_signal(signal),
            PortResponse::Rise(heater) => Ok(FlexibleOutput::Temperature(0.0, *heater)),
            PortResponse::Nothing => Ok(FlexibleOutput::Nothing),
        }
    }

    fn of_signal(&mut self, signal: &Signal) -> Result<FlexibleOutput, ExportError> {
        let mut probe = |signal: Signal| {
            let known = self.read.iter().position(|of| *of == signal);
            known.unwrap_or_else(|| {
                self.read.push(signal);
                self.read.len() - 1
            })
        };
        let heaters = &self.system.electrics.heating.heaters;
        Ok(match *signal {
            Signal::Displacement(..) => FlexibleOutput::Probe(probe(*signal)),
            Signal::Rate(point, d) => FlexibleOutput::ProbeRate(probe(Signal::Displacement(point, d))),
            Signal::Temperature(k) => FlexibleOutput::Temperature(heaters[k].ambient, k),
            Signal::Prescribed(t) => FlexibleOutput::Constant(t),
            Signal::Charge(g) => FlexibleOutput::Charge(g),
            Signal::Capacitance(g) => FlexibleOutput::Capacitance(g),
            Signal::Pull(g) => FlexibleOutput::Pull(g),
            Signal::Distance(g) if self.has_sides(g) => FlexibleOutput::Distance(g),
            Signal::Bearing(g) if self.has_sides(g) => FlexibleOutput::Bearing(g),
            Signal::Conductance(g, metals) if self.has_sides(g) => FlexibleOutput::Conductance(g, metals),
            Signal::Distance(g) | Signal::Bearing(g) | Signal::Conductance(g, _) => {
                let name = self.compiled.parts.gap_names[g].clone();
                return Err(ExportError::NotFlexible {
                    why: format!(
                        "the sides of \"{name}\" have no points whose distance and force a signal could show; leave it out"
                    ),
                });
            }
            Signal::AnchorForce(..) => {
                let why = "the force of an anchor is not written; leave its signal out".to_owned();
                return Err(ExportError::NotFlexible { why });
            }
            Signal::Stress(_) => {
                let why = "the stress of a beam is not written; leave its signal out".to_owned();
                return Err(ExportError::NotFlexible { why });
            }
        })
    }

    /// Whether a member has points with two conductors, or with a stop.
    fn has_sides(&self, g: usize) -> bool {
        let sides = |law: &PointLaw| matches!(law.law, Some(Law::Field(..) | Law::Comb(_) | Law::Stop(..)));
        self.system.members[g].point_laws().iter().any(sides)
    }
}
