//! The `.model` line of a device: parameters, checked and with defaults.

use crate::deck_options::{self, DeckValue};
use crate::settings::{self, Monitor, PortName};
use bimorph::compile::CompileOptions;
use bimorph::device::Agitation;
use bimorph::options::{MODEL, OptionError};
use std::path::PathBuf;
use std::time::Duration;
use thiserror::Error;

/// Parameters as ngspice holds them: absent, a value, or a list of words.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RawCard {
    /// `file`
    pub file: Option<String>,
    /// `ports`
    pub ports: Vec<String>,
    /// `monitors`
    pub monitors: Vec<String>,
    /// `set`
    pub set: Vec<String>,
    /// `remote`
    pub remote: Option<String>,
    /// `deadline` (s)
    pub deadline: Option<f64>,
    /// `noise`
    pub noise: Option<bool>,
    /// `seed`
    pub seed: Option<f64>,
    /// `noise_band` (Hz)
    pub noise_band: Option<f64>,
    /// The options of the model, in the order of [`MODEL`]; omitted ones are `None`.
    pub options: Vec<Option<DeckValue>>,
}

/// A checked `.model` line.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCard {
    /// Netlist, as spelled.
    pub file: String,
    /// Folders of the files that hold lines of this model's name, where they are known.
    pub folders: Vec<PathBuf>,
    /// Ports in the order of the node pairs; empty: all of the netlist, in its order.
    pub ports: Vec<PortName>,
    /// Signals shown as voltages, in the order of the monitor nodes.
    pub monitors: Vec<Monitor>,
    /// Address of a server; none: in process.
    pub remote: Option<String>,
    /// How the netlist is compiled.
    pub options: CompileOptions,
    /// Fraction of its tolerance that the model gets (1); below 1 on twice the segments, as the run that another is compared with.
    pub share: f64,
    /// Longest wait for an answer of the server (s), default 5.
    pub deadline: Duration,
    /// Thermal agitation in transients.
    pub noise: Option<Agitation>,
}

/// Errors of a `.model` line.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CardError {
    /// No netlist was named.
    #[error("the .model line names no netlist; write file=\"NAME.net\"")]
    NoFile,
    /// `set` holds a name without a value.
    #[error("set: \"{word}\" has no value; write set=[\"NAME=VALUE\" …]")]
    Set {
        /// The name.
        word: String,
    },
    /// `set` holds a name twice.
    #[error("set: \"{word}\" has two values; keep the one that is meant")]
    SetTwice {
        /// The name.
        word: String,
    },
    /// An address that ngspice cut at its `//`.
    #[error(
        "remote: ngspice takes // for a comment; write remote=\"unix:/PATH\", remote=\"HOST:PORT\" or remote=\"https:HOST:PORT\""
    )]
    Address,
    /// An option of the model that cannot be so.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A number is not positive.
    #[error("{name}={value} must be positive")]
    NotPositive {
        /// Parameter name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A seed that is no number for one.
    #[error("seed={value} must be a whole number from 0 to 2^53")]
    Seed {
        /// Its value.
        value: f64,
    },
    /// As many names as nodes are needed.
    #[error("{what}: the .model line names {names}, but the instance connects {nodes}")]
    Count {
        /// "ports" or "monitors".
        what: &'static str,
        /// How many names.
        names: usize,
        /// How many nodes or pairs.
        nodes: usize,
    },
}

/// Longest wait for a server's answer unless `deadline` says otherwise (s).
pub const DEADLINE: f64 = 5.0;

/// The agitation that a line specifies. A band of 0 means unset.
fn agitation(raw: &RawCard) -> Result<Agitation, CardError> {
    let seed = raw.seed.unwrap_or(1.0);
    if !((0.0..=2f64.powi(53)).contains(&seed) && seed.fract() == 0.0) {
        return Err(CardError::Seed { value: seed });
    }
    let band = raw.noise_band.filter(|band| *band != 0.0);
    if let Some(value) = band.filter(|band| !(band.is_finite() && *band > 0.0)) {
        return Err(CardError::NotPositive { name: "noise_band", value });
    }
    Ok(Agitation { seed: seed as u64, band })
}

impl ModelCard {
    /// Checks a line. `remote` is an address that overrides the line's, from outside the deck.
    ///
    /// # Errors
    /// [`CardError`]
    pub fn new(raw: &RawCard, remote: Option<String>) -> Result<Self, CardError> {
        let positive = |name, value: Option<f64>| match value {
            Some(value) if !(value.is_finite() && value > 0.0) => Err(CardError::NotPositive { name, value }),
            _ => Ok(value),
        };
        let set = settings::settings(&raw.set).map_err(|word| CardError::Set { word })?;
        let twice = |(k, (name, _)): &(usize, &(String, bimorph::netlist::Setting))| {
            set[..*k].iter().any(|(before, _)| before == name)
        };
        if let Some((_, (word, _))) = set.iter().enumerate().find(twice) {
            return Err(CardError::SetTwice { word: word.clone() });
        }
        let mut options = CompileOptions { set, ..CompileOptions::default() };
        for (option, written) in MODEL.iter().zip(&raw.options) {
            if let Some(written) = written {
                deck_options::choose(&mut options, option, written)?;
            }
        }
        Ok(Self {
            file: raw.file.clone().filter(|f| !f.is_empty()).ok_or(CardError::NoFile)?,
            folders: Vec::new(),
            ports: settings::rejoin(&raw.ports).iter().map(|p| PortName::parse(p)).collect(),
            monitors: settings::rejoin(&raw.monitors).iter().map(|m| Monitor::parse(m)).collect(),
            remote: match remote.or_else(|| raw.remote.clone()).filter(|r| !r.is_empty()) {
                Some(cut) if ["unix:", "http:", "grpc:", "https:"].contains(&cut.as_str()) => {
                    return Err(CardError::Address);
                }
                address => address,
            },
            options,
            noise: raw.noise.unwrap_or(false).then(|| agitation(raw)).transpose()?,
            share: 1.0,
            deadline: Duration::from_secs_f64(positive("deadline", raw.deadline)?.unwrap_or(DEADLINE).min(1e6)),
        })
    }

