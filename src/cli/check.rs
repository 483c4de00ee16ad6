//! `bimorph check`: is the netlist right, and what is in it?

use super::failure::Failure;
use super::model::{Context, ModelArgs};
use super::output;
use bimorph::netlist::Setting;
use bimorph::structure::Structure;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;

/// Parse and elaborate a netlist, and report every error and warning.
///
/// Exit status 1 on any error. Nothing is computed.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  bimorph check bank.net\n  bimorph check bank.net --set w=2.1u --json")]
pub(crate) struct Check {
    #[command(flatten)]
    model: ModelArgs,

    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Found<'a> {
    #[serde(flatten)]
    context: Context<'a>,
    nodes: usize,
    beams: usize,
    masses: usize,
    links: usize,
    supports: usize,
    combs: usize,
    gaps: usize,
    ports: Vec<&'a str>,
}

impl Check {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let compiled = self.model.compile()?;
        let s = &compiled.structure;
        if self.json {
            let found = Found {
                context: self.model.context(&compiled),
                nodes: s.nodes.len(),
                beams: s.beams.len(),
                masses: s.masses.len(),
                links: s.links.len(),
                supports: s.supports.len(),
                combs: s.combs.len(),
                gaps: s.plate_gaps.len() + s.beam_gaps.len(),
                ports: s.ports.iter().map(|p| p.name.as_str()).collect(),
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
        let warnings = compiled.warnings.items.len();
        let _ = writeln!(text, "no errors, {warnings} warning{}", if warnings == 1 { "" } else { "s" });
        output::print(&text)
    }
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
        (s.resistors.len(), "resistor"),
        (s.voltage_sources.len(), "source"),
        (s.loads.len(), "load"),
    ];
    let plural = |n: usize, word: &str| match (n, word) {
        (1, _) => format!("1 {word}"),
        (_, "mass") => format!("{n} masses"),
        _ => format!("{n} {word}s"),
    };
    let list: Vec<String> = counts.iter().filter(|(n, _)| *n > 0).map(|(n, word)| plural(*n, word)).collect();
    list.join(", ")
}

fn shown(name: &str, value: &Setting) -> String {
    match value {
        Setting::Number(x) if *x == 0.0 || (1e-2..1e4).contains(&x.abs()) => format!("{name} = {x}"),
        Setting::Number(x) => format!("{name} = {x:e}"),
        Setting::Text(text) => format!("{name} = \"{text}\""),
    }
}
