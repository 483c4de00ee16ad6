//! ngspice 39 lower-cases `.model` lines, also inside quotes. Names and paths are therefore looked up without regard to
//! case where they are not found as spelled.

use crate::model_card::ModelCard;
use bimorph::analysis::readout::expression;
use bimorph::structure::Structure;
use std::path::{Component, Path, PathBuf};

/// The one candidate that is `wanted`, or else the only one that differs from it in case alone.
fn spelled<'a>(wanted: &str, candidates: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    if let Some(same) = candidates.clone().find(|c| *c == wanted) {
        return Some(same);
    }
    let mut close = candidates.filter(|c| c.eq_ignore_ascii_case(wanted));
    close.next().filter(|first| close.all(|other| other == *first))
}

/// Two candidates that a lower-cased `wanted` may be, where there are two.
fn alike<'a>(wanted: &str, candidates: impl Iterator<Item = &'a str>) -> Option<[&'a str; 2]> {
    if wanted.chars().any(char::is_uppercase) {
        return None;
    }
    let mut close = candidates.filter(|c| c.eq_ignore_ascii_case(wanted));
    let first = close.next()?;
    close.find(|other| *other != first).map(|other| [first, other])
}

/// Names of ports, monitors and settings on a line that differ only by case, since ngspice 39 passes them in lower
/// case: the text of the line, and two of the netlist's names.
pub(crate) fn ambiguous(card: &ModelCard, structure: &Structure, parameters: &[&str]) -> Option<(String, [String; 2])> {
    let ports = || structure.ports.iter().map(|p| p.name.as_str());
    let found = |wanted: &str, pair: [&str; 2]| (wanted.to_owned(), pair.map(str::to_owned));
    // names of one kind: a beam `T` has no displacement that could be meant for the node's, `t`
    let owner = |name: &str| {
        let (owner, _) = name.rsplit_once('.')?;
        let nodes = || structure.nodes.iter().map(|n| n.name.as_str());
        let beams = || structure.beams.iter().map(|b| b.name.as_str());
        let pair = alike(owner, nodes()).or_else(|| alike(owner, beams())).or_else(|| alike(owner, gaps(structure)));
        pair.map(|pair| found(owner, pair))
    };
    let port = |name: &str| alike(name, ports()).map(|pair| found(name, pair)).or_else(|| owner(name));
    let set = |name: &str| alike(name, parameters.iter().copied()).map(|pair| found(name, pair));
    (card.ports.iter().find_map(|p| port(&p.name)))
        .or_else(|| card.monitors.iter().find_map(|m| expression::names(&m.signal).find_map(owner)))
        .or_else(|| card.options.set.iter().find_map(|(name, _)| set(name)))
}

/// Names of what has quantities.
fn owners(structure: &Structure) -> impl Iterator<Item = &str> + Clone {
    (structure.nodes.iter().map(|n| n.name.as_str()))
        .chain(structure.beams.iter().map(|b| b.name.as_str()))
        .chain(gaps(structure))
}

/// Names of what has a distance.
fn gaps(structure: &Structure) -> impl Iterator<Item = &str> + Clone {
    (structure.combs.iter().map(|c| c.name.as_str()))
        .chain(structure.plate_gaps.iter().map(|g| g.name.as_str()))
        .chain(structure.beam_gaps.iter().map(|g| g.name.as_str()))
        .chain(structure.stops.iter().map(|s| s.name.as_str()))
}

/// Puts ports and monitors into the netlist's spelling. Names it does not know stay as they are, for the device to
/// refuse.
pub(crate) fn respell(card: &mut ModelCard, structure: &Structure) {
    let ports = structure.ports.iter().map(|p| p.name.as_str());
    let owners = owners(structure);
    let quantity = |name: &str| {
        let (owner, quantity) = name.rsplit_once('.')?;
        let owner = spelled(owner, owners.clone()).unwrap_or(owner);
        let owner = if owner.eq_ignore_ascii_case("frame") && spelled(owner, owners.clone()).is_none() {
            "frame"
        } else {
            owner
        };
        // temperature, capacitance, forces and conductance have a capital letter
        let capital = ["t", "c", "f", "n", "g"].contains(&quantity);
        Some(format!("{owner}.{}", if capital { quantity.to_ascii_uppercase() } else { quantity.to_owned() }))
    };
    for port in &mut card.ports {
        let known = spelled(&port.name, ports.clone()).map(str::to_owned);
        if let Some(name) = known.or_else(|| quantity(&port.name)) {
            port.name = name;
        }
    }
    for monitor in &mut card.monitors {
        monitor.signal = expression::renamed(&monitor.signal, quantity);
    }
}

