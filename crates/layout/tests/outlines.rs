//! Outlines of parametric cells as open layout programs draw them: one layer, pads without a mask of anchors, arms that overlap. The eight cells are those of
//! `gdsfactory.components.mems` (9.45) with their default sizes, drawn here by code of our own from the sizes in its documentation.

use bimorph_layout::convert::Converted;
use bimorph_layout::input;
use std::fmt::Write;

/// One layer of silicon, 0.5 µm, whose anchors no mask draws.
const PADS: &str = "name = \"wg\"\nabout = \"one layer\"\n\n[material.si]\nYoungsmodulus = 165e9\ndensity = 2330\n\n\
                    [[layer]]\nname = \"p1\"\ndrawn = [\"1/0\"]\nthickness = 0.5e-6\nmaterial = \"si\"\n";

/// The same, held where it is wider than 2.1 µm.
const WIDE: &str = "undercut = 1.05e-6\n";

/// Polygons of one layer (µm).
#[derive(Default)]
struct Outline(String);

impl Outline {
    fn polygon(&mut self, points: &[[f64; 2]]) {
        self.0.push('P');
        for [x, y] in points {
            let nanometres = |a: f64| (a * 1e3).round() as i64;
            let _ = write!(self.0, " {} {}", nanometres(*x), nanometres(*y));
        }
        self.0.push_str(";\n");
    }

    fn rectangle(&mut self, low: [f64; 2], high: [f64; 2]) {
        self.polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]]);
    }

    /// A rectangle by its middle and sides.
    fn block(&mut self, [x, y]: [f64; 2], [w, h]: [f64; 2]) {
        self.rectangle([x - w / 2.0, y - h / 2.0], [x + w / 2.0, y + h / 2.0]);
    }

    fn converted(&self, process: &str) -> Converted {
        let text = format!("DS 1 1 10;\n9 cell;\nL L1D0;\n{}DF;\nC 1;\nE\n", self.0);
        let read = input::from_bytes(text.as_bytes(), "cell.cif", Some(process), None).expect("a drawing");
        bimorph_netlist::load(&read.bundle, &[]).unwrap_or_else(|e| panic!("{e}"));
        read.converted.expect("a layout")
    }
}

fn count(converted: &Converted, what: &str) -> usize {
    converted.report.counts.get(what).copied().unwrap_or(0)
}

/// Anchors, beams and bodies that a drawing has, all of it understood.
fn understood(outline: &Outline, [anchors, beams, bodies]: [usize; 3]) -> Converted {
    let found = outline.converted(PADS);
    assert!(found.report.unrecognised.is_empty(), "{:?}", found.report.unrecognised);
    let counted = ["anchors", "beams", "bodies"].map(|what| count(&found, what));
    assert_eq!(counted, [anchors, beams, bodies], "{}", found.netlist);
    found
}

/// A beam between pads: cantilever, doubly clamped beam and flexure hinge. Length and width are those drawn.
#[test]
fn beams_between_pads() {
    for (pad, length, width, pads) in [(5.0, 20.0, 2.0, 1), (5.0, 30.0, 1.0, 2), (10.0, 5.0, 0.3, 2)] {
        let mut cell = Outline::default();
        cell.rectangle([-pad, -pad / 2.0], [0.0, pad / 2.0]);
        cell.rectangle([0.0, -width / 2.0], [length, width / 2.0]);
        if pads == 2 {
            cell.rectangle([length, -pad / 2.0], [length + pad, pad / 2.0]);
        }
        let found = understood(&cell, [pads, 1, 0]);
        let size = format!("l={length}u w={width}u");
        assert!(found.netlist.contains(&size), "{size}\n{}", found.netlist);
    }
}

/// A chevron of two arms at 5° whose outline crosses itself at the apex.
#[test]
fn bent_beam() {
    let (length, half, pad) = (40.0, 0.5, 5.0);
    let (s, c) = 5f64.to_radians().sin_cos();
    let (dx, dy) = (length * c, length * s);
    let (left, right) = ([-s, c], [s, c]);
    let moved = |at: [f64; 2], n: [f64; 2], by: f64| [at[0] + by * n[0], at[1] + by * n[1]];
    let mut cell = Outline::default();
    cell.polygon(&[
        moved([-dx, 0.0], left, half),
        moved([0.0, dy], left, half),
        moved([0.0, dy], right, half),
        moved([dx, 0.0], right, half),
        moved([dx, 0.0], right, -half),
        moved([0.0, dy], right, -half),
        moved([0.0, dy], left, -half),
        moved([-dx, 0.0], left, -half),
    ]);
    cell.rectangle([-dx - pad, -pad / 2.0], [-dx, pad / 2.0]);
    cell.rectangle([dx, -pad / 2.0], [dx + pad, pad / 2.0]);
    understood(&cell, [2, 2, 0]);
}

