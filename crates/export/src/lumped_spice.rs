//! The nonlinear lumped model as a subcircuit: B-sources for the gap functions, all else linear, as ngspice reads it.
//!
//! | node | what it is |
//! |---|---|
//! | `x1` … | way of a part in micrometres |
//! | `v1` … | its rate, in micrometres times ω per second: a capacitor of 1/ω farads that forces charge |
//! | `g1` … | approach of a gap in micrometres |
//! | `e1` … | voltage of a gap |
//! | `s1` … | rate of a gap in metres per second, where its contact loses energy |
//! | `f1` … | its force in micronewtons |
//! | `a1` … | radius of a contact whose conductance is shown, in micrometres |
//! | `q1` … | its charge in femtocoulombs, through a capacitor of a femtofarad: that current is dQ/dt |

use super::laws::{bearing, capacitance, contact_reading, drag, loses, slope};
use super::lumped::{Law, LumpedModel, LumpedOutput};
use super::names::Pins;
use super::parts::SubcircuitText;
use bimorph_device::PortKind;
use nalgebra::DVector;
use std::fmt::Write;

/// The file: a descriptive header, and the subcircuit `name`.
pub fn write(model: &LumpedModel, pins: &Pins, name: &str, about: &[String]) -> String {
    let mut text = String::new();
    for line in about {
        let _ = writeln!(text, "* {line}");
    }
    let _ = writeln!(text, ".subckt {name} {}", pins.all().collect::<Vec<_>>().join(" "));
    let mut deck = LumpedSubcircuit { model, pins, parts: SubcircuitText::after(text) };
    deck.ports();
    deck.coordinates();
    for g in 0..model.gaps.len() {
        deck.gap(g);
    }
    for row in 0..model.rows.len() {
        deck.row(row);
    }
    let mut text = deck.parts.text;
    let _ = writeln!(text, ".ends {name}");
    text
}

struct LumpedSubcircuit<'a> {
    model: &'a LumpedModel,
    pins: &'a Pins,
    parts: SubcircuitText,
}

