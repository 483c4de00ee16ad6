//! Cells that repeat as subnets.
//!
//! A placed cell stands for the elements all of whose nodes lie in its box. Two placed cells with equal elements, each
//! in its own frame, are instances of one subnet. Nodes alone connect them with the rest, for any parts that the
//! polygons form. The nodes that something outside touches, in any of them, are the subnet's nodes. Cells that differ
//! stay flat, and their inner cells are examined. Nothing is extracted twice and nothing is changed: the model is that
//! of the flat netlist.

use super::Extraction;
use super::boxes::Boxes;
use super::rows::{Item, LocalFrame, NetlistRow, RowBuilder};
use crate::drawing::Placement;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Places are one when they are the same to this (m): below any grid, above rounding of arithmetic.
const QUANTUM: f64 = 1e-10;
/// Fewest elements of a subnet.
const MIN_ELEMENTS: usize = 2;
/// Two magnifications are one up to this (1).
const MAGNIFIED: f64 = 1e-9;
/// Most kinds of content of cells with one name: with more they do not repeat, and the others stay flat.
const MAX_KINDS: usize = 64;
/// Limits on the elements and nodes visited in the cells of one round: a multiple of those of the scope, and an
/// absolute minimum. Disjoint cells visit each once. Cells whose boxes all overlap, because of one distant element,
/// form no subnets.
const LOOKED_AT: [usize; 2] = [8, 100_000];
/// Bytes of an element as a row, and of its number and nodes.
const BYTES_PER_ROW: usize = 400;

/// Elements and instances in one frame.
#[derive(Debug)]
pub(super) struct Scope {
    pub(super) frame: LocalFrame,
    /// Elements that are in no instance.
    pub(super) items: Vec<Item>,
    pub(super) instances: Vec<SubnetInstance>,
}

/// A subnet with what is in the first of its instances.
#[derive(Debug)]
pub(super) struct Subnet {
    pub(super) name: String,
    /// Nodes of the first instance that are handed in.
    pub(super) terminals: Vec<usize>,
    pub(super) scope: Scope,
}

/// A subnet in a place.
#[derive(Debug)]
pub(super) struct SubnetInstance {
    pub(super) name: String,
    /// Index of its subnet.
    pub(super) subnet: usize,
    pub(super) frame: LocalFrame,
    /// Nodes connected to the subnet's terminals.
    pub(super) terminals: Vec<usize>,
    /// Its node for each node of the first instance.
    pub(super) nodes: HashMap<usize, usize>,
}

/// The drawing as a scope, and the subnets of its instances; those used by others come first.
pub(super) fn scope(found: &Extraction, rows: &RowBuilder<'_>, items: Vec<Item>) -> (Scope, Vec<Subnet>) {
    let places: Vec<_> = found.nodes.iter().map(|n| [n.at, n.at]).collect();
    let mut inside = vec![Vec::new(); found.cells.len()];
    let mut top = Vec::new();
    for (k, cell) in found.cells.iter().enumerate() {
        match cell.parent {
            Some(parent) => inside[parent].push(k),
            None => top.push(k),
        }
    }
    let mut taken: HashSet<String> = found.nodes.iter().map(|n| n.name.clone()).collect();
    taken.extend(found.layers.iter().map(|layer| layer.name.clone()));
    let mut finder = Finder {
        found,
        rows,
        nodes: Boxes::of(&places),
        inside,
        local: HashMap::new(),
        subnets: Vec::new(),
        taken,
        counts: HashMap::new(),
    };
    let labelled: HashSet<usize> = (0..found.nodes.len()).filter(|n| found.nodes[*n].labelled).collect();
    let scope = finder.group(items, top, LocalFrame::DRAWING, &labelled);
    (scope, finder.subnets)
}

struct Finder<'a> {
    found: &'a Extraction,
    rows: &'a RowBuilder<'a>,
    /// Nodes by place.
    nodes: Boxes,
    /// Placed cells in each placed cell.
    inside: Vec<Vec<usize>>,
    /// Box of each cell in its own frame (m).
    local: HashMap<String, [[f64; 2]; 2]>,
    subnets: Vec<Subnet>,
    taken: HashSet<String>,
    /// The last number that a word got.
    counts: HashMap<String, usize>,
}

/// Elements of a scope, with those at each node.
struct ElementIndex {
    items: Vec<Item>,
    at: HashMap<usize, Vec<usize>>,
}

/// Content of a placed cell.
struct Content {
    frame: LocalFrame,
    /// Indices among the scope's items, sorted.
    items: Vec<usize>,
    /// Its nodes in the order of their places in it.
    nodes: Vec<usize>,
    /// Its elements on numbers of those nodes, in order.
    rows: Vec<NetlistRow>,
}

impl Content {
    fn same(&self, other: &Self) -> bool {
        self.nodes.len() == other.nodes.len()
            && self.rows.len() == other.rows.len()
            && self.rows.iter().zip(&other.rows).all(|(a, b)| a.nodes == b.nodes && a.same(b))
    }
}

