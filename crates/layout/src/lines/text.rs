//! Lines to a netlist that a person reads: names with dots become instances of subnets, equal ones of the same subnet.
//!
//! Every element keeps its full name, and so does every node that only elements of its own instance touch. A node of an instance
//! that something outside touches is called `INSTANCE_NODE` there; an element that has the name of an instance makes
//! that instance's elements `INSTANCE_NAME`. Nodes and names are not changed otherwise.

use super::{ElementLine, ElementLines};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;

/// Instances nest at most this deep; deeper names are flattened.
const DEEPEST: usize = 32;

/// An instance: its own elements, and those in it.
#[derive(Default)]
struct InstanceGroup<'a> {
    /// Indices of lines and names of instances in order of appearance.
    parts: Vec<GroupPart>,
    inside: BTreeMap<String, InstanceGroup<'a>>,
    lines: Vec<&'a ElementLine>,
}

enum GroupPart {
    Line(usize),
    Group(String),
}

/// The netlist.
pub(crate) fn netlist(lines: &ElementLines, heading: &str) -> String {
    let lines = &unclashed(lines);
    let mut text = String::new();
    for line in heading.lines() {
        let _ = writeln!(text, "% {line}");
    }
    for process in &lines.processes {
        let _ = writeln!(text, "{process}");
    }
    let mut top = InstanceGroup::default();
    for line in &lines.elements {
        let path: Vec<&str> = line.name.split('.').collect();
        let mut group = &mut top;
        for part in &path[..path.len() - 1] {
            if !group.inside.contains_key(*part) {
                group.parts.push(GroupPart::Group((*part).to_owned()));
            }
            group = group.inside.entry((*part).to_owned()).or_default();
        }
        group.parts.push(GroupPart::Line(group.lines.len()));
        group.lines.push(line);
    }
    let mut writer = GroupWriter {
        subnets: HashMap::new(),
        taken: BTreeSet::new(),
        definitions: String::new(),
        outside: outside(lines),
    };
    let body = writer.body(&top, "", &HashMap::new());
    text.push_str(&writer.definitions);
    if !writer.definitions.is_empty() {
        text.push('\n');
    }
    text.push_str(&body);
    text
}

/// Lines whose names are neither those of instances nor nested too deep.
fn unclashed(lines: &ElementLines) -> ElementLines {
    let mut lines = lines.clone();
    let names: BTreeSet<String> = lines.elements.iter().map(|l| l.name.clone()).collect();
    for name in lines.elements.iter_mut().flat_map(|line| std::iter::once(&mut line.name).chain(&mut line.nodes)) {
        // From the first dot on that follows an element's name, dots are no dots.
        let dots: Vec<usize> = name.match_indices('.').map(|(k, _)| k).collect();
        if let Some(at) = dots.into_iter().find(|at| names.contains(&name[..*at])) {
            // what comes before that name stays a group
            let own = name[..at].rfind('.').map_or(0, |k| k + 1);
            *name = format!("{}{}", &name[..own], flat(&name[own..]));
        }
    }
    for line in &mut lines.elements {
        if line.name.matches('.').count() > DEEPEST {
            line.name = flat(&line.name);
        }
    }
    lines
}

/// A name without dots: `a.b` is `a_b`, and indices come together at the end, as `z(1).upper(2)` is `z_upper(1,2)`.
fn flat(name: &str) -> String {
    let (mut word, mut indices) = (String::new(), Vec::new());
    for part in name.split('.') {
        let (own, index) = match part.split_once('(') {
            Some((own, index)) => (own, index.strip_suffix(')')),
            None => (part, None),
        };
        if !word.is_empty() {
            word.push('_');
        }
        word.push_str(own);
        indices.extend(index);
    }
    if indices.is_empty() { word } else { format!("{word}({})", indices.join(",")) }
}

/// Nodes of instances that something outside the instance touches.
fn outside(lines: &ElementLines) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for line in &lines.elements {
        let own = line.name.rsplit_once('.').map_or("", |(group, _)| group);
        for node in &line.nodes {
            if let Some((group, _)) = node.rsplit_once('.')
                && !within(own, group)
            {
                all.insert(node.clone());
            }
        }
    }
    all
}

/// True when the instance `inner` is `outer` or lies in it.
fn within(inner: &str, outer: &str) -> bool {
    inner.strip_prefix(outer).is_some_and(|rest| outer.is_empty() || rest.is_empty() || rest.starts_with('.'))
}

