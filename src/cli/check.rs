//! `bimorph check`: is the netlist right, and what is in it?

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs};
use super::output;
use bimorph::analysis::formulation;
use bimorph::analysis::transient::TransientOptions;
use bimorph::compile::{CompiledModel, Formulation};
use bimorph::discretize::anchor_root;
use bimorph::netlist::Setting;
use bimorph::results::format::ResultFormat;
use bimorph::results::plot::mechanism;
use bimorph::structure::{DomainElement, ElectrodeShape, Fringe, Structure};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// Parse and elaborate a netlist, and report every error and warning.
///
/// Exit status 1 on any error. Prints the model's unknowns, and with --band their estimated error; JSON has "segments"
/// by beam (0: rigid). Names the beam that rigid anchors stiffen most.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph check examples/bank/bank.net\n  \
    bimorph check examples/bank/bank.net --set wh=2.1u --json\n  \
    bimorph check examples/bank/bank.net --out bank.svg     # a drawing with the names of nodes")]
pub(crate) struct CheckCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Print one JSON document
    #[arg(long)]
    json: bool,

    /// Draw the netlist with the names of its nodes: .svg, .png or .html
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct CheckDocument<'a> {
    #[serde(flatten)]
    context: Context<'a>,
    nodes: usize,
    beams: usize,
    masses: usize,
    links: usize,
    supports: usize,
    combs: usize,
    gaps: usize,
    stops: usize,
    ports: Vec<&'a str>,
    unknowns: usize,
    segments: JsonMap<'a, usize>,
    modes_in_band: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    rigid_anchors: Option<RigidAnchors<'a>>,
}

/// Effect of rigid anchors on the beam that feels them most.
#[derive(Debug, Serialize)]
struct RigidAnchors<'a> {
    beam: &'a str,
    /// Share of its bending stiffness that elastic anchors would take away, about (1).
    stiffening: f64,
}

impl CheckCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let format = self.out.as_deref().map(ResultFormat::from_path).transpose()?;
        self.out.as_deref().map(output::check_folder).transpose()?;
        let compiled = self.model.compile_with_ranges()?;
        let s = &compiled.structure;
        if let (Some(out), Some(format)) = (&self.out, format) {
            let no_table =
                || Err(Failure::NoSuchOutput { what: "check", kind: "table", hint: "write .svg, .png or .html" });
            output::write(out, format, no_table, || Ok(mechanism::named(&self.model.title(), s)))?;
        }
        let order = &compiled.order;
        let unknowns = compiled.parts.system.model.unknowns();
        let segments: Vec<(String, usize)> =
            s.beams.iter().zip(&order.segments).map(|(beam, n)| (beam.name.clone(), *n)).collect();
        if self.json {
            let found = CheckDocument {
                context: self.model.context(&compiled),
                nodes: s.nodes.len(),
                beams: s.beams.len(),
                masses: s.masses.len(),
                links: s.links.len(),
                supports: s.supports.len(),
                combs: s.combs.len(),
                gaps: s.plate_gaps.len() + s.beam_gaps.len(),
                stops: s.stops.len(),
                ports: s.ports.iter().map(|p| p.name.as_str()).collect(),
                unknowns,
                segments: JsonMap(&segments),
                modes_in_band: order.modes_in_band,
                rigid_anchors: rigid_anchors(&compiled),
            };
            let text = serde_json::to_string(&found).map_err(|e| Failure::Stdout(e.into()))?;
            return output::print(&(text + "\n"));
        }
        let mut text = format!("{}: {}\n", self.model.title(), contents(s));
        if !compiled.parameters.is_empty() {
            let list: Vec<String> = compiled.parameters.iter().map(|(name, value)| shown(name, value)).collect();
            let _ = writeln!(text, "parameters: {}", list.join(", "));
        }
        if !s.ports.is_empty() {
            let list: Vec<&str> = s.ports.iter().map(|p| p.name.as_str()).collect();
            let _ = writeln!(text, "ports: {}", list.join(", "));
        }
        let most = order.segments.iter().max().unwrap_or(&0);
        let rigid = order.segments.iter().filter(|n| **n == 0).count();
        let _ = write!(text, "model: {unknowns} unknowns, at most {most} segments a beam");
        if rigid > 0 {
            let _ = write!(text, ", {rigid} rigid");
        }
        if let Some(error) = order.estimated_error {
            let _ = write!(text, "; {} modes in the band, estimated error {error:.1e}", order.modes_in_band);
        }
        text.push('\n');
        text.push_str(&fringe_fields(s, compiled.options.as_sugar));
        if let Some(RigidAnchors { beam, stiffening }) = rigid_anchors(&compiled) {
            let percent = 100.0 * stiffening;
            let _ =
                writeln!(text, "anchors: rigid, which stiffens `{beam}` by about {percent:.1} % (--anchors elastic)");
        }
        text.push_str(&formulation(&compiled, self.model.gives("formulation")));
        let warnings = compiled.warnings.items.len();
        let _ = writeln!(text, "no errors, {warnings} warning{}", if warnings == 1 { "" } else { "s" });
        output::print(&text)
    }
}

