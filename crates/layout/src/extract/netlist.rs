//! An extraction as a netlist in SUGAR's language.
//!
//! Widths and lengths that several beams share are parameters, so that the model can be swept; cells that repeat are subnets
//! ([`super::repeats`]). The same drawing gives the same bytes.

use super::Extraction;
use super::conductors;
use super::repeats::{self, Scope, Subnet, SubnetInstance};
use super::rows::{Item, LocalFrame, NetlistRow, RowBuilder, RowValue};
use bimorph_base::sets::Sets;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;

/// So many beams must share a width, or a length, for it to become a parameter.
const SHARED: [usize; 2] = [2, 3];

/// A netlist with the names of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenNetlist {
    /// The netlist.
    pub text: String,
    /// Full name of each node of the extraction in it.
    pub names: Vec<String>,
    /// For lines that are elements or materials, from 1: the layer, and the middle of the nodes in the drawing (m).
    pub places: BTreeMap<usize, (String, [f64; 2])>,
}

/// The netlist of an extraction.
pub fn netlist(extraction: &Extraction) -> String {
    written(extraction).text
}

/// The netlist of an extraction, and what its nodes are called there.
pub fn written(extraction: &Extraction) -> WrittenNetlist {
    let rows = RowBuilder::new(extraction);
    let items = items(extraction);
    let mut text = String::new();
    let marks = RefCell::new(Vec::new());
    head(extraction, &mut text, &mut marks.borrow_mut());
    let flat: Vec<NetlistRow> = items.iter().map(|item| rows.row(item, &LocalFrame::DRAWING)).collect();
    let words = Words::new(&flat, &mut text);
    let (scope, subnets) = repeats::scope(extraction, &rows, items);
    let writer = NetlistWriter { extraction, words, rows, subnets: &subnets, marks };
    let locals: Vec<HashMap<usize, String>> = subnets.iter().map(|subnet| writer.locals(subnet)).collect();
    for (subnet, local) in subnets.iter().zip(&locals) {
        let formals: Vec<&str> = subnet.terminals.iter().map(|n| local[n].as_str()).collect();
        let _ = writeln!(text, "subnet {} [{}] [] [", subnet.name, formals.join(" "));
        writer.scope(&subnet.scope, &|n| local[&n].clone(), "  ", &mut text);
        text.push_str("]\n");
    }
    let mut names: Vec<String> = extraction.nodes.iter().map(|n| n.name.clone()).collect();
    writer.scope(&scope, &|n| extraction.nodes[n].name.clone(), "", &mut text);
    let all: HashMap<usize, usize> = (0..names.len()).map(|n| (n, n)).collect();
    writer.inner(&scope, "", &all, &locals, &mut names);
    let places = writer.places_of_lines(&text);
    WrittenNetlist { text, names, places }
}

/// All elements in the order in which they are written.
fn items(extraction: &Extraction) -> Vec<Item> {
    let mut items: Vec<Item> = extraction.anchors.iter().map(|n| Item::Anchor(*n)).collect();
    items.extend((0..extraction.bodies.len()).map(Item::Body));
    items.extend((0..extraction.links.len()).map(Item::Link));
    items.extend((0..extraction.roots.len()).map(Item::Root));
    items.extend((0..extraction.beams.len()).map(Item::Beam));
    items.extend((0..extraction.arcs.len()).map(Item::Arc));
    items.extend((0..extraction.combs.len()).map(Item::Comb));
    items.extend((0..extraction.plates.len()).map(Item::Plates));
    items.extend((0..extraction.facing.len()).map(Item::Facing));
    items.extend(conductors::conductors(extraction));
    items
}

fn head(extraction: &Extraction, out: &mut String, marks: &mut Vec<LineMark>) {
    let clean = |text: &str| text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let _ = writeln!(
        out,
        "% {}, cell {}, process {}",
        clean(&extraction.source),
        clean(&extraction.top),
        extraction.process
    );
    for lost in &extraction.unrecognised {
        let [x, y] = lost.at.map(|x| x * 1e6);
        let _ = writeln!(
            out,
            "% not in the model: {:.6} um2 of {} at ({x:.3}, {y:.3}) um: {}",
            lost.area * 1e12,
            clean(&lost.layer),
            clean(&lost.why)
        );
    }
    for (k, layer) in extraction.layers.iter().enumerate() {
        let first = extraction.bodies.iter().find(|b| b.layer == k).map(|b| b.node);
        let first = first.or_else(|| extraction.beams.iter().find(|b| b.layer == k).map(|b| b.nodes[0]));
        marks.extend(first.map(|n| LineMark {
            at: out.len(),
            layer: layer.name.clone(),
            place: extraction.nodes[n].at,
        }));
        let entries: Vec<String> =
            layer.material.iter().map(|(name, value)| format!("{name}={}", number(*value))).collect();
        let _ = writeln!(out, "process {} = [ {} h={} ]", layer.name, entries.join(" "), micro(layer.thickness));
    }
}