impl Finder<'_> {
    /// Elements of a scope, with what repeats taken out; nodes of `outer` are needed outside of it.
    fn group(&mut self, items: Vec<Item>, cells: Vec<usize>, frame: LocalFrame, outer: &HashSet<usize>) -> Scope {
        let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
        for (k, item) in items.iter().enumerate() {
            self.found.nodes_of(item).into_iter().for_each(|n| at.entry(n).or_default().push(k));
        }
        let all = ElementIndex { items, at };
        let mut gone = vec![false; all.items.len()];
        let mut instances = Vec::new();
        let mut open = cells;
        while !open.is_empty() && !all.items.is_empty() {
            let mut next = Vec::new();
            let mut left = (LOOKED_AT[0] * (all.items.len() + all.at.len())).max(LOOKED_AT[1]);
            for members in by_name(&self.found.cells, &open) {
                for group in self.alike(&all, &gone, members, &mut left, &mut next) {
                    if let Some(free) = self.free(group, &mut gone, &mut next) {
                        instances.extend(self.subnet(&all, free, outer));
                    }
                }
            }
            open = next;
        }
        let mut kept = gone.into_iter().map(|gone| !gone);
        let items = all.items.into_iter().filter(|_| kept.next().unwrap_or(true)).collect();
        Scope { frame, items, instances }
    }

    /// Placed cells of one name by what is in them; of those that have nothing of their own, the inner ones are `next`.
    /// Once nothing is `left` to examine, the others stay flat.
    fn alike(
        &mut self,
        all: &ElementIndex,
        gone: &[bool],
        members: Vec<usize>,
        left: &mut usize,
        next: &mut Vec<usize>,
    ) -> Vec<Vec<(Content, usize)>> {
        let mut alike: Vec<Vec<(Content, usize)>> = Vec::new();
        for k in members {
            bimorph_base::budget::check();
            if *left == 0 {
                break;
            }
            let Some(mut content) = self.content(all, gone, k, left).filter(|c| c.items.len() >= MIN_ELEMENTS) else {
                next.extend(&self.inside[k]);
                continue;
            };
            match alike.iter().position(|group| group[0].0.same(&content)) {
                Some(kind) => {
                    // those of the first stand for all
                    content.rows = Vec::new();
                    alike[kind].push((content, k));
                }
                None if alike.len() < MAX_KINDS => alike.push(vec![(content, k)]),
                None => next.extend(&self.inside[k]),
            }
        }
        alike
    }

    /// Takes the elements of contents that are the same, where two or more have theirs for themselves: boxes may overlap, and an element
    /// belongs to the first. The cells in the others are `next`.
    fn free(
        &self,
        group: Vec<(Content, usize)>,
        gone: &mut [bool],
        next: &mut Vec<usize>,
    ) -> Option<Vec<(Content, usize)>> {
        let mut free: Vec<(Content, usize)> = Vec::new();
        for (content, k) in group {
            if content.items.iter().all(|i| !gone[*i]) {
                content.items.iter().for_each(|i| gone[*i] = true);
                free.push((content, k));
            } else {
                next.extend(&self.inside[k]);
            }
        }
        if free.len() >= 2 {
            return Some(free);
        }
        for (content, k) in free {
            content.items.iter().for_each(|i| gone[*i] = false);
            next.extend(&self.inside[k]);
        }
        None
    }

    /// Content of a placed cell among the remaining elements of the scope; each visited element is charged to `left`.
    fn content(&mut self, all: &ElementIndex, gone: &[bool], k: usize, left: &mut usize) -> Option<Content> {
        let cell = &self.found.cells[k];
        let unit = self.found.unit;
        let frame = LocalFrame { origin: cell.origin.map(|x| x * unit), angle: cell.angle, mirrored: cell.mirrored };
        let [low, high] = cell.extent.map(|p| p.map(|x| f64::from(x) * unit));
        let own = self.own_box(cell, &frame);
        let near = self.nodes.overlapping(&[low.map(|x| x - unit), high.map(|x| x + unit)]);
        *left = left.saturating_sub(near.len());
        let nodes: BTreeSet<usize> = near
            .into_iter()
            .map(|n| n as usize)
            .filter(|n| {
                let p = frame.place(self.found.nodes[*n].at);
                (0..2).all(|i| p[i] >= own[0][i] - unit && p[i] <= own[1][i] + unit)
            })
            .collect();
        let touching: BTreeSet<usize> =
            nodes.iter().flat_map(|n| all.at.get(n).map_or(&[][..], Vec::as_slice)).copied().collect();
        *left = left.saturating_sub(touching.len());
        let inside = |item: &Item| {
            !matches!(item, Item::Port(..)) && self.found.nodes_of(item).iter().all(|n| nodes.contains(n))
        };
        let chosen: Vec<usize> = touching.into_iter().filter(|i| !gone[*i] && inside(&all.items[*i])).collect();
        if chosen.is_empty() {
            return None;
        }
        bimorph_base::budget::lay_out(chosen.len() * BYTES_PER_ROW);
        let used: BTreeSet<usize> = chosen.iter().flat_map(|i| self.found.nodes_of(&all.items[*i])).collect();
        let mut nodes: Vec<(i64, i64, usize)> = used
            .into_iter()
            .map(|n| {
                let [x, y] = frame.place(self.found.nodes[n].at).map(|x| (x / QUANTUM).round() as i64);
                (x, y, n)
            })
            .collect();
        nodes.sort_unstable();
        let nodes: Vec<usize> = nodes.into_iter().map(|(_, _, n)| n).collect();
        let number: HashMap<usize, usize> = nodes.iter().enumerate().map(|(k, n)| (*n, k)).collect();
        let mut rows: Vec<NetlistRow> = chosen.iter().map(|i| self.rows.row(&all.items[*i], &frame)).collect();
        rows.iter_mut().flat_map(|row| &mut row.nodes).for_each(|n| *n = number[n]);
        rows.iter_mut().filter(|row| row.model == "wire").for_each(|row| row.nodes.sort_unstable());
        rows.sort_by(|a, b| (a.model, &a.nodes).cmp(&(b.model, &b.nodes)));
        Some(Content { frame, items: chosen, nodes, rows })
    }

    /// The box of a cell in its own frame (m): that of the first placed one, exact when that is turned by quarters.
    fn own_box(&mut self, cell: &Placement, frame: &LocalFrame) -> [[f64; 2]; 2] {
        let key = format!("{} {:e}", cell.cell, (cell.magnification / MAGNIFIED).round());
        let quarters = frame.angle / std::f64::consts::FRAC_PI_2;
        let exact = (quarters - quarters.round()).abs() < 1e-9;
        if let Some(known) = self.local.get(&key) {
            return *known;
        }
        let unit = self.found.unit;
        let [low, high] = cell.extent.map(|p| p.map(|x| f64::from(x) * unit));
        let corners = [low, [low[0], high[1]], high, [high[0], low[1]]].map(|p| frame.place(p));
        let own = super::boxes::around(corners);
        if exact {
            self.local.insert(key, own);
        }
        own
    }

    /// Makes a subnet of contents that are the same.
    fn subnet(
        &mut self,
        all: &ElementIndex,
        members: Vec<(Content, usize)>,
        outer: &HashSet<usize>,
    ) -> Vec<SubnetInstance> {
        let (first, cell) = &members[0];
        let outside = |content: &Content, n: &usize| {
            outer.contains(n) || all.at[n].iter().any(|i| content.items.binary_search(i).is_err())
        };
        let mut terminals: Vec<usize> = (0..first.nodes.len())
            .filter(|k| members.iter().any(|(content, _)| outside(content, &content.nodes[*k])))
            .collect();
        if terminals.is_empty() {
            terminals.push(0);
        }
        let word = word(&self.found.cells[*cell].cell);
        let name = self.unused(&format!("{word}_cell"), true);
        let given: HashSet<usize> = terminals.iter().map(|k| first.nodes[*k]).collect();
        let own: Vec<Item> = first.items.iter().map(|i| all.items[*i].clone()).collect();
        let scope = self.group(own, self.inside[*cell].clone(), first.frame, &given);
        self.subnets.push(Subnet { name, terminals: terminals.iter().map(|k| first.nodes[*k]).collect(), scope });
        let subnet = self.subnets.len() - 1;
        let instance = |(content, _): &(Content, usize)| SubnetInstance {
            name: self.unused(&word, false),
            subnet,
            frame: content.frame,
            terminals: terminals.iter().map(|k| content.nodes[*k]).collect(),
            nodes: first.nodes.iter().copied().zip(content.nodes.iter().copied()).collect(),
        };
        members.iter().map(instance).collect()
    }

    /// A name that nothing has: the word itself where `plain`, else with a number.
    fn unused(&mut self, word: &str, plain: bool) -> String {
        let gap = if word.ends_with(|c: char| c.is_ascii_digit()) { "_" } else { "" };
        if plain && self.taken.insert(word.to_owned()) {
            return word.to_owned();
        }
        // a second subnet is called `..._2`
        let count = self.counts.entry(word.to_owned()).or_insert(usize::from(plain));
        loop {
            *count += 1;
            let name = format!("{word}{gap}{count}");
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}

/// Placed cells by name, in the order of the first of each.
fn by_name(cells: &[Placement], some: &[usize]) -> Vec<Vec<usize>> {
    let mut order: Vec<Vec<usize>> = Vec::new();
    let mut known: BTreeMap<(&str, u64), usize> = BTreeMap::new();
    for k in some {
        let size = (cells[*k].magnification / MAGNIFIED).round() as u64;
        let place = *known.entry((cells[*k].cell.as_str(), size)).or_insert(order.len());
        if place == order.len() {
            order.push(Vec::new());
        }
        order[place].push(*k);
    }
    order
}

/// A cell's name as a word of netlists.
fn word(cell: &str) -> String {
    let clean: String = cell.chars().take(40).map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if clean.starts_with(|c: char| c.is_ascii_alphabetic()) { clean } else { format!("cell_{clean}") }
}
