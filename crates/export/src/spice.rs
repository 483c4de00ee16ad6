//! The reduced linear model as a subcircuit of resistors, capacitors, inductors and linear controlled sources (R, L, C, E, F, G,
//! I, V), which every SPICE reads.
//!
//! | node | what it is |
//! |---|---|
//! | `x1` … | share of a mode: a capacitor of 1/ω farads that the rate charges |
//! | `w1` … | its rate over ω: a capacitor of 1/ω farads that spring, damping and ports charge |
//! | `h1` … | the lag of heat behind a port: τ farads against 1 S |
//! | `u1` … | the input of a port with a voltage, less its value at the operating point |
//! | `d1` … | its rate of change: behind a capacitor, and for a force or heat across an inductor |
//! | `y1` … | the voltage across a port with a flow as its input, and the signals: sums of currents into 1 S |
//!
//! Conductances that stand for no resistance of the part are controlled sources, which make no noise.

use super::compare::ModelFit;
use super::linear::ReducedModel;
use super::names::Pins;
use super::parts::SubcircuitText;
use bimorph_device::PortKind;
use std::fmt::Write;

/// Capacitor that shows the rate of change of a voltage (F), and inductor of a flow (H).
const CAPACITOR: f64 = 1e-9;
const INDUCTOR: f64 = 1.0;

/// The file: a descriptive header, and the subcircuit `name`. `about` holds the lines that say what was exported.
pub fn write(fitted: &ModelFit, pins: &Pins, name: &str, about: &[String]) -> String {
    let mut text = String::new();
    for line in about {
        let _ = writeln!(text, "* {line}");
    }
    let _ = writeln!(text, ".subckt {name} {}", pins.all().collect::<Vec<_>>().join(" "));
    let mut deck = LinearSubcircuit { model: &fitted.model, pins, parts: SubcircuitText::after(text) };
    deck.inputs();
    deck.lags();
    deck.modes();
    for row in 0..fitted.model.rows() {
        deck.row(row);
    }
    let mut text = deck.parts.text;
    let _ = writeln!(text, ".ends {name}");
    text
}

/// A subcircuit being written.
struct LinearSubcircuit<'a> {
    model: &'a ReducedModel,
    pins: &'a Pins,
    parts: SubcircuitText,
}