/// Where a line begins, and what it stands for.
struct LineMark {
    /// Byte of the netlist.
    at: usize,
    layer: String,
    /// Place in the drawing (m).
    place: [f64; 2],
}

struct NetlistWriter<'a> {
    extraction: &'a Extraction,
    words: Words,
    rows: RowBuilder<'a>,
    subnets: &'a [Subnet],
    marks: RefCell<Vec<LineMark>>,
}

impl NetlistWriter<'_> {
    /// Elements that lines of the netlist represent, by line number.
    fn places_of_lines(&self, text: &str) -> BTreeMap<usize, (String, [f64; 2])> {
        let (mut line, mut from, mut places) = (1, 0, BTreeMap::new());
        for mark in self.marks.borrow().iter() {
            line += text[from..mark.at].matches('\n').count();
            from = mark.at;
            places.insert(line, (mark.layer.clone(), mark.place));
        }
        places
    }

    /// The lines of a scope.
    fn scope(&self, scope: &Scope, name: &dyn Fn(usize) -> String, indent: &str, out: &mut String) {
        self.places(scope, name, indent, out);
        for instance in &scope.instances {
            let seen = instance.frame.within(&scope.frame);
            let mut turned = Vec::new();
            if let Some(oz) = direction(seen.angle) {
                turned.push(format!("oz={oz}"));
            }
            if seen.mirrored {
                turned.push("ox=pi".to_owned());
            }
            let nodes: Vec<String> = instance.terminals.iter().map(|n| name(*n)).collect();
            let subnet = &self.subnets[instance.subnet].name;
            let _ = writeln!(out, "{indent}{} {subnet} * [{}] [{}]", instance.name, nodes.join(" "), turned.join(" "));
        }
        for item in &scope.items {
            let row = self.rows.row(item, &scope.frame);
            let nodes = self.extraction.nodes_of(item);
            let place = [0, 1].map(|i| {
                nodes.iter().map(|n| self.extraction.nodes[*n].at[i]).sum::<f64>() / nodes.len().max(1) as f64
            });
            self.marks.borrow_mut().push(LineMark { at: out.len(), layer: row.layer.clone(), place });
            let _ = writeln!(out, "{indent}{}", self.words.line(&row, name));
        }
    }

    /// Places nodes that are not connected with the first one.
    fn places(&self, scope: &Scope, name: &dyn Fn(usize) -> String, indent: &str, out: &mut String) {
        let mut shown: BTreeSet<usize> = scope.items.iter().flat_map(|item| self.extraction.nodes_of(item)).collect();
        shown.extend(scope.instances.iter().flat_map(|i| i.terminals.iter().copied()));
        let number: BTreeMap<usize, usize> = shown.iter().enumerate().map(|(k, n)| (*n, k)).collect();
        let mut sets = Sets::new(shown.len());
        for item in &scope.items {
            if let Item::Beam(_) | Item::Arc(_) | Item::Link(_) | Item::Root(_) = item {
                let nodes = self.extraction.nodes_of(item);
                sets.join(number[&nodes[0]], number[&nodes[1]]);
            }
        }
        for instance in &scope.instances {
            instance.terminals.iter().for_each(|n| {
                sets.join(number[&instance.terminals[0]], number[n]);
            });
        }
        let Some(first) = shown.first().copied() else { return };
        for n in shown.iter().copied().skip(1).filter(|n| sets.first(number[n]) == number[n]) {
            let [p, q] = [first, n].map(|n| self.extraction.nodes[n].at);
            let d = scope.frame.direction([q[0] - p[0], q[1] - p[1]]);
            let _ = writeln!(out, "{indent}pos * [{} {}] [x={} y={}]", name(first), name(n), micro(d[0]), micro(d[1]));
        }
    }

    /// Names of nodes inside a subnet: its terminals, and its own nodes that no inner instance owns.
    fn locals(&self, subnet: &Subnet) -> HashMap<usize, String> {
        let mut names: HashMap<usize, String> =
            subnet.terminals.iter().enumerate().map(|(k, n)| (*n, format!("t{}", k + 1))).collect();
        let own = subnet.scope.items.iter().flat_map(|item| self.extraction.nodes_of(item));
        let given = subnet.scope.instances.iter().flat_map(|i| i.terminals.iter().copied());
        let own: BTreeSet<usize> = own.chain(given).filter(|n| !names.contains_key(n)).collect();
        let mut count: BTreeMap<&str, usize> = BTreeMap::new();
        for n in own {
            // "pad", "plate" or "n" of the name in the drawing
            let kind = self.extraction.nodes[n].name.trim_end_matches(|c: char| c.is_ascii_digit());
            let kind = if kind.is_empty() || kind == "t" { "n" } else { kind };
            let k = count.entry(kind).or_insert(0);
            *k += 1;
            names.insert(n, format!("{kind}{k}"));
        }
        names
    }

    /// Names of the nodes that instances have for themselves; `from` leads from the nodes of the scope to those of its place.
    fn inner(
        &self,
        scope: &Scope,
        path: &str,
        from: &HashMap<usize, usize>,
        locals: &[HashMap<usize, String>],
        names: &mut [String],
    ) {
        for SubnetInstance { name, subnet, nodes, .. } in &scope.instances {
            let path = format!("{path}{name}.");
            let here: HashMap<usize, usize> = nodes.iter().map(|(first, own)| (*first, from[own])).collect();
            let inside = &self.subnets[*subnet];
            for (n, local) in locals[*subnet].iter().filter(|(n, _)| !inside.terminals.contains(n)) {
                names[here[n]] = format!("{path}{local}");
            }
            self.inner(&inside.scope, &path, &here, locals, names);
        }
    }
}

