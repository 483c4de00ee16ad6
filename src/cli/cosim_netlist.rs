//! `bimorph cosim FILE.net`: a netlist with its own circuit becomes a deck around the device.

use super::failure::Failure;
use super::options::Chosen;
use super::output::{check_folder, write_page};
use super::value;
use bimorph::cosim::deck::{DeckSpec, around};
use bimorph::cosim::refined_deck;
use bimorph::netlist::{self, DroppedInclude, Setting, read_bundle_reporting};
use clap::Args;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Warnings that say what a netlist's circuit is not there for; here it is.
const OF_THE_CIRCUIT: [&str; 3] = ["W013", "W021", "W022"];

/// Options for a netlist in the place of a deck.
#[derive(Debug, Args)]
#[command(next_help_heading = "For a netlist in place of a deck")]
pub(crate) struct NetlistArgs {
    /// Operating point
    #[arg(long)]
    op: bool,

    /// Transient, as SPICE writes it: 'STEP STOP [START [LONGEST]]'
    #[arg(long, value_name = "TIMES", value_parser = times)]
    tran: Option<String>,

    /// Small signals, as SPICE writes it: 'dec POINTS FROM TO'
    #[arg(long, value_name = "SWEEP", value_parser = frequencies)]
    ac: Option<String>,

    /// Sweep, as SPICE writes it: 'v_NAME FROM TO STEP'
    #[arg(long, value_name = "SWEEP", value_parser = levels)]
    dc: Option<String>,

    /// Waveform of a source or a port, in SPICE syntax: 'NAME=PULSE(0 4 1u 1u)'. Repeatable
    #[arg(long, value_name = "NAME=WAVE", value_parser = wave)]
    drive: Vec<(String, String)>,

    /// The source of small signals: an element or a port [default: the first]
    #[arg(long, value_name = "NAME")]
    source: Option<String>,

    /// Hold a port at a voltage. Repeatable
    #[arg(long, value_name = "NAME=VOLTS", value_parser = value::volts)]
    port: Vec<(String, f64)>,

    /// Signals shown as voltages (1 V a micrometre, a milliradian, a kelvin), separated by commas
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Set a netlist parameter. Repeatable
    #[arg(long = "set", short = 's', value_name = "NAME=VALUE", value_parser = value::setting)]
    set: Vec<(String, Setting)>,

    /// Write the deck to this file and do not run it
    #[arg(long, value_name = "FILE.cir")]
    emit: Option<PathBuf>,

    #[command(flatten)]
    chosen: Chosen,
}

impl NetlistArgs {
    /// An option that only a netlist can have, if one was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let given = [
            (self.op, "--op"),
            (self.tran.is_some(), "--tran"),
            (self.ac.is_some(), "--ac"),
            (self.dc.is_some(), "--dc"),
            (self.source.is_some(), "--source"),
            (!self.drive.is_empty(), "--drive"),
            (!self.port.is_empty(), "--port"),
            (!self.signals.is_empty(), "--signals"),
            (!self.set.is_empty(), "--set"),
            (self.emit.is_some(), "--emit"),
        ];
        let own = given.iter().find(|(given, _)| *given).map(|(_, name)| *name);
        own.or_else(|| self.chosen.written().next().map(|(name, _)| name))
    }

    /// The deck around a netlist's device, to be run in the netlist's folder; none where it was written to a file instead.
    pub(crate) fn deck(&self, file: &Path) -> Result<Option<String>, Failure> {
        if let Some(emit) = &self.emit {
            check_folder(emit)?;
        }
        self.chosen.options()?;
        let warn = &mut |dropped: DroppedInclude| stderr_line!("warning: {dropped}");
        let bundle =
            read_bundle_reporting(file, &[], warn).map_err(|source| Failure::Read { path: file.to_owned(), source })?;
        let mut loaded = netlist::load(&bundle, &self.set)
            .map_err(|errors| Failure::from(bimorph::compile::CompileError::Netlist(errors)))?;
        // a switch is left out here, too
        loaded
            .warnings
            .items
            .retain(|w| !OF_THE_CIRCUIT.contains(&w.code.as_str()) || w.message.starts_with("switches"));
        if !loaded.warnings.items.is_empty() {
            stderr_text!("{}", loaded.warnings.render(io::stderr().is_terminal()));
        }
        let deck = around(&loaded.structure, &self.wanted(self.named(file)?))?;
        let Some(emit) = &self.emit else { return Ok(Some(deck)) };
        write_page(emit, &deck)?;
        Ok(None)
    }

    /// How the deck names the netlist: beside it by its name, elsewhere by its whole path.
    fn named(&self, file: &Path) -> Result<String, Failure> {
        let whole = file.canonicalize().map_err(|source| Failure::Read { path: file.to_owned(), source })?;
        let folder = match &self.emit {
            Some(emit) => {
                emit.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).canonicalize().ok()
            }
            None => whole.parent().map(Path::to_owned),
        };
        let beside = folder.is_some_and(|folder| whole.parent() == Some(folder.as_path()));
        let name = if beside { whole.file_name().map(PathBuf::from) } else { None };
        Ok(name.unwrap_or(whole).display().to_string())
    }

    fn wanted(&self, file: String) -> DeckSpec {
        let mut model: Vec<String> = self.chosen.written().map(|(_, word)| word).collect();
        if !self.set.is_empty() {
            let word = |(name, value): &(String, Setting)| match value {
                Setting::Number(x) => format!("\"{name}={x:e}\""),
                Setting::Text(text) => format!("\"{name}:{text}\""),
            };
            model.push(format!("set=[{}]", self.set.iter().map(word).collect::<Vec<_>>().join(" ")));
        }
        let written =
            |name: &str, words: &Option<String>| words.as_ref().map(|words| format!(".{name} {}", words.trim()));
        let mut analyses: Vec<String> = [written("tran", &self.tran), written("ac", &self.ac), written("dc", &self.dc)]
            .into_iter()
            .flatten()
            .collect();
        if self.op || analyses.is_empty() {
            analyses.insert(0, ".op".into());
        }
        DeckSpec {
            file,
            model,
            ports: self.port.clone(),
            drives: self.drive.clone(),
            signals: value::names(&self.signals),
            analyses,
            source: self.source.clone(),
        }
    }
}