impl LumpedSubcircuit<'_> {
    /// Forces of part `j` are in units of this (N).
    fn unit(&self, j: usize) -> f64 {
        let c = &self.model.coordinates[j];
        c.mass * c.omega * c.omega * 1e-6
    }

    fn ports(&mut self) {
        for (k, port) in self.model.ports.iter().enumerate() {
            let ([plus, minus], q) = (&self.pins.ports[k], k + 1);
            if port.kind == PortKind::Electrical {
                continue;
            }
            self.parts.line(&format!("* port {}: {}", port.name, port.meaning()));
            if port.kind.given_flow() {
                self.parts.line(&format!("Vf{q} {plus} a{q} 0"));
                self.parts.line(&format!("Ef{q} a{q} {minus} y{q} 0 1"));
            }
        }
    }

    fn coordinates(&mut self) {
        let model = self.model;
        for (j, c) in model.coordinates.iter().enumerate() {
            let (k, x, v, unit) = (j + 1, format!("x{}", j + 1), format!("v{}", j + 1), self.unit(j));
            let rate = 1e-6 * c.omega;
            self.parts.line(&format!(
                "* part {} along ({:e}, {:e}): 1 V of {v} is {rate:e} m/s",
                c.name, c.direction.x, c.direction.y
            ));
            self.parts.line(&format!("Cx{k} {x} 0 {:e}", 1.0 / c.omega));
            self.parts.line(&format!("Cv{k} {v} 0 {:e}", 1.0 / c.omega));
            self.parts.by_voltage(("0", &x), &v, 1.0);
            for (i, other) in model.coordinates.iter().enumerate() {
                self.parts.by_voltage(("0", &v), &format!("x{}", i + 1), -1e-6 * model.stiffness[(j, i)] / unit);
                let drag = -1e-6 * other.omega * model.damping[(j, i)] / unit;
                self.parts.by_voltage(("0", &v), &format!("v{}", i + 1), drag);
            }
            self.parts.constant(("0", &v), model.load[j] / unit);
            for (q, port) in model.ports.iter().enumerate() {
                let gain = model.push[(j, q)] * model.given[q] / unit;
                if port.kind.given_flow() {
                    self.parts.by_current(("0", &v), &format!("Vf{}", q + 1), gain);
                } else {
                    let [plus, minus] = &self.pins.ports[q];
                    self.parts.between(("0", &v), (plus, minus), gain);
                }
            }
        }
    }

    fn gap(&mut self, g: usize) {
        let gap = &self.model.gaps[g];
        let (n, u, e) = (g + 1, format!("g{}", g + 1), format!("e{}", g + 1));
        self.parts.line(&format!("* gap {}", gap.name));
        self.parts.sum(&u);
        self.sum(("0", &u), "x", &gap.along, 1.0);
        let approach = format!("V({u})");
        let mut force = Vec::new();
        if let Law::Field(capacitor, _) = &gap.law {
            self.parts.sum(&e);
            for (q, share) in gap.by_port.iter().enumerate() {
                let [plus, minus] = &self.pins.ports[q];
                self.parts.between(("0", &e), (plus, minus), *share);
            }
            self.parts.constant(("0", &e), gap.constant);
            force.push(format!("0.5 * V({e}) * V({e}) * {}", slope(capacitor, &approach)));
            self.parts.line(&format!("Bq{n} q{n} 0 V=1e15 * {} * V({e})", capacitance(capacitor, &approach)));
            self.parts.line(&format!("Vq{n} q{n} r{n} 0"));
            self.parts.line(&format!("Cq{n} r{n} 0 1e-15"));
        }
        let rate = format!("s{n}");
        if loses(gap) {
            self.parts.sum(&rate);
            for (j, c) in self.model.coordinates.iter().enumerate() {
                self.parts.by_voltage(("0", &rate), &format!("v{}", j + 1), 1e-6 * c.omega * gap.along[j]);
            }
        }
        let bearing = bearing(&gap.law, gap.loss, &approach, &format!("V({rate})"));
        let drag = drag(gap.film, &approach, &format!("V({rate})"));
        force.extend(bearing.into_iter().chain(drag).map(|resisting| format!("- {resisting}")));
        if force.is_empty() {
            return;
        }
        self.parts.line(&format!("Bf{n} f{n} 0 V=1e6 * ({})", force.join(" ")));
        for j in 0..self.model.coordinates.len() {
            let unit = self.unit(j);
            self.parts.by_voltage(("0", &format!("v{}", j + 1)), &format!("f{n}"), 1e-6 * gap.along[j] / unit);
        }
    }

    /// Currents of `scale` times the shares of nodes `name1` ….
    fn sum(&mut self, places: (&str, &str), name: &str, shares: &DVector<f64>, scale: f64) {
        for (j, share) in shares.iter().enumerate() {
            self.parts.by_voltage(places, &format!("{name}{}", j + 1), scale * share);
        }
    }

    fn row(&mut self, row: usize) {
        let model = self.model;
        let (ports, scale, n) = (model.ports.len(), model.scales[row], row + 1);
        if let LumpedOutput::Current(conductance, constant) = &model.rows[row] {
            let [plus, minus] = &self.pins.ports[row];
            self.parts.line(&format!("* current into port {}", model.ports[row].name));
            for (q, share) in conductance.iter().enumerate() {
                let [other, back] = &self.pins.ports[q];
                self.parts.between((plus, minus), (other, back), *share);
            }
            self.parts.constant((plus, minus), *constant);
            for (g, gap) in model.gaps.iter().enumerate() {
                self.parts.by_current((plus, minus), &format!("Vq{}", g + 1), gap.by_port[row]);
            }
            return;
        }
        let sum = format!("y{n}");
        let places = ("0", sum.as_str());
        match &model.rows[row] {
            LumpedOutput::Current(..) | LumpedOutput::Nothing => return,
            LumpedOutput::Place(shares) => self.sum(places, "x", shares, 1e-6 * scale),
            LumpedOutput::Rate(shares) => {
                let rates = shares.zip_map(
                    &DVector::from_iterator(shares.len(), model.coordinates.iter().map(|c| c.omega)),
                    |s, w| s * w,
                );
                self.sum(places, "v", &rates, 1e-6 * scale);
            }
            LumpedOutput::Charge(g) => self.parts.by_voltage(places, &format!("q{}", g + 1), 1e-15 * scale),
            LumpedOutput::Capacitance(g) | LumpedOutput::Pull(g) => {
                if let Law::Field(capacitor, _) = &model.gaps[*g].law {
                    let (u, e) = (format!("V(g{})", g + 1), format!("V(e{})", g + 1));
                    let value = match model.rows[row] {
                        LumpedOutput::Pull(_) => format!("0.5 * {e} * {e} * {}", slope(capacitor, &u)),
                        _ => capacitance(capacitor, &u),
                    };
                    self.parts.line(&format!("By{n} 0 {sum} I={scale:e} * {value}"));
                }
            }
            LumpedOutput::Distance(g, rest, sign) => {
                self.parts.by_voltage(places, &format!("g{}", g + 1), 1e-6 * sign * scale);
                self.parts.constant(places, rest * scale);
            }
            reading @ (LumpedOutput::Way(g) | LumpedOutput::Bearing(g) | LumpedOutput::Conductance(g, _)) => {
                let value = contact_reading(reading, &model.gaps[*g].law, &format!("V(g{})", g + 1), |radius| {
                    self.parts.line(&format!("Ba{n} a{n} 0 V={radius}"));
                    format!("V(a{n})")
                });
                self.parts.line(&format!("By{n} 0 {sum} I={scale:e} * {value}"));
            }
            LumpedOutput::Constant(value) => self.parts.constant(places, value * scale),
        }
        self.parts.sum(&sum);
        if let Some(k) = row.checked_sub(ports) {
            self.parts.line(&format!("Es{} {} 0 {sum} 0 1", k + 1, self.pins.signals[k]));
        }
    }
}
