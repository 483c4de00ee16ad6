//! A library as CIF 2.0: one symbol a cell, called ones first, the last one called at the top.

use super::cells::{Cell, Library, Transform};
use super::write_gds::WriteError;
use std::collections::HashMap;
use std::fmt::Write;

/// The unit of CIF (m).
const CENTIMICRON: f64 = 1e-8;

/// The text of a CIF file. Cells must stand before those that call them.
///
/// # Errors
/// A text with both blanks and a quote, or one with a semicolon or a quote in it, cannot be written; see [`WriteError`].
pub(crate) fn write(library: &Library) -> Result<String, WriteError> {
    let numbers: HashMap<&str, usize> = library.cells.iter().map(|c| c.name.as_str()).zip(1..).collect();
    let [a, b] = scale(library.unit_m);
    let mut text = String::new();
    for (k, cell) in library.cells.iter().enumerate() {
        let _ = write!(text, "DS {} {a} {b};\n9 {};\n", k + 1, cell.name);
        shapes(&mut text, cell, library);
        for call in &cell.calls {
            let Some(number) = numbers.get(call.cell.as_str()) else { continue };
            for row in 0..call.count[1] {
                for column in 0..call.count[0] {
                    let shift = |i: usize| f64::from(column) * call.pitch[0][i] + f64::from(row) * call.pitch[1][i];
                    let origin = [0, 1].map(|i| call.transform.origin[i] + shift(i));
                    let _ = writeln!(text, "C {number}{};", acts(&Transform { origin, ..call.transform }));
                }
            }
        }
        for label in &cell.texts {
            let [x, y] = label.at.map(f64::round);
            let layer = label.layer.map_or(String::new(), |k| format!(" {}", cif_name(&library.layers[k as usize])));
            let _ = writeln!(text, "94 {} {x} {y}{layer};", quoted(&label.text)?);
        }
        text.push_str("DF;\n");
    }
    if let Some(last) = library.cells.last() {
        let _ = writeln!(text, "C {};", numbers[last.name.as_str()]);
    }
    text.push_str("E\n");
    Ok(text)
}

/// Whole numbers a, b with unit = a/b centimicrons.
fn scale(unit_m: f64) -> [u64; 2] {
    let ratio = unit_m / CENTIMICRON;
    let near = |x: f64| (x - x.round()).abs() < 1e-6 * x && x < 1e12;
    for k in 0..=12 {
        let b = 10f64.powi(k);
        if ratio * b >= 0.5 && near(ratio * b) {
            return [(ratio * b).round() as u64, b as u64];
        }
    }
    [((ratio * 1e12).round() as u64).max(1), 1_000_000_000_000]
}

/// A layer's name as CIF can spell it: "45/0" becomes "L45D0".
fn cif_name(layer: &str) -> String {
    match layer.split_once('/') {
        Some((number, datatype)) => format!("L{number}D{datatype}"),
        None => layer.to_owned(),
    }
}

fn shapes(text: &mut String, cell: &Cell, library: &Library) {
    let mut layer = None;
    for shape in &cell.shapes {
        if layer != Some(shape.layer) {
            layer = Some(shape.layer);
            let _ = writeln!(text, "L {};", cif_name(&library.layers[shape.layer as usize]));
        }
        text.push('P');
        for [x, y] in &shape.points {
            let _ = write!(text, " {},{}", x.round(), y.round());
        }
        text.push_str(";\n");
    }
}

/// Mirror, rotation and shift, in that order.
fn acts(t: &Transform) -> String {
    let mut acts = String::new();
    if t.mirrors() {
        acts.push_str(" MY");
    }
    let [a, b] = t.columns[0];
    if [a, b] != [1.0, 0.0] {
        // Directions are whole numbers; those of quarter turns are exact.
        let size = if a == 0.0 || b == 0.0 { 1.0 } else { 1e9 };
        let _ = write!(acts, " R {},{}", (a * size).round(), (b * size).round());
    }
    if t.origin != [0.0; 2] {
        let _ = write!(acts, " T {},{}", t.origin[0].round(), t.origin[1].round());
    }
    acts
}

fn quoted(text: &str) -> Result<String, WriteError> {
    let refused = |why| Err(WriteError::Text { text: text.chars().take(40).collect(), why });
    if text.is_empty() || text.contains(['"', ';', '\n', '\r', '\0']) {
        return refused("CIF has no way to write quotes, semicolons and line ends in it");
    }
    if text.contains(char::is_whitespace) { Ok(format!("\"{text}\"")) } else { Ok(text.to_owned()) }
}
