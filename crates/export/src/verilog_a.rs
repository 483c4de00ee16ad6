//! The reduced linear model as a Verilog-A module.
//!
//! Every state is a node of the module, which the simulator sees and solves for: no variable keeps a value from one point to
//! the next, no event is watched and no step is bounded. `ddt` acts on voltages and branch currents alone. One contribution for
//! each node and each row of the model's equations ([`super::linear`]).

use super::compare::ModelFit;
use super::linear::{ReducedModel, ReducedPort};
use super::names::Pins;
use super::noise_sources::NoiseText;
use bimorph_device::PortKind;
use std::fmt::Write;

/// The file: a descriptive header, and the module `name`.
pub fn write(fitted: &ModelFit, pins: &Pins, name: &str, about: &[String]) -> String {
    let model = &fitted.model;
    let noise = noise(fitted, pins);
    let inner: Vec<String> = (1..=model.modes.len())
        .flat_map(|k| [format!("x{k}"), format!("w{k}")])
        .chain((1..=model.lags.len()).map(|l| format!("h{l}")))
        .chain(noise.nodes)
        .collect();
    let mut text = head(name, pins, &inner, &[], &model.ports, about);
    for (l, lag) in model.lags.iter().enumerate() {
        let h = format!("h{}", l + 1);
        let _ = writeln!(text, "    I({h}) <+ ddt({:e} * V({h})) + V({h}) - {};", lag.tau, input(model, lag.port));
    }
    for j in 0..model.modes.len() {
        let omega = model.modes[j].omega;
        let (x, w) = (format!("x{}", j + 1), format!("w{}", j + 1));
        let _ = writeln!(text, "    I({x}) <+ ddt({:e} * V({x})) - V({w});", 1.0 / omega);
        let mut sum = ContributionSum::begin(&format!("I({w}) <+ ddt({:e} * V({w})) + V({x})", 1.0 / omega));
        for k in 0..model.modes.len() {
            sum.add(model.damping[(j, k)] / omega, &format!("V(w{})", k + 1));
        }
        for q in 0..model.ports.len() {
            sum.add(-model.push[(j, q)], &input(model, q));
        }
        for l in 0..model.lags.len() {
            sum.add(-model.push_lagged[(j, l)], &format!("V(h{})", l + 1));
        }
        sum.end(&mut text);
    }
    for row in 0..model.rows() {
        let Some(left) = output(model, row, pins) else { continue };
        let mut sum = ContributionSum::begin(&format!("{left} <+ {:e}", model.at_rest[row]));
        for j in 0..model.modes.len() {
            sum.add(model.place[(row, j)], &format!("V(x{})", j + 1));
            sum.add(model.rate[(row, j)], &format!("V(w{})", j + 1));
        }
        for l in 0..model.lags.len() {
            sum.add(model.lagged[(row, l)], &format!("V(h{})", l + 1));
        }
        for q in 0..model.ports.len() {
            sum.add(model.direct[(row, q)], &input(model, q));
            if model.change[(row, q)] != 0.0 {
                let of = if model.ports[q].kind.given_flow() { "I" } else { "V" };
                sum.term(&format!("ddt({:e} * {of}(b{}))", model.change[(row, q)], q + 1));
            }
        }
        sum.end(&mut text);
    }
    text.push_str(&noise.text);
    text.push_str("  end\nendmodule\n");
    text
}

/// Branch or node of a row; none where the port answers nothing.
fn output(model: &ReducedModel, row: usize, pins: &Pins) -> Option<String> {
    match (model.ports.get(row), row.checked_sub(model.ports.len())) {
        (Some(port), _) if port.kind.answered().1.is_empty() => None,
        (Some(port), _) if port.kind == PortKind::Electrical => Some(format!("I(b{})", row + 1)),
        (_, Some(k)) => Some(format!("V({})", pins.signals[k])),
        _ => Some(format!("V(b{})", row + 1)),
    }
}

/// Noise of drag on the directions, and of what all others yield to it in each row; and of resistances between ports.
fn noise(fitted: &ModelFit, pins: &Pins) -> NoiseText {
    let (model, noise, mut text) = (&fitted.model, &fitted.noise, NoiseText::default());
    let directions = (1..=model.modes.len()).map(|k| (format!("I(w{k})"), false));
    let rows = (0..model.rows()).map(|row| (output(model, row, pins).unwrap_or_default(), noise.rates[row]));
    let targets: Vec<(String, bool)> = directions.chain(rows).collect();
    text.correlated((&noise.sizes, &noise.correlation), &targets, "dampers");
    let branches: Vec<(String, f64)> = (1..=model.ports.len()).map(|k| (format!("I(b{k})"), 1.0)).collect();
    text.matrix(&noise.currents, &branches, "1", "resistors");
    text
}

/// All text up to the first contribution: description, pins, inner nodes, branches and variables.
pub(super) fn head(
    name: &str,
    pins: &Pins,
    inner: &[String],
    reals: &[String],
    ports: &[ReducedPort],
    about: &[String],
) -> String {
    let mut text = String::new();
    for line in about {
        let _ = writeln!(text, "// {line}");
    }
    let all = pins.all().collect::<Vec<_>>().join(", ");
    let _ = writeln!(text, "`include \"disciplines.vams\"\n\nmodule {name}({all});");
    let _ = writeln!(text, "  inout {all};\n  electrical {all};");
    if !inner.is_empty() {
        let _ = writeln!(text, "  electrical {};", inner.join(", "));
    }
    for (k, port) in ports.iter().enumerate() {
        let [plus, minus] = &pins.ports[k];
        let _ = writeln!(text, "  branch ({plus}, {minus}) b{}; // {}: {}", k + 1, port.name, port.meaning());
    }
    if !reals.is_empty() {
        let _ = writeln!(text, "  real {};", reals.join(", "));
    }
    let _ = writeln!(text, "\n  analog begin");
    text
}

/// The deviation of an input from the operating point.
fn input(model: &ReducedModel, port: usize) -> String {
    let (branch, bias) = (format!("b{}", port + 1), model.ports[port].bias.unwrap_or(0.0));
    if model.ports[port].kind.given_flow() {
        format!("I({branch})")
    } else if bias == 0.0 {
        format!("V({branch})")
    } else {
        format!("(V({branch}) - {bias:e})")
    }
}

/// A contribution being written, a term a line.
pub(super) struct ContributionSum(String);

impl ContributionSum {
    pub(super) fn begin(start: &str) -> Self {
        Self(format!("    {start}"))
    }

    pub(super) fn add(&mut self, gain: f64, what: &str) {
        if gain != 0.0 {
            self.term(&format!("{gain:e} * {what}"));
        }
    }

    pub(super) fn term(&mut self, term: &str) {
        let sign = if term.starts_with('-') { "" } else { "+ " };
        let term = term.strip_prefix('-').map_or_else(|| term.to_owned(), |rest| format!("- {rest}"));
        let _ = write!(self.0, "\n      {sign}{term}");
    }

    pub(super) fn end(self, text: &mut String) {
        let _ = writeln!(text, "{};", self.0);
    }
}