/// Checks the words of an analysis: `form` is how they are written, `fit` whether these are.
fn analysis(text: &str, form: &str, fit: impl Fn(&[&str]) -> bool) -> Result<String, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    if fit(&words) { Ok(words.join(" ")) } else { Err(format!("expected '{form}', got \"{text}\"")) }
}

fn times(text: &str) -> Result<String, String> {
    analysis(text, "STEP STOP [START [LONGEST]] [uic]", |words| {
        let uic = words.last().is_some_and(|word| word.eq_ignore_ascii_case("uic"));
        let positive = |k: usize| words.get(k).and_then(|word| refined_deck::number(word)).is_none_or(|t| t > 0.0);
        (2..=4).contains(&(words.len() - usize::from(uic))) && positive(0) && positive(1)
    })
}

fn frequencies(text: &str) -> Result<String, String> {
    let kinds = ["dec", "oct", "lin"];
    analysis(text, "dec POINTS FROM TO", |words| {
        let number = |k: usize| refined_deck::number(words[k]);
        words.len() == 4
            && kinds.iter().any(|kind| words[0].eq_ignore_ascii_case(kind))
            && number(1).is_none_or(|points| points >= 1.0)
            && number(2).is_none_or(|from| from > 0.0)
            && number(2).zip(number(3)).is_none_or(|(from, to)| to >= from)
    })
}

fn levels(text: &str) -> Result<String, String> {
    analysis(text, "v_NAME FROM TO STEP, STEP towards TO and not 0", |words| {
        let leads = |words: &[&str]| match [words[1], words[2], words[3]].map(refined_deck::number) {
            [Some(from), Some(to), Some(step)] => step != 0.0 && (to - from) * step >= 0.0,
            _ => true,
        };
        matches!(words.len(), 4 | 8) && words.chunks(4).all(leads)
    })
}

/// Reads `NAME=WAVE`.
fn wave(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, wave)) if !name.trim().is_empty() && !wave.trim().is_empty() && !wave.contains('\n') => {
            Ok((name.trim().to_owned(), wave.trim().to_owned()))
        }
        _ => Err(format!("expected NAME=WAVE, got \"{text}\"")),
    }
}

/// Whether a file is a netlist and no deck: it is called so, and no line of it begins with a dot, as every deck's last does.
pub(crate) fn is_netlist(file: &Path) -> bool {
    let called = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("net"));
    let bytes = if called { std::fs::read(file).unwrap_or_default() } else { Vec::new() };
    called && !String::from_utf8_lossy(&bytes).lines().any(|line| line.trim_start().starts_with('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An analysis is checked before anything is written or run, and its message shows the form.
    #[test]
    fn analyses_have_a_form() {
        assert_eq!(times(" 1u  100u 0 50n"), Ok("1u 100u 0 50n".to_owned()));
        assert_eq!(times("1u 100u UIC"), Ok("1u 100u UIC".to_owned()));
        assert_eq!(times("100u"), Err("expected 'STEP STOP [START [LONGEST]] [uic]', got \"100u\"".to_owned()));
        assert!(times("").is_err() && times("uic").is_err() && times("1 2 3 4 5").is_err());
        assert!(
            frequencies("dec 10 1meg 1k").is_err()
                && frequencies("dec 0 1k 1meg").is_err()
                && frequencies("lin 1 0 1k").is_err()
        );
        assert!(levels("v_a 0 5 0").is_err() && levels("v_a 0 5 -1").is_err() && levels("v_a 5 0 -1").is_ok());
        assert!(times("0 1u").is_err() && times("1u {stop}").is_ok());
        assert_eq!(frequencies("DEC 10 1k 1meg"), Ok("DEC 10 1k 1meg".to_owned()));
        assert!(frequencies("1k:1M").is_err() && frequencies("10 1k 1meg 5").is_err());
        assert!(levels("v_v1 0 5 0.1").is_ok() && levels("v_v1 0 5").is_err());
    }
}
