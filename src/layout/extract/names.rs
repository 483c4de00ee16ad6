//! Names of nodes: labels of the drawing where they stand, else what a node is with a number.

use super::Extraction;
use super::boxes::Boxes;
use crate::layout::drawing::Drawing;
use std::collections::HashSet;

/// Names that mean something else in a netlist.
const RESERVED: [&str; 9] = ["subnet", "param", "process", "for", "if", "else", "call", "uses", "pi"];

/// Names all nodes.
pub(super) fn name(result: &mut Extraction, drawing: &Drawing) {
    let boxes: Vec<_> = result.nodes.iter().map(|n| [n.at.map(|x| x - n.reach), n.at.map(|x| x + n.reach)]).collect();
    let tree = Boxes::of(&boxes);
    let mut taken: HashSet<String> = result.layers.iter().map(|layer| layer.name.clone()).collect();
    for label in &drawing.labels {
        let at = label.at.map(|x| f64::from(x) * drawing.unit_m);
        let away = |n: &u32| {
            let p = result.nodes[*n as usize].at;
            (p[0] - at[0]).hypot(p[1] - at[1])
        };
        let near = tree.overlapping(&[at, at]).into_iter();
        let nearest = near.min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        let told = format!("label `{}` at {}", label.text, drawing.place(label.at.map(f64::from)));
        match (nearest, identifier(&label.text)) {
            (None, _) => result.notes.push(format!("{told} stands at no node: it names nothing")),
            (_, None) => result.notes.push(format!("{told} has no letter or digit that a netlist's name may have")),
            (Some(n), Some(name)) => {
                let node = &mut result.nodes[n as usize];
                if !node.name.is_empty() {
                    result.notes.push(format!("{told} stands at node `{}`, which has a name already", node.name));
                } else if taken.insert(name.clone()) {
                    node.name = name;
                } else {
                    result.notes.push(format!("{told}: another node is called `{name}`, this one gets a number"));
                }
            }
        }
    }
    let mut kind = vec!["n"; result.nodes.len()];
    result.bodies.iter().for_each(|body| kind[body.node] = "plate");
    result.anchors.iter().for_each(|n| kind[*n] = "pad");
    let mut next = std::collections::BTreeMap::new();
    for (node, kind) in result.nodes.iter_mut().zip(kind).filter(|(node, _)| node.name.is_empty()) {
        let count = next.entry(kind).or_insert(0usize);
        loop {
            *count += 1;
            let name = format!("{kind}{count}");
            if taken.insert(name.clone()) {
                node.name = name;
                break;
            }
        }
    }
}

/// A text as a name of the netlist language: other characters than letters and digits become `_`; none where nothing is left.
fn identifier(text: &str) -> Option<String> {
    let mut name: String =
        text.trim().chars().take(64).map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !name.bytes().any(|b| b.is_ascii_alphanumeric()) {
        return None;
    }
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || RESERVED.contains(&name.as_str()) {
        name.insert_str(0, "n_");
    }
    Some(name)
}
