//! The `.model` line of a device: what was given, checked and with its defaults.

use crate::settings::{self, Monitor};
use bimorph::compile::{CompileOptions, Junctions};
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
    /// `tol`
    pub tol: Option<f64>,
    /// `band` [Hz]
    pub band: Option<f64>,
    /// `linear`
    pub linear: Option<bool>,
    /// `undamped`
    pub undamped: Option<bool>,
    /// `deadline` [s]
    pub deadline: Option<f64>,
    /// `junctions`
    pub junctions: Option<String>,
}

/// A checked `.model` line.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCard {
    /// Netlist, as spelled.
    pub file: String,
    /// Port names in the order of the node pairs; empty: all, in netlist order.
    pub ports: Vec<String>,
    /// Signals shown as voltages, in the order of the monitor nodes.
    pub monitors: Vec<Monitor>,
    /// Address of a server; none: in process.
    pub remote: Option<String>,
    /// How the netlist is compiled.
    pub options: CompileOptions,
    /// Longest wait for an answer of the server [s], default 5.
    pub deadline: Duration,
}

/// What is wrong with a `.model` line.
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
    /// An address that ngspice cut at its `//`.
    #[error("remote: ngspice takes // for a comment; write remote=\"unix:/PATH\" or remote=\"HOST:PORT\"")]
    Address,
    /// No such kind of junctions.
    #[error("junctions=\"{name}\": expected centreline, offset or calibrated")]
    Junctions {
        /// What was given.
        name: String,
    },
    /// A number is not positive.
    #[error("{name}={value} must be positive")]
    NotPositive {
        /// Parameter name.
        name: &'static str,
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

/// Longest wait for a server's answer unless `deadline` says otherwise [s].
const DEADLINE: f64 = 5.0;

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
        let defaults = CompileOptions::default();
        Ok(Self {
            file: raw.file.clone().filter(|f| !f.is_empty()).ok_or(CardError::NoFile)?,
            ports: settings::rejoin(&raw.ports),
            monitors: settings::rejoin(&raw.monitors).iter().map(|m| Monitor::parse(m)).collect(),
            remote: match remote.or_else(|| raw.remote.clone()).filter(|r| !r.is_empty()) {
                Some(cut) if ["unix:", "http:", "grpc:"].contains(&cut.as_str()) => return Err(CardError::Address),
                address => address,
            },
            options: CompileOptions {
                set: settings::settings(&raw.set).map_err(|word| CardError::Set { word })?,
                band: positive("band", raw.band)?,
                tol: positive("tol", raw.tol)?.unwrap_or(defaults.tol),
                linear: raw.linear.unwrap_or(defaults.linear),
                undamped: raw.undamped.unwrap_or(defaults.undamped),
                junctions: match &raw.junctions {
                    Some(name) => Junctions::named(name).ok_or_else(|| CardError::Junctions { name: name.clone() })?,
                    None => defaults.junctions,
                },
                ..defaults
            },
            deadline: Duration::from_secs_f64(positive("deadline", raw.deadline)?.unwrap_or(DEADLINE).min(1e6)),
        })
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

    fn raw() -> RawCard {
        RawCard { file: Some("bank.net".into()), ..RawCard::default() }
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
            tol: Some(1e-4),
            band: Some(1e6),
            linear: Some(true),
            undamped: Some(true),
            deadline: Some(0.5),
            junctions: Some("offset".into()),
            ..raw()
        };
        let card = ModelCard::new(&raw, None).unwrap();
        assert_eq!(card.remote.as_deref(), Some("unix:///a"));
        assert_eq!((card.options.tol, card.options.band), (1e-4, Some(1e6)));
        assert_eq!(card.options.junctions, Junctions::Offset);
        assert!(card.options.linear && card.options.undamped && card.options.set.len() == 1);
        assert_eq!(card.deadline, Duration::from_millis(500));
        assert_eq!(ModelCard::new(&raw, Some("b:1".into())).unwrap().remote.as_deref(), Some("b:1"));
        assert_eq!(card.check_counts(1, 1), Err(CardError::Count { what: "ports", names: 2, nodes: 1 }));
        assert_eq!(card.check_counts(2, 0), Err(CardError::Count { what: "monitors", names: 1, nodes: 0 }));
    }

    /// What cannot be used is refused with its value.
    #[test]
    fn refusals() {
        assert_eq!(ModelCard::new(&RawCard::default(), None), Err(CardError::NoFile));
        let bad = RawCard { tol: Some(0.0), ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::NotPositive { name: "tol", value: 0.0 }));
        let bad = RawCard { junctions: Some("welded".into()), ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::Junctions { name: "welded".into() }));
        let bad = RawCard { remote: Some("unix:".into()), ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::Address));
        let bad = RawCard { set: vec!["w".into()], ..raw() };
        assert_eq!(ModelCard::new(&bad, None), Err(CardError::Set { word: "w".into() }));
    }
}
