//! The mechanism in motion: what `tran --draw` writes.

use super::failure::Failure;
use super::output::{self, check_folder, write_page};
use bimorph::compile::Compiled;
use bimorph::results::format::Format;
use bimorph::results::plot::animation::{self, Frame, Play};
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, Drawing, Scale};
use bimorph::results::plot::shapes::Motion;
use std::path::Path;

/// Numbers that one page holds at most, about: frames times points.
const MOST_NUMBERS: usize = 30_000;
const FEWEST_FRAMES: usize = 60;
const MOST_FRAMES: usize = 240;

/// Samples of a signal: (name, unit, values).
type Samples = (String, String, Vec<f64>);

/// Refuses a file that could not be written, before any work is done.
pub(crate) fn check(path: &Path) -> Result<(), Failure> {
    match Format::from_path(path)? {
        Format::Html | Format::Svg | Format::Png => check_folder(path),
        Format::Raw | Format::Csv => {
            Err(Failure::NoSuchOutput { what: "tran --draw", kind: "table", hint: "write .html, .svg or .png" })
        }
    }
}

/// Names of the signals that a drawing needs: x, y and rotation of every mechanical node, then of the inner points of every
/// beam.
pub(crate) fn signals(compiled: &Compiled) -> Vec<String> {
    let nodes = compiled.structure.nodes.iter().filter(|n| n.mechanical).map(|n| n.name.clone());
    let beams = compiled.structure.beams.iter().zip(&compiled.parts.beams);
    let inner = beams.flat_map(|(beam, points)| (1..points.len() - 1).map(|k| format!("{}[{k}]", beam.name)));
    nodes.chain(inner).flat_map(|name| ["x", "y", "rz"].map(|d| format!("{name}.{d}"))).collect()
}

/// Writes the page, or the picture of the last state, from the samples of [`signals`].
pub(crate) fn write(
    path: &Path,
    compiled: &Compiled,
    title: &str,
    t: &[f64],
    samples: &[Samples],
) -> Result<(), Failure> {
    let format = Format::from_path(path)?;
    if format == Format::Html {
        let wanted = (MOST_NUMBERS / (samples.len() / 3).max(1)).clamp(FEWEST_FRAMES, MOST_FRAMES).min(t.len());
        let frames: Vec<Frame> =
            (0..wanted).map(|i| frame(compiled, t, samples, i * (t.len() - 1) / (wanted - 1).max(1))).collect();
        return write_page(path, &animation::page(&compiled.structure, title, Play::Time, &frames));
    }
    let last = frame(compiled, t, samples, t.len() - 1);
    let title = format!("{title} at {}", last.label);
    let drawing = Drawing {
        structure: &compiled.structure,
        title: &title,
        motion: &last.nodes,
        curves: &last.curves,
        temperatures: &[],
        scale: Scale::Visible,
    };
    let no_table =
        || Err(Failure::NoSuchOutput { what: "tran --draw", kind: "table", hint: "write .html, .svg or .png" });
    output::write(path, format, no_table, || Ok(mechanism::draw(&drawing)))
}

/// The state at sample `row`.
fn frame(compiled: &Compiled, t: &[f64], samples: &[Samples], row: usize) -> Frame {
    let mut columns = samples.chunks_exact(3);
    let mut next = || columns.next().map_or([0.0; 3], |c| [c[0].2[row], c[1].2[row], c[2].2[row]]);
    let nodes: Vec<Motion> =
        compiled.structure.nodes.iter().map(|n| if n.mechanical { next() } else { [0.0; 3] }).collect();
    let curves = (compiled.structure.beams.iter().zip(&compiled.parts.beams))
        .map(|(beam, points)| {
            let mut curve = vec![nodes[beam.a.0]];
            curve.extend((1..points.len() - 1).map(|_| next()));
            curve.push(nodes[beam.b.0]);
            curve
        })
        .collect();
    Frame { label: quantity(t[row], "s"), nodes, curves }
}