/// The beam that rigid anchors stiffen most, from a thousandth on.
fn rigid_anchors(compiled: &CompiledModel) -> Option<RigidAnchors<'_>> {
    let s = &compiled.structure;
    if anchor_root::is_elastic(s, compiled.options.anchors) {
        return None;
    }
    let (beam, stiffening) = anchor_root::stiffening(s).filter(|(_, share)| *share >= 1e-3)?;
    Some(RigidAnchors { beam: &s.beams[beam].name, stiffening })
}

/// Effect of the formulation on the model, in a line; empty for the bodies' own coordinates, and where `auto` takes them and was not given by its name.
fn formulation(compiled: &CompiledModel, given: bool) -> String {
    let name = compiled.options.formulation.name();
    match &compiled.joints {
        Some(Ok(joints)) => format!(
            "formulation {name}: {} coordinates, {} loops closed by springs, scheme {}\n",
            joints.tree.coordinates,
            joints.tree.closures.len(),
            compiled.options.scheme.name()
        ),
        Some(Err(unfit)) => format!("formulation {name}: not by springs: {unfit}\n"),
        None if compiled.options.formulation == Formulation::Auto => {
            let joints = formulation::in_joints(compiled, &TransientOptions::default());
            if joints.is_none() && !given {
                return String::new();
            }
            let why = joints.and_then(|_| formulation::outweighed_tree(compiled));
            let moving = why.map_or_else(String::new, |why| format!("; tran takes rcr: {why}"));
            format!("formulation auto takes {}{moving}\n", formulation::suited(compiled, None))
        }
        None => String::new(),
    }
}

/// Laws of the fringe fields of gaps between beams, in a line; empty without such gaps.
fn fringe_fields(s: &Structure, as_sugar: bool) -> String {
    let anchored = s.anchored();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for gap in &s.beam_gaps {
        let fixed = gap.nodes[2..].iter().all(|node| anchored[node.0]);
        let law = match (gap.fringe(as_sugar), gap.shape(fixed)) {
            (Fringe::None, _) => "none",
            (Fringe::Parallel, _) => "parallel",
            (Fringe::Sugar, _) => "sugar",
            (Fringe::Exact, ElectrodeShape::Bar) => "exact between bars",
            (Fringe::Exact, ElectrodeShape::Plane) => "exact over a plane",
        };
        *counts.entry(law).or_default() += 1;
    }
    let list: Vec<String> = counts.iter().map(|(law, n)| format!("{law} ({n})")).collect();
    if list.is_empty() { String::new() } else { format!("fringe fields of gaps between beams: {}\n", list.join(", ")) }
}

fn contents(s: &Structure) -> String {
    let counts = [
        (s.nodes.len(), "node"),
        (s.beams.len(), "beam"),
        (s.masses.len(), "mass"),
        (s.links.len(), "link"),
        (s.supports.len(), "support"),
        (s.springs.len(), "spring"),
        (s.combs.len(), "comb"),
        (s.plate_gaps.len() + s.beam_gaps.len(), "gap"),
        (s.stops.len(), "stop"),
        (s.resistors.len(), "resistor"),
        (s.wires.len(), "wire"),
        (s.voltage_sources.len(), "source"),
        (s.loads.len(), "load"),
    ];
    let plural = |n: usize, word: &str| match (n, word) {
        (1, _) => format!("1 {word}"),
        (_, "mass") => format!("{n} masses"),
        _ => format!("{n} {word}s"),
    };
    let placed = DomainElement::ALL.iter().map(|e| (s.placed.iter().filter(|p| p.element == e.name).count(), e.name));
    let counts = counts.into_iter().chain(placed).filter(|(n, _)| *n > 0);
    let list: Vec<String> = counts.map(|(n, word)| plural(n, word)).collect();
    list.join(", ")
}

fn shown(name: &str, value: &Setting) -> String {
    match value {
        Setting::Number(x) if *x == 0.0 || (1e-2..1e4).contains(&x.abs()) => format!("{name} = {x}"),
        Setting::Number(x) => format!("{name} = {x:e}"),
        Setting::Text(text) => format!("{name} = \"{text}\""),
    }
}