    /// With this fraction of its tolerance (1); a smaller one than all of it comes with a finer mesh, too.
    pub fn with_share(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// Compares the names on the line with the nodes of an instance.
    ///
    /// # Errors
    /// [`CardError::Count`]
    pub fn check_counts(&self, ports: usize, monitors: usize) -> Result<(), CardError> {
        if !self.ports.is_empty() && self.ports.len() != ports {
            return Err(CardError::Count { what: "ports", names: self.ports.len(), nodes: ports });
        }
        if self.monitors.len() != monitors {
            return Err(CardError::Count { what: "monitors", names: self.monitors.len(), nodes: monitors });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph::options::{Formulation, Junctions, Scheme};

    /// A line with these options.
    fn with(given: &[(&str, DeckValue)]) -> RawCard {
        let find = |name: &str| given.iter().find(|(other, _)| *other == name).map(|(_, written)| written.clone());
        assert!(given.iter().all(|(name, _)| MODEL.iter().any(|option| option.about.name == *name)));
        RawCard { options: MODEL.iter().map(|option| find(option.about.name)).collect(), ..raw() }
    }

    fn raw() -> RawCard {
        RawCard { file: Some("bank.net".into()), ..RawCard::default() }
    }

    /// `band=0` is what ngspice shows of a line without it, and takes a band back.
    #[test]
    fn a_band_of_zero_is_by_the_scene() {
        let card = ModelCard::new(&with(&[("band", DeckValue::Number(0.0))]), None).unwrap();
        assert_eq!(card.options.band, None);
    }

    /// A line with a file alone is complete: in process, all ports, no monitors, the library's own defaults.
    #[test]
    fn defaults() {
        let card = ModelCard::new(&raw(), None).unwrap();
        assert_eq!(card.options, CompileOptions::default());
        assert_eq!((card.remote.clone(), card.deadline), (None, Duration::from_secs(5)));
        assert_eq!(card.check_counts(3, 0), Ok(()));
    }

    /// Every parameter arrives; the address from outside the deck wins.
    #[test]
    fn every_parameter() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let raw = RawCard {
            ports: words("heat sense"),
            monitors: words("yoke.y:1e6"),
            set: words("w 2u"),
            remote: Some("unix:///a".into()),
            deadline: Some(0.5),
            ..with(&[
                ("tol", DeckValue::Number(1e-4)),
                ("band", DeckValue::Number(1e6)),
                ("linear", DeckValue::Flag(true)),
                ("undamped", DeckValue::Flag(true)),
                ("junctions", DeckValue::Text("Offset".into())),
                ("scheme", DeckValue::Text("d1".into())),
                ("segments", DeckValue::Number(6.0)),
                ("rotary_inertia", DeckValue::Flag(true)),
                ("formulation", DeckValue::Text("rcr".into())),
            ])
        };
        let card = ModelCard::new(&raw, None).unwrap();
        assert_eq!(card.remote.as_deref(), Some("unix:///a"));
        let want = CompileOptions {
            set: card.options.set.clone(),
            tol: 1e-4,
            band: Some(1e6),
            linear: true,
            undamped: true,
            junctions: Junctions::Offset,
            scheme: Scheme::D1,
            segments: Some(6),
            rotary_inertia: true,
            formulation: Formulation::Rcr,
            ..CompileOptions::default()
        };
        assert_eq!((&card.options, card.options.set.len()), (&want, 1));
        assert_eq!(card.deadline, Duration::from_millis(500));
        assert_eq!(ModelCard::new(&raw, Some("b:1".into())).unwrap().remote.as_deref(), Some("b:1"));
        assert_eq!(card.check_counts(1, 1), Err(CardError::Count { what: "ports", names: 2, nodes: 1 }));
        assert_eq!(card.check_counts(2, 0), Err(CardError::Count { what: "monitors", names: 1, nodes: 0 }));
    }

    /// Invalid values are rejected by value.
    #[test]
    fn refusals() {
        assert_eq!(ModelCard::new(&RawCard::default(), None), Err(CardError::NoFile));
        for (name, bad) in [
            ("tol", DeckValue::Number(0.0)),
            ("band", DeckValue::Number(-1.0)),
            ("segments", DeckValue::Number(2.5)),
            ("segments", DeckValue::Number(1e6)),
            ("junctions", DeckValue::Text("welded".into())),
        ] {
            let refused = ModelCard::new(&with(&[(name, bad)]), None);
            assert!(matches!(&refused, Err(CardError::Option(r)) if r.option == name), "{refused:?}");
        }
        let bad = RawCard { deadline: Some(0.0), ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::NotPositive { name: "deadline", value: 0.0 }));
        let bad = RawCard { remote: Some("unix:".into()), ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::Address));
        let bad = RawCard { set: vec!["w".into()], ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::Set { word: "w".into() }));
        let bad = RawCard { set: vec!["w=2u".into(), "g=1u".into(), "w=3u".into()], ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::SetTwice { word: "w".into() }));
    }
}
