//! The mechanism in motion, for `tran --draw`.

use super::failure::Failure;
use super::output::{self, check_folder, write_page};
use bimorph::compile::CompiledModel;
use bimorph::results::format::ResultFormat;
use bimorph::results::plot::animation::{self, AnimationFrame, Play};
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, DisplacementScale, MechanismFigure};
use bimorph::results::plot::shapes::NodeDisplacement;
use std::path::Path;

/// Numbers that one page holds at most, about: frames times points.
const MAX_NUMBERS: usize = 30_000;
const MIN_FRAMES: usize = 60;
const MAX_FRAMES: usize = 240;

/// Samples of a signal: (name, unit, values).
type NamedSamples = (String, String, Vec<f64>);

/// Refuses a file that could not be written, before any work is done.
pub(crate) fn check(path: &Path) -> Result<(), Failure> {
    match ResultFormat::from_path(path)? {
        ResultFormat::Html | ResultFormat::Svg | ResultFormat::Png => check_folder(path),
        ResultFormat::Raw | ResultFormat::Csv => {
            Err(Failure::NoSuchOutput { what: "tran --draw", kind: "table", hint: "write .html, .svg or .png" })
        }
    }
}

/// Names of the signals that a drawing needs: x, y and rotation of every mechanical node, then of the inner points of every
/// beam.
pub(crate) fn signals(compiled: &CompiledModel) -> Vec<String> {
    let nodes = compiled.structure.nodes.iter().filter(|n| n.mechanical).map(|n| n.name.clone());
    let beams = compiled.structure.beams.iter().zip(&compiled.parts.beams);
    let inner = beams.flat_map(|(beam, points)| (1..points.len() - 1).map(|k| format!("{}[{k}]", beam.name)));
    nodes.chain(inner).flat_map(|name| ["x", "y", "rz"].map(|d| format!("{name}.{d}"))).collect()
}

/// Writes the page, or the picture of the last state, from the samples of [`signals`].
pub(crate) fn write(
    path: &Path,
    compiled: &CompiledModel,
    title: &str,
    t: &[f64],
    samples: &[NamedSamples],
) -> Result<(), Failure> {
    let format = ResultFormat::from_path(path)?;
    if format == ResultFormat::Html {
        let wanted = (MAX_NUMBERS / (samples.len() / 3).max(1)).clamp(MIN_FRAMES, MAX_FRAMES).min(t.len());
        let frames: Vec<AnimationFrame> =
            (0..wanted).map(|i| frame(compiled, t, samples, i * (t.len() - 1) / (wanted - 1).max(1))).collect();
        return write_page(path, &animation::page(&compiled.structure, title, Play::Time, &frames));
    }
    let last = frame(compiled, t, samples, t.len() - 1);
    let title = format!("{title} at {}", last.label);
    let drawing = MechanismFigure {
        structure: &compiled.structure,
        title: &title,
        motion: &last.nodes,
        curves: &last.curves,
        temperatures: &[],
        scale: DisplacementScale::Visible,
    };
    let no_table =
        || Err(Failure::NoSuchOutput { what: "tran --draw", kind: "table", hint: "write .html, .svg or .png" });
    output::write(path, format, no_table, || Ok(mechanism::draw(&drawing)))
}

/// The state at sample `row`.
fn frame(compiled: &CompiledModel, t: &[f64], samples: &[NamedSamples], row: usize) -> AnimationFrame {
    let mut columns = samples.chunks_exact(3);
    let mut next = || columns.next().map_or([0.0; 3], |c| [c[0].2[row], c[1].2[row], c[2].2[row]]);
    let nodes: Vec<NodeDisplacement> =
        compiled.structure.nodes.iter().map(|n| if n.mechanical { next() } else { [0.0; 3] }).collect();
    let curves = (compiled.structure.beams.iter().zip(&compiled.parts.beams))
        .map(|(beam, points)| {
            let mut curve = vec![nodes[beam.a.0]];
            curve.extend((1..points.len() - 1).map(|_| next()));
            curve.push(nodes[beam.b.0]);
            curve
        })
        .collect();
    AnimationFrame { label: quantity(t[row], "s"), nodes, curves }
}
