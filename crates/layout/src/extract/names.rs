//! Names of nodes: labels of the drawing where they stand, else what a node is with a number.

use super::Extraction;
use super::boxes::Boxes;
use super::identifier::identifier;
use super::nets::LabelTarget;
use crate::drawing::FlatLayout;
use std::collections::HashSet;

/// Labels reported individually.
const MAX_REPORTED: usize = 20;

/// Names all nodes; `nets` says for each label what conductor it stands on.
pub(super) fn name(result: &mut Extraction, drawing: &FlatLayout, nets: &[Option<LabelTarget>]) {
    let boxes: Vec<_> = result.nodes.iter().map(|n| [n.at.map(|x| x - n.reach), n.at.map(|x| x + n.reach)]).collect();
    let tree = Boxes::of(&boxes);
    let mut taken: HashSet<String> = result.layers.iter().map(|layer| layer.name.clone()).collect();
    for (label, on) in drawing.labels.iter().zip(nets) {
        let at = label.at.map(|x| f64::from(x) * drawing.unit_m);
        let away = |n: &u32| {
            let p = result.nodes[*n as usize].at;
            (p[0] - at[0]).hypot(p[1] - at[1])
        };
        let nearest = |near: Vec<u32>| near.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        let pad = on.and_then(|on| on.pad).map(|pad| result.pads[pad].nodes.iter().map(|n| *n as u32).collect());
        let found = pad.and_then(nearest).or_else(|| nearest(tree.overlapping(&[at, at])));
        let reported = format!("label `{}` at {}", label.text, drawing.place(label.at.map(f64::from)));
        let net = on.and_then(|on| on.net);
        match (found, identifier(&label.text)) {
            (_, None) => result.notes.push(format!("{reported} has no letter or digit that a netlist's name may have")),
            (None, _) if on.is_some() => {}
            (None, _) => result.notes.push(format!("{reported} stands at no node: it names nothing")),
            (Some(n), Some(name)) => {
                let node = &mut result.nodes[n as usize];
                if !node.name.is_empty() && (node.name != name || net.is_none()) {
                    result.notes.push(format!("{reported} stands at node `{}`, which has a name already", node.name));
                } else if taken.insert(name.clone()) {
                    node.name = name;
                    node.labelled = true;
                } else if net.is_none() {
                    result.notes.push(format!("{reported}: another node is called `{name}`, this one gets a number"));
                }
            }
        }
    }
    // a net that is labelled on its wiring
    for net in &result.nets {
        let mut nodes = net.pads.iter().flat_map(|pad| &result.pads[*pad].nodes).copied();
        if let Some(n) = nodes.find(|n| result.nodes[*n].name.is_empty())
            && taken.insert(net.name.clone())
        {
            result.nodes[n].name = net.name.clone();
            result.nodes[n].labelled = true;
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

/// Truncates the notes on labels to the first few, with the number of the others.
pub(super) fn reported(result: &mut Extraction) {
    let mut count = 0usize;
    result.notes.retain(|note| {
        count += usize::from(note.starts_with("label `"));
        count <= MAX_REPORTED || !note.starts_with("label `")
    });
    if count > MAX_REPORTED {
        result
            .notes
            .push(format!("{} more labels that name nothing, or what has a name already", count - MAX_REPORTED));
    }
}