/// A meander of four beams with three connecting pieces between two pads.
#[test]
fn folded_spring() {
    let (length, width, gap) = (20.0, 0.5, 1.0);
    let mut cell = Outline::default();
    cell.rectangle([-2.5, -3.0], [2.5, 0.0]);
    for k in 0..4 {
        let y = f64::from(k) * (width + gap);
        cell.rectangle([0.0, y], [length, y + width]);
        if k < 3 {
            let x = if k % 2 == 0 { length - width } else { 0.0 };
            cell.rectangle([x, y + width], [x + width, y + width + gap]);
        }
    }
    let top = 4.0 * width + 3.0 * gap;
    cell.rectangle([-2.5, top], [2.5, top + 3.0]);
    understood(&cell, [2, 7, 0]);
}

/// An absorber on four legs. Without `undercut` it moves; with it the plate is held like the pads, and a note says so.
#[test]
fn bolometer() {
    let mut cell = Outline::default();
    cell.block([0.0; 2], [20.0; 2]);
    for [x, y] in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
        let leg = if x == 0.0 { [0.5, 15.0] } else { [15.0, 0.5] };
        cell.block([17.5 * x, 17.5 * y], leg);
        cell.block([27.5 * x, 27.5 * y], [5.0; 2]);
    }
    understood(&cell, [4, 4, 1]);
    let held = cell.converted(&(PADS.to_owned() + WIDE));
    assert_eq!(count(&held, "bodies"), 0, "{}", held.netlist);
    assert!(held.report.notes.iter().any(|note| note.contains("is held, being wider")), "{:?}", held.report.notes);
}

/// A shuttle with fingers on both sides between two combs, on four springs of one beam. `shuttle` is its height.
fn comb_drive(shuttle: f64) -> Outline {
    let (finger, length, gap, overlap, count) = (0.5, 10.0, 0.5, 5.0, 20);
    let (half, spring) = (15.0, 20.0);
    let pitch = 2.0 * (finger + gap);
    let start = -f64::from(count) * pitch / 2.0;
    let bar = half + 2.0 * length - overlap;
    let mut cell = Outline::default();
    cell.block([0.0; 2], [2.0 * half, shuttle]);
    for side in [1.0, -1.0] {
        cell.block([side * (bar + 2.5), 0.0], [5.0, f64::from(count) * pitch + 10.0]);
        for k in 0..count {
            let y = start + f64::from(k) * pitch + finger / 2.0;
            cell.block([side * (half + length / 2.0), y], [length, finger]);
            cell.block([side * (bar - length / 2.0), y + finger + gap], [length, finger]);
        }
        for up in [1.0, -1.0] {
            cell.block([side * half / 2.0, up * (shuttle + spring) / 2.0], [0.5, spring]);
            cell.block([side * half / 2.0, up * (shuttle / 2.0 + spring + 5.0)], [10.0; 2]);
        }
    }
    cell
}

/// A comb drive whose shuttle is as high as its fingers is read whole. With the default shuttle, 5 µm high, most fingers of the cell touch nothing:
/// they are reported one by one with place and area.
#[test]
fn comb_drives() {
    let whole = understood(&comb_drive(45.0), [6, 4, 3]);
    assert_eq!(count(&whole, "combs"), 2, "{}", whole.netlist);
    let found = comb_drive(5.0).converted(&(PADS.to_owned() + WIDE));
    let loose = found.report.unrecognised.iter().filter(|piece| piece.why.contains("without support")).count();
    // 20 fingers on either side, of which those between −2.5 and 2.5 µm, and those under springs and pads, are joined
    assert!(loose >= 14, "{loose}: {:?}", found.report.unrecognised);
}

/// A gear is one part without limbs: it is held as a whole, and nothing moves.
#[test]
fn gear() {
    let mut cell = Outline::default();
    let at = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
    let pitch = std::f64::consts::TAU / 20.0;
    let teeth = (0..20).flat_map(|k| {
        let middle = f64::from(k) * pitch;
        [(17.5, -0.12), (22.0, -0.04), (22.0, 0.04), (17.5, 0.12)].map(|(radius, turn)| at(radius, middle + turn))
    });
    cell.polygon(&teeth.collect::<Vec<_>>());
    let found = cell.converted(PADS);
    assert_eq!(["anchors", "beams", "bodies"].map(|what| count(&found, what)), [1, 0, 0], "{}", found.netlist);
    assert!(found.report.notes.iter().any(|note| note.contains("parts without limbs")), "{:?}", found.report.notes);
}
