//! The nonlinear lumped model as a Verilog-A module, by the rules of [`super::verilog_a`]: every state is a node, and nothing but
//! `ddt` acts in time.

use super::laws::{bearing, capacitance, contact_reading, drag, loses, pressing, slope};
use super::lumped::{Coordinate, Law, LumpedModel, LumpedOutput};
use super::names::Pins;
use super::noise_sources::{NoiseText, warm};
use super::verilog_a::{ContributionSum, head};
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;

/// The file: a descriptive header, and the module `name`.
pub fn write(model: &LumpedModel, pins: &Pins, name: &str, about: &[String]) -> String {
    let coordinates = (1..=model.coordinates.len()).flat_map(|k| [format!("x{k}"), format!("v{k}")]);
    let gaps = model.gaps.iter().enumerate().flat_map(|(g, gap)| {
        let of = |name: &str| format!("{name}{}", g + 1);
        let voltage = matches!(gap.law, Law::Field(..)).then(|| of("e"));
        [Some(of("g")), voltage, loses(gap).then(|| of("s"))].into_iter().flatten()
    });
    let noise = noise(model);
    let inner: Vec<String> = coordinates.chain(gaps).chain(noise.nodes).collect();
    let radii: Vec<String> = (0..model.rows.len()).filter(|row| conducts(model, *row)).map(radius_name).collect();
    let mut text = head(name, pins, &inner, &radii, &model.ports, about);
    for (g, gap) in model.gaps.iter().enumerate() {
        let mut sum = ContributionSum::begin(&format!("I(g{0}) <+ V(g{0})", g + 1));
        add(&mut sum, "x", &gap.along, -1.0);
        sum.end(&mut text);
        if loses(gap) {
            let mut sum = ContributionSum::begin(&format!("I(s{0}) <+ V(s{0})", g + 1));
            for (j, (share, c)) in gap.along.iter().zip(&model.coordinates).enumerate() {
                sum.add(-1e-6 * share * c.omega, &format!("V(v{})", j + 1));
            }
            sum.end(&mut text);
        }
        if matches!(gap.law, Law::Field(..)) {
            let mut sum = ContributionSum::begin(&format!("I(e{0}) <+ V(e{0})", g + 1));
            add(&mut sum, "b", &gap.by_port, -1.0);
            sum.add(-gap.constant, "1");
            sum.end(&mut text);
        }
    }
    for (j, c) in model.coordinates.iter().enumerate() {
        let (x, v, unit) = (format!("x{}", j + 1), format!("v{}", j + 1), c.mass * c.omega * c.omega * 1e-6);
        ContributionSum::begin(&format!("I({x}) <+ ddt({:e} * V({x})) - V({v})", 1.0 / c.omega)).end(&mut text);
        let mut sum = ContributionSum::begin(&format!("I({v}) <+ ddt({:e} * V({v}))", 1.0 / c.omega));
        for (i, other) in model.coordinates.iter().enumerate() {
            sum.add(1e-6 * model.stiffness[(j, i)] / unit, &format!("V(x{})", i + 1));
            sum.add(1e-6 * other.omega * model.damping[(j, i)] / unit, &format!("V(v{})", i + 1));
        }
        sum.add(-model.load[j] / unit, "1");
        for (q, port) in model.ports.iter().enumerate() {
            let of = if port.kind.given_flow() { "I" } else { "V" };
            sum.add(-model.push[(j, q)] * model.given[q] / unit, &format!("{of}(b{})", q + 1));
        }
        for (g, gap) in model.gaps.iter().enumerate() {
            let (share, u, e) = (gap.along[j] / unit, format!("V(g{})", g + 1), format!("V(e{})", g + 1));
            if let Law::Field(capacitor, _) = &gap.law {
                sum.add(-0.5 * share, &format!("{e} * {e} * {}", slope(capacitor, &u)));
            }
            let rate = format!("V(s{})", g + 1);
            let bearing = bearing(&gap.law, gap.loss, &u, &rate);
            bearing.into_iter().chain(drag(gap.film, &u, &rate)).for_each(|resisting| sum.add(share, &resisting));
        }
        sum.end(&mut text);
    }
    for row in 0..model.rows.len() {
        add_row(model, row, pins, &mut text);
    }
    text.push_str(&noise.text);
    text.push_str("  end\nendmodule\n");
    text
}

/// Whether a row shows the conductance of a contact, whose radius is a variable.
fn conducts(model: &LumpedModel, row: usize) -> bool {
    matches!(model.rows[row], LumpedOutput::Conductance(..))
}

/// Variable of the radius of a contact that a row shows (µm).
fn radius_name(row: usize) -> String {
    format!("a{}", row + 1)
}