impl LinearSubcircuit<'_> {
    /// A current of `gain` times input `port`.
    fn by_input(&mut self, places: (&str, &str), port: usize, gain: f64) {
        if self.model.ports[port].kind.given_flow() {
            self.parts.by_current(places, &format!("Vf{}", port + 1), gain);
        } else {
            self.parts.by_voltage(places, &format!("u{}", port + 1), gain);
        }
    }

    /// A current of `gain` times the rate of change of input `port`.
    fn by_change(&mut self, places: (&str, &str), port: usize, gain: f64) {
        if self.model.ports[port].kind.given_flow() {
            self.parts.by_voltage(places, &format!("d{}", port + 1), gain / INDUCTOR);
        } else {
            self.parts.by_current(places, &format!("Vd{}", port + 1), gain / CAPACITOR);
        }
    }

    /// Whether the rate of change of input `port` is needed beside what lies at the port's own pins.
    fn changes(&self, port: usize) -> bool {
        let own = |row: usize| row == port && self.model.ports[port].kind == PortKind::Electrical;
        (0..self.model.rows()).any(|row| self.model.change[(row, port)] != 0.0 && !own(row))
    }

    fn inputs(&mut self) {
        for k in 0..self.model.ports.len() {
            let (port, [plus, minus], q) = (&self.model.ports[k], &self.pins.ports[k], k + 1);
            let bias = port.bias.unwrap_or(0.0);
            let changes = self.changes(k);
            self.parts.line(&format!("* port {}: {}", port.name, port.meaning()));
            if port.kind.given_flow() {
                self.parts.line(&format!("Vf{q} {plus} f{q} 0"));
                self.parts.line(&format!("Ef{q} f{q} {minus} y{q} 0 1"));
                if changes {
                    self.parts.line(&format!("Fd{q} 0 d{q} Vf{q} 1"));
                    self.parts.line(&format!("Ld{q} d{q} 0 {INDUCTOR:e}"));
                }
            } else {
                self.parts.line(&format!("Eu{q} e{q} 0 {plus} {minus} 1"));
                self.parts.line(&format!("Vu{q} e{q} u{q} {bias:e}"));
                if changes {
                    self.parts.line(&format!("Vd{q} u{q} d{q} 0"));
                    self.parts.line(&format!("Cd{q} d{q} 0 {CAPACITOR:e}"));
                }
            }
        }
    }

    fn lags(&mut self) {
        for l in 0..self.model.lags.len() {
            let lag = self.model.lags[l];
            let h = format!("h{}", l + 1);
            self.parts.line(&format!("* lag of heat behind port {}: {:e} s", self.model.ports[lag.port].name, lag.tau));
            self.parts.line(&format!("Ch{} {h} 0 {:e}", l + 1, lag.tau));
            self.parts.sum(&h);
            self.by_input(("0", &h), lag.port, 1.0);
        }
    }

    fn modes(&mut self) {
        for j in 0..self.model.modes.len() {
            let (mode, k) = (self.model.modes[j], j + 1);
            let (x, w) = (format!("x{k}"), format!("w{k}"));
            let quality = mode.omega / self.model.damping[(j, j)];
            let hertz = mode.omega / std::f64::consts::TAU;
            let title = mode.number.map_or_else(|| "static correction".to_owned(), |n| format!("mode {n}"));
            self.parts.line(&format!("* {title} at {hertz:.6e} Hz, Q {quality:.4e}"));
            self.parts.line(&format!("Cx{k} {x} 0 {:e}", 1.0 / mode.omega));
            self.parts.line(&format!("Cw{k} {w} 0 {:e}", 1.0 / mode.omega));
            self.parts.by_voltage(("0", &x), &w, 1.0);
            self.parts.by_voltage(("0", &w), &x, -1.0);
            for i in 0..self.model.modes.len() {
                self.parts.by_voltage(("0", &w), &format!("w{}", i + 1), -self.model.damping[(j, i)] / mode.omega);
            }
            for q in 0..self.model.ports.len() {
                self.by_input(("0", &w), q, self.model.push[(j, q)]);
            }
            for l in 0..self.model.lags.len() {
                self.parts.by_voltage(("0", &w), &format!("h{}", l + 1), self.model.push_lagged[(j, l)]);
            }
        }
    }

    /// Output of a port or signal.
    fn row(&mut self, row: usize) {
        let model = self.model;
        let port = model.ports.get(row);
        if port.is_some_and(|p| p.kind.answered().1.is_empty()) {
            return;
        }
        let electrical = port.is_some_and(|p| p.kind == PortKind::Electrical);
        let sum = format!("y{}", row + 1);
        let (from, to) = if electrical {
            (self.pins.ports[row][0].as_str(), self.pins.ports[row][1].as_str())
        } else {
            ("0", sum.as_str())
        };
        self.parts.line(&format!(
            "* {}",
            if electrical { "current into port " } else { "across " }.to_owned() + model.row_name(row)
        ));
        let mut constant = model.at_rest[row];
        if electrical {
            // what the port's own voltage drives, in plain parts that need no operating point
            let (own, bias) = (model.direct[(row, row)], model.ports[row].bias.unwrap_or(0.0));
            if own != 0.0 {
                self.parts.line(&format!("R{} {from} {to} {:e}", row + 1, 1.0 / own));
                constant -= own * bias;
                if constant.abs() < 1e-12 * (own * bias).abs() {
                    constant = 0.0;
                }
            }
            if model.change[(row, row)] != 0.0 {
                self.parts.line(&format!("C{} {from} {to} {:e}", row + 1, model.change[(row, row)]));
            }
        } else {
            self.parts.sum(&sum);
        }
        if constant != 0.0 {
            self.parts.constant((from, to), constant);
        }
        for j in 0..model.modes.len() {
            self.parts.by_voltage((from, to), &format!("x{}", j + 1), model.place[(row, j)]);
            self.parts.by_voltage((from, to), &format!("w{}", j + 1), model.rate[(row, j)]);
        }
        for l in 0..model.lags.len() {
            self.parts.by_voltage((from, to), &format!("h{}", l + 1), model.lagged[(row, l)]);
        }
        for q in (0..model.ports.len()).filter(|q| !electrical || *q != row) {
            self.by_input((from, to), q, model.direct[(row, q)]);
            self.by_change((from, to), q, model.change[(row, q)]);
        }
        if let Some(k) = row.checked_sub(model.ports.len()) {
            self.parts.line(&format!("Es{} {} 0 {sum} 0 1", k + 1, self.pins.signals[k]));
        }
    }
}