/// Values that several beams have, as parameters.
struct Words {
    wide: HashMap<String, String>,
    long: HashMap<String, String>,
}

impl Words {
    /// Finds them, and writes them down.
    fn new(rows: &[NetlistRow], out: &mut String) -> Self {
        let values = || rows.iter().flat_map(|row| &row.values).map(|(_, value)| value);
        let wide = values().filter_map(|v| if let RowValue::Wide(x) = v { Some(micro(*x)) } else { None });
        let long = values().filter_map(|v| if let RowValue::Long(x) = v { Some(micro(*x)) } else { None });
        Self { wide: shared("w", "width", SHARED[0], wide, out), long: shared("l", "length", SHARED[1], long, out) }
    }

    fn value(&self, value: &RowValue) -> Option<String> {
        let or = |words: &HashMap<String, String>, x: f64| {
            let plain = micro(x);
            words.get(&plain).cloned().unwrap_or(plain)
        };
        Some(match value {
            RowValue::Long(x) => or(&self.long, *x),
            RowValue::Wide(x) => or(&self.wide, *x),
            RowValue::Metres(x) => micro(*x),
            RowValue::Turn(x) => return direction(*x),
            RowValue::Angle(x) => format!("deg({})", degrees(*x)),
            RowValue::Plain(x) => number(*x),
            RowValue::Count(n) => n.to_string(),
            RowValue::Word(word) => (*word).to_owned(),
        })
    }

    fn line(&self, row: &NetlistRow, name: &dyn Fn(usize) -> String) -> String {
        let nodes: Vec<String> = row.nodes.iter().map(|n| name(*n)).collect();
        let values = row.values.iter().filter_map(|(key, value)| Some(format!("{key}={}", self.value(value)?)));
        let values: Vec<String> = values.collect();
        let blank = if row.name.is_empty() { "" } else { " " };
        let comment = if row.comment.is_empty() { String::new() } else { format!("  % {}", row.comment) };
        format!("{}{blank}{} {} [{}] [{}]{comment}", row.name, row.model, row.layer, nodes.join(" "), values.join(" "))
    }
}

fn shared(
    prefix: &str,
    what: &str,
    least: usize,
    values: impl Iterator<Item = String>,
    out: &mut String,
) -> HashMap<String, String> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    let mut at: HashMap<String, usize> = HashMap::new();
    for value in values {
        let k = *at.entry(value.clone()).or_insert_with(|| {
            counts.push((value, 0));
            counts.len() - 1
        });
        counts[k].1 += 1;
    }
    let mut words = HashMap::new();
    for (k, (value, count)) in counts.into_iter().filter(|(_, count)| *count >= least).enumerate() {
        let name = format!("{prefix}{}", k + 1);
        let _ = writeln!(out, "param {name} = {value}  % {what} of {count} beams");
        words.insert(value, name);
    }
    words
}

/// A length in micrometres with the suffix of the language, to 0.1 pm.
fn micro(metres: f64) -> String {
    let rounded = (metres * 1e13).round() / 1e7;
    if rounded == 0.0 { "0".to_owned() } else { format!("{rounded}u") }
}

/// A number of the language.
fn number(value: f64) -> String {
    let plain = format!("{value}");
    if plain.len() <= 8 { plain } else { format!("{value:e}") }
}

/// An angle in degrees, to 1e-9.
fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e9).round() / 1e9
}

/// An angle between −180° and 180°; none along x.
fn direction(radians: f64) -> Option<String> {
    let turned = degrees(radians.sin().atan2(radians.cos()));
    match turned {
        0.0 => None,
        90.0 => Some("pi/2".to_owned()),
        -90.0 => Some("-pi/2".to_owned()),
        180.0 | -180.0 => Some("pi".to_owned()),
        _ => Some(format!("deg({turned})")),
    }
}