/// Output of a port or signal.
fn add_row(model: &LumpedModel, row: usize, pins: &Pins, text: &mut String) {
    let (reading, scale) = (&model.rows[row], model.scales[row]);
    let left = match row.checked_sub(model.ports.len()) {
        Some(k) => format!("V({})", pins.signals[k]),
        None if matches!(reading, LumpedOutput::Current(..)) => format!("I(b{})", row + 1),
        None => format!("V(b{})", row + 1),
    };
    let mut sum = ContributionSum::begin(&format!("{left} <+ 0"));
    match reading {
        LumpedOutput::Nothing => return,
        LumpedOutput::Current(conductance, constant) => {
            add(&mut sum, "b", conductance, 1.0);
            sum.add(*constant, "1");
            for (g, gap) in model.gaps.iter().enumerate() {
                if let (Law::Field(capacitor, _), true) = (&gap.law, gap.by_port[row] != 0.0) {
                    let c = capacitance(capacitor, &format!("V(g{})", g + 1));
                    sum.term(&format!("ddt({:e} * {c} * V(e{}))", gap.by_port[row], g + 1));
                }
            }
        }
        LumpedOutput::Place(shares) => add(&mut sum, "x", shares, 1e-6 * scale),
        LumpedOutput::Rate(shares) => {
            for (j, (share, c)) in shares.iter().zip(&model.coordinates).enumerate() {
                sum.add(1e-6 * scale * share * c.omega, &format!("V(v{})", j + 1));
            }
        }
        LumpedOutput::Charge(g) | LumpedOutput::Capacitance(g) | LumpedOutput::Pull(g) => {
            if let Law::Field(capacitor, _) = &model.gaps[*g].law {
                let (u, e) = (format!("V(g{})", g + 1), format!("V(e{})", g + 1));
                let value = match reading {
                    LumpedOutput::Pull(_) => format!("0.5 * {e} * {e} * {}", slope(capacitor, &u)),
                    LumpedOutput::Charge(_) => format!("{} * {e}", capacitance(capacitor, &u)),
                    _ => capacitance(capacitor, &u),
                };
                sum.add(scale, &value);
            }
        }
        LumpedOutput::Distance(g, rest, sign) => {
            sum.add(1e-6 * sign * scale, &format!("V(g{})", g + 1));
            sum.add(rest * scale, "1");
        }
        LumpedOutput::Way(g) | LumpedOutput::Bearing(g) | LumpedOutput::Conductance(g, _) => {
            let u = format!("V(g{})", g + 1);
            let value = contact_reading(reading, &model.gaps[*g].law, &u, |radius| {
                let _ = writeln!(text, "    {} = {radius};", radius_name(row));
                radius_name(row)
            });
            sum.add(scale, &value);
        }
        LumpedOutput::Constant(value) => sum.add(value * scale, "1"),
    }
    sum.end(text);
}

/// Noise of dampers, of the gas and the losses of contacts in each gap, and of resistors between ports.
fn noise(model: &LumpedModel) -> NoiseText {
    let (mut noise, warm) = (NoiseText::default(), warm(model.temperature));
    let target = |(j, c): (usize, &Coordinate)| (format!("I(v{})", j + 1), c.mass * c.omega * c.omega * 1e-6);
    let parts: Vec<_> = model.coordinates.iter().enumerate().map(target).collect();
    noise.matrix(&model.damping, &parts, &format!("{warm:e}"), "dampers");
    for (g, gap) in model.gaps.iter().enumerate().filter(|(_, gap)| loses(gap)) {
        let u = format!("V(g{})", g + 1);
        let lost = (gap.loss > 0.0).then(|| format!("{:e} * {}", gap.loss, pressing(&gap.law, &u)));
        let shares = gap.along.iter().zip(&parts).filter(|(share, _)| **share != 0.0);
        let shares: Vec<_> =
            shares.map(|(share, (target, unit))| (target.clone(), format!("({:e})", share / unit))).collect();
        for (drag, name) in [(drag(gap.film, &u, "1"), "gas"), (lost, "contact")] {
            drag.into_iter().for_each(|drag| noise.source(&shares, &format!("{warm:e} * {drag}"), name));
        }
    }
    let conducts = |row: &LumpedOutput| matches!(row, LumpedOutput::Current(..));
    let electrical: Vec<usize> = (0..model.ports.len()).filter(|&k| conducts(&model.rows[k])).collect();
    let conductance = DMatrix::from_fn(electrical.len(), electrical.len(), |i, k| match &model.rows[electrical[i]] {
        LumpedOutput::Current(row, _) => row[electrical[k]],
        _ => 0.0,
    });
    let branches: Vec<_> = electrical.iter().map(|k| (format!("I(b{})", k + 1), 1.0)).collect();
    noise.matrix(&conductance, &branches, &format!("{warm:e}"), "resistors");
    noise
}

/// Adds `scale` times the shares of nodes or branches `name1` ….
fn add(sum: &mut ContributionSum, name: &str, shares: &DVector<f64>, scale: f64) {
    for (j, share) in shares.iter().enumerate() {
        sum.add(scale * share, &format!("V({name}{})", j + 1));
    }
}