/// Nodes of all elements in an instance, in order.
fn all_nodes<'a>(group: &InstanceGroup<'a>) -> impl Iterator<Item = &'a String> {
    let mut stack = vec![group];
    let mut all: Vec<&'a ElementLine> = Vec::new();
    while let Some(group) = stack.pop() {
        all.extend(&group.lines);
        stack.extend(group.inside.values().rev());
    }
    all.into_iter().flat_map(|line| &line.nodes)
}

struct GroupWriter {
    /// Names of subnets by their text.
    subnets: HashMap<String, String>,
    taken: BTreeSet<String>,
    definitions: String,
    outside: BTreeSet<String>,
}

impl GroupWriter {
    /// The elements of an instance; `formals` are the names that nodes from outside have in it.
    fn body(&mut self, group: &InstanceGroup<'_>, path: &str, formals: &HashMap<String, String>) -> String {
        let mut text = String::new();
        for part in &group.parts {
            match part {
                GroupPart::Line(k) => {
                    let line = group.lines[*k];
                    let name = line.name.rsplit('.').next().unwrap_or(&line.name).to_owned();
                    let nodes = line.nodes.iter().map(|n| self.local(n, path, formals)).collect();
                    let local = ElementLine { name, nodes, ..line.clone() }.to_string();
                    // A netlist numbers its nameless elements itself.
                    let unnamed =
                        local.strip_prefix("anon").map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
                    let _ = writeln!(text, "{}", unnamed.and_then(|rest| rest.strip_prefix(' ')).unwrap_or(&local));
                }
                GroupPart::Group(name) => {
                    let inner = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                    let given = self.given(&group.inside[name], &inner);
                    let words = self.words(&group.inside[name], &inner, &given);
                    let inside = given.iter().cloned().zip(words.iter().cloned()).collect();
                    let body = self.body(&group.inside[name], &inner, &inside);
                    let subnet = self.subnet(name, &words, &body);
                    let nodes: Vec<String> = given.iter().map(|n| self.local(n, path, formals)).collect();
                    let _ = writeln!(text, "{name} {subnet} * [{}] []", nodes.join(" "));
                }
            }
        }
        text
    }

    /// Nodes that an instance is given: those that are not its own, in order of appearance.
    fn given(&self, group: &InstanceGroup<'_>, path: &str) -> Vec<String> {
        let (mut seen, mut given) = (BTreeSet::new(), Vec::new());
        for node in all_nodes(group) {
            let own = node.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
            if (!own || self.outside.contains(node)) && seen.insert(node) {
                given.push(node.clone());
            }
        }
        given
    }

    /// Names of the given nodes in an instance: n1, n2, …, skipping the names of its own nodes.
    fn words(&self, group: &InstanceGroup<'_>, path: &str, given: &[String]) -> Vec<String> {
        let handed: BTreeSet<&String> = given.iter().collect();
        let own: BTreeSet<String> =
            all_nodes(group).filter(|n| !handed.contains(n)).map(|n| self.local(n, path, &HashMap::new())).collect();
        let mut free = (1..).map(|k| format!("n{k}")).filter(|word| !own.contains(word));
        given.iter().filter_map(|_| free.next()).collect()
    }

    /// Name of a node in an instance.
    fn local(&self, node: &str, path: &str, formals: &HashMap<String, String>) -> String {
        if let Some(formal) = formals.get(node) {
            return formal.clone();
        }
        let rest = node.strip_prefix(path).and_then(|r| if path.is_empty() { Some(r) } else { r.strip_prefix('.') });
        rest.unwrap_or(node).replace('.', "_")
    }

    /// The subnet of that text: one that is there, or a new one.
    fn subnet(&mut self, instance: &str, formals: &[String], body: &str) -> String {
        let key = format!("{}\n{body}", formals.join(" "));
        if let Some(name) = self.subnets.get(&key) {
            return name.clone();
        }
        let word: String = instance.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
        let mut name = format!("{word}_part");
        let mut k = 1;
        while !self.taken.insert(name.clone()) {
            k += 1;
            name = format!("{word}_part{k}");
        }
        let _ = write!(self.definitions, "\nsubnet {name} [{}] []\n[\n", formals.join(" "));
        for line in body.lines() {
            let _ = writeln!(self.definitions, "  {line}");
        }
        self.definitions.push_str("]\n");
        self.subnets.insert(key, name.clone());
        name
    }
}