/// Puts the names of settings into the spelling of the netlist's parameters.
pub(crate) fn respell_settings<'a>(card: &mut ModelCard, parameters: impl Iterator<Item = &'a str> + Clone) {
    for (name, _) in &mut card.options.set {
        if let Some(parameter) = spelled(name, parameters.clone()) {
            *name = parameter.to_owned();
        }
    }
}

/// The file at `path`, or else the only one whose path differs from it in case alone.
pub(crate) fn existing(path: &Path) -> Option<PathBuf> {
    if path.exists() {
        return Some(path.to_owned());
    }
    let mut found = PathBuf::new();
    for part in path.components() {
        let exact = found.join(part);
        let Component::Normal(name) = part else {
            found = exact;
            continue;
        };
        found = if exact.exists() {
            exact
        } else {
            let folder = if found.as_os_str().is_empty() { Path::new(".") } else { &found };
            let mut close = std::fs::read_dir(folder)
                .ok()?
                .filter_map(|e| e.ok().map(|e| e.file_name()))
                .filter(|n| n.eq_ignore_ascii_case(name));
            let one = close.next().filter(|_| close.next().is_none())?;
            found.join(one)
        };
    }
    found.exists().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_card::RawCard;
    use bimorph::netlist::{Bundle, load};

    const NETLIST: &str = "param Width=2u, w=1u\nanchor * [F] [l=1u w=1u h=1u]\nmass2d * [Yoke] [m=1e-10]\n\
        guide2d * [Yoke] []\nspring2d * [F Yoke] [kx=1]\nanchor * [e] [l=1u w=1u h=1u]\n\
        Gap plategap2d * [Yoke e] [A=1e-8 gap=2u]\neground * [e] []\nDrive port * [Yoke e] []\n";

    /// Lower-cased names find their netlist's spelling; unknown ones stay.
    #[test]
    fn respells_what_ngspice_lower_cased() {
        let loaded = load(&Bundle::from_text("n", NETLIST), &[]).unwrap_or_else(|d| panic!("{d}"));
        let words = |text: &str| text.split(' ').map(str::to_owned).collect();
        let raw = RawCard {
            file: Some("n".into()),
            ports: words("drive other yoke.x:1e5 Frame.ax"),
            monitors: words("yoke.x:1e6 gap.q yoke.t gap.c-2*gap.c:1e15"),
            set: words("width=3u w=4u"),
            ..RawCard::default()
        };
        let mut card = ModelCard::new(&raw, None).unwrap();
        respell(&mut card, &loaded.structure);
        respell_settings(&mut card, loaded.parameters.iter().map(|(n, _)| n.as_str()));
        let ports: Vec<_> = card.ports.iter().map(|p| (p.name.as_str(), p.scale)).collect();
        assert_eq!(ports, [("Drive", None), ("other", None), ("Yoke.x", Some(1e5)), ("frame.ax", None)]);
        let signals: Vec<_> = card.monitors.iter().map(|m| m.signal.as_str()).collect();
        assert_eq!(signals, ["Yoke.x", "Gap.q", "Yoke.T", "Gap.C-2*Gap.C"]);
        let set: Vec<_> = card.options.set.iter().map(|(n, _)| n.as_str()).collect();
        assert_eq!(set, ["Width", "w"]);
    }

    /// Names that differ in case alone are reported where the line is in lower case, which may mean either.
    #[test]
    fn names_that_differ_in_case_alone() {
        let text = NETLIST
            .replace("mass2d * [Yoke]", "mass2d * [yoke] [m=1e-10]\nspring2d * [F yoke] [kx=1]\nmass2d * [Yoke]");
        let loaded = load(&Bundle::from_text("n", &text), &[]).unwrap_or_else(|d| panic!("{d}"));
        let split = |monitor: &str| {
            let raw = RawCard { file: Some("n".into()), monitors: vec![monitor.to_owned()], ..RawCard::default() };
            ambiguous(&ModelCard::new(&raw, None).unwrap(), &loaded.structure, &[])
        };
        assert_eq!(split("yoke.x").map(|(name, _)| name), Some("yoke".to_owned()));
        assert_eq!((split("Yoke.x"), split("f.x")), (None, None));
    }

    /// A lower-cased path finds its file, but not where two files differ in case alone.
    #[test]
    fn finds_lower_cased_files() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("Parts")).unwrap();
        let bank = folder.path().join("Parts/Bank.net");
        std::fs::write(&bank, "").unwrap();
        assert_eq!(existing(&folder.path().join("parts/bank.net")), Some(bank));
        std::fs::write(folder.path().join("Parts/BANK.net"), "").unwrap();
        assert_eq!(existing(&folder.path().join("parts/bank.net")), None);
    }
}
