//! The nonlinear model of flexible parts as a Verilog-A module, by the rules of [`super::verilog_a`]: every state is a node, variables are
//! assigned before they are read, and nothing but `ddt` acts in time.
//!
//! | name | what it is |
//! |---|---|
//! | node `x1` … | a coordinate; 1 V is its largest amplitude in training |
//! | node `v1` … | its rate over its angular frequency |
//! | node `h1` … | a lag of heat in kelvin |
//! | `q1`, `r1` … | coordinates and their rates in 1/s |
//! | `e1` … | strains of closures less their rest values; `e1_1`: derivative with `x1` |
//! | `y1` … | shapes of gaps in micrometres; `z1`: their rates |
//! | `w1_1` … | derivatives of the works of loads |
//! | `p1` … | displacements that are read |
//! | `u`, `s`, `f` | approach (µm), rate (m/s) and force (N) of one point of a gap |
//! | `f1` … | forces over the shapes (N) |
//! | `m1`, `a1` | force of a contact that is shown (N), and its radius (µm) |
//! | `y0`, and others with `c` before a letter | displacement of a comb across its fingers (µm), and its law (`comb_laws`) |
//! | `g1`, `c1`, `k1`, `d1` | voltage, capacitance, its slope and smallest distance of a gap |

use super::comb_laws;
use super::flexible::text::PolynomialText;
use super::flexible::{FlexibleModel, FlexibleOutput};
use super::laws::{bearing, capacitance, conductance, drag, nearer_way, pressing, radius, slope};
use super::names::Pins;
use super::noise_sources::{NoiseText, warm};
use super::verilog_a::{ContributionSum, head};
use bimorph_domains::comb_sides::CombLaw;
use bimorph_domains::{Law, PointLaw};
use bimorph_solve::reduced::polynomial::PolynomialModel;
use bimorph_solve::reduced::polynomial::monomials::Polynomials;
use nalgebra::DMatrix;
use std::fmt::Write;

/// Part of the largest share below which a shape has none in a point (1).
const NONE: f64 = 1e-9;
/// Largest angular frequency that scales a rate, over the least (1).
const FASTEST: f64 = 1e4;

/// The file: a descriptive header, and the module `name`.
pub fn write(model: &FlexibleModel, pins: &Pins, name: &str, about: &[String]) -> String {
    let of = &model.fitted.model;
    let noise = NoiseText::default();
    let mut module = FlexibleModule { model, of, body: String::new(), reals: Vec::new(), noise };
    module.coordinates();
    module.drag_gains();
    module.heat();
    module.closures();
    module.gaps();
    module.works();
    module.probes();
    module.motion();
    for row in 0..model.rows.len() {
        module.row(row, pins);
    }
    module.drag_noise();
    module.conducted_noise();
    let coordinates = (1..=module.of.size()).flat_map(|j| [format!("x{j}"), format!("v{j}")]);
    let lags = (0..model.heat.lags.len()).filter(|l| module.lags(*l)).map(|l| format!("h{}", l + 1));
    let FlexibleModule { body, reals, noise, .. } = &module;
    let inner: Vec<String> = coordinates.chain(lags).chain(noise.nodes.iter().cloned()).collect();
    let mut text = head(name, pins, &inner, reals, &model.ports, about);
    text.push_str(body);
    text.push_str(&noise.text);
    text.push_str("  end\nendmodule\n");
    text
}

struct FlexibleModule<'a> {
    model: &'a FlexibleModel,
    of: &'a PolynomialModel,
    body: String,
    reals: Vec<String>,
    noise: NoiseText,
}

impl FlexibleModule<'_> {
    /// A variable with its value.
    fn set(&mut self, name: &str, value: &str) {
        if !self.reals.iter().any(|known| known == name) {
            self.reals.push(name.to_owned());
        }
        let _ = writeln!(self.body, "    {name} = {value};");
    }

    /// Seconds per unit of a rate.
    fn second(&self, j: usize) -> f64 {
        let slowest = self.of.mass.iter().copied().fold(0.0, f64::max).sqrt();
        self.of.mass[j].sqrt().max(slowest / FASTEST)
    }

    fn lags(&self, l: usize) -> bool {
        self.model.heat.lags[l].tau > 0.0
    }

    /// Value of a lag (K).
    fn lag(&self, l: usize) -> String {
        if self.lags(l) { format!("V(h{})", l + 1) } else { format!("h{}", l + 1) }
    }

    fn coordinates(&mut self) {
        for j in 0..self.of.size() {
            self.set(&format!("q{}", j + 1), &format!("V(x{})", j + 1));
        }
        let moving = if self.moves() { self.of.size() } else { 0 };
        for j in 0..moving {
            self.set(&format!("r{}", j + 1), &format!("{:e} * V(v{})", 1.0 / self.second(j), j + 1));
        }
    }

    /// Whether rates are read by a law or an output.
    fn moves(&self) -> bool {
        let loses = |law: &PointLaw| law.film.is_some() || law.loss > 0.0;
        self.of.approaches.members.iter().flat_map(|points| &points.laws).any(loses)
            || self.model.rows.iter().any(|row| matches!(row, FlexibleOutput::ProbeRate(_)))
    }

    fn heat(&mut self) {
        let model = self.model;
        for (l, lag) in model.heat.lags.iter().enumerate() {
            let h = format!("h{}", l + 1);
            if lag.tau > 0.0 {
                let _ = writeln!(self.body, "    I({h}) <+ ddt({:e} * V({h})) + V({h}) - {};", lag.tau, lag.steady);
            } else {
                self.set(&h, &lag.steady);
            }
        }
    }

    /// Value and derivatives of a polynomial.
    fn polynomial(&mut self, name: &str, of: &Polynomials, row: usize, scale: f64, value: bool) {
        let text = PolynomialText::new(of, row, scale, &self.of.reach);
        if value {
            self.set(name, &text.text());
        }
        for j in 0..self.of.size() {
            self.set(&format!("{name}_{}", j + 1), &text.derivative(j).text());
        }
    }

    fn closures(&mut self) {
        let of = self.of;
        let closures = &of.closures;
        let by_lag = self.by_lag(&closures.thermal);
        for c in 0..closures.strains.coefficients.nrows() {
            let name = format!("e{}", c + 1);
            self.polynomial(&name, &closures.strains, c, 1.0, true);
            let mut rest = name.clone();
            for l in 0..self.model.heat.lags.len() {
                if by_lag[(c, l)] != 0.0 {
                    let _ = write!(rest, " - ({:e}) * {}", by_lag[(c, l)], self.lag(l));
                }
            }
            if closures.built_in[c] != 0.0 {
                let _ = write!(rest, " - ({:e})", closures.built_in[c]);
            }
            if rest != name {
                self.set(&name, &rest);
            }
        }
    }

    /// Effect of each lag per kelvin, of effects per unit of the free strain of each heater.
    fn by_lag(&self, thermal: &nalgebra::DMatrix<f64>) -> nalgebra::DMatrix<f64> {
        let heat = &self.model.heat;
        let mut strains = heat.shares.clone();
        strains.row_iter_mut().zip(&self.model.expansion).for_each(|(mut row, alpha)| row *= *alpha);
        thermal * strains
    }

    fn gaps(&mut self) {
        let of = self.of;
        let approaches = &of.approaches;
        let shapes = approaches.shapes.coefficients.nrows();
        for l in 0..shapes {
            self.polynomial(&format!("y{}", l + 1), &approaches.shapes, l, 1e6, true);
        }
        let loses = |law: &PointLaw| law.film.is_some() || law.loss > 0.0;
        if approaches.members.iter().flat_map(|points| &points.laws).any(loses) {
            for l in 0..shapes {
                let terms: Vec<String> = (1..=self.of.size()).map(|j| format!("y{0}_{j} * r{j}", l + 1)).collect();
                self.set(&format!("z{}", l + 1), &terms.join(" + "));
            }
        }
        for l in 0..shapes {
            self.set(&format!("f{}", l + 1), "0");
        }
        for m in 0..approaches.members.len() {
            self.gap(m);
        }
    }

    /// The points of one member.
    fn gap(&mut self, m: usize) {
        let of = self.of;
        let (points, n) = (&of.approaches.members[m], m + 1);
        let _ = writeln!(self.body, "    // {}", self.model.names[m]);
        if self.is_charged(m) {
            let volts = self.model.volts[m].clone().unwrap_or_else(|| "0".to_owned());
            self.set(&format!("g{n}"), &volts);
            self.set(&format!("c{n}"), "0");
            self.set(&format!("k{n}"), "0");
        }
        let shows = self.model.rows.contains(&FlexibleOutput::Distance(m));
        let bearing_shown = |row: &FlexibleOutput| matches!(row, FlexibleOutput::Bearing(of) | FlexibleOutput::Conductance(of, _) if *of == m);
        let weighs = self.model.rows.iter().any(bearing_shown);
        if weighs {
            self.set(&format!("m{n}"), "0");
        }
        let touching = |law: &PointLaw| matches!(law.law, Some(Law::Field(_, Some(_))));
        let bears = points.laws.iter().any(touching);
        let mut first = true;
        for (k, law) in points.laws.iter().enumerate() {
            let shares = self.shares(points.first + k);
            if law.law == Some(Law::Across) {
                continue;
            }
            self.set("u", &sum_of_shapes(&shares, "y"));
            if let Some(comb) = law.comb() {
                self.comb((n, k), (comb, law.loss), [&shares, &self.shares(points.first + k + 1)], [shows, weighs]);
                continue;
            }
            if law.film.is_some() || law.loss > 0.0 {
                self.set("s", &format!("1e-6 * ({})", sum_of_shapes(&shares, "z")));
            }
            let mut force: Vec<String> = Vec::new();
            if let Some(Law::Field(capacitor, _)) = &law.law
                && capacitor.acts()
            {
                self.set(&format!("c{n}"), &format!("c{n} + {}", capacitance(capacitor, "u")));
                self.set("s0", &slope(capacitor, "u"));
                self.set(&format!("k{n}"), &format!("k{n} + s0"));
                force.push(format!("- 0.5 * g{n} * g{n} * s0"));
            }
            let way = match &law.law {
                Some(Law::Field(capacitor, _)) if !bears || touching(law) => {
                    let (sign, drawn) = capacitor.way();
                    Some(format!("{drawn:e} {sign} 1e-6 * u"))
                }
                Some(Law::Stop(ways, ..)) => Some(nearer_way(ways, "u")),
                _ => None,
            };
            if let Some(way) = way.filter(|_| shows) {
                self.set(&format!("d{n}"), &if first { way } else { format!("min(d{n}, {way})") });
                first = false;
            }
            if let Some(law) = law.law.as_ref().filter(|_| weighs) {
                self.set(&format!("m{n}"), &format!("m{n} + {}", pressing(law, "u")));
            }
            force.extend(
                law.law.iter().filter_map(|of| bearing(of, law.loss, "u", "s")).map(|text| format!("+ {text}")),
            );
            force.extend(drag(law.film, "u", "s").map(|text| format!("+ {text}")));
            let lost = law.law.as_ref().filter(|_| law.loss > 0.0);
            let lost = lost.map(|of| format!("{:e} * {}", law.loss, pressing(of, "u")));
            for (drag, name) in [(drag(law.film, "u", "1"), "gas"), (lost, "contact")] {
                drag.into_iter().for_each(|drag| self.point_noise(&shares, &drag, name));
            }
            if !force.is_empty() {
                self.set("f", &force.join(" "));
                self.press(&shares);
            }
        }
    }

    /// A comb, point `k` of member `n`, with its shares along and across; `u` is set. Whether its overlap and its contact force are shown.
    fn comb(
        &mut self,
        (n, k): (usize, usize),
        (law, loss): (&CombLaw, f64),
        [along, across]: [&[(usize, f64)]; 2],
        [shows, weighs]: [bool; 2],
    ) {
        self.set("y0", &sum_of_shapes(across, "y"));
        self.set("s", &if loss > 0.0 { format!("1e-6 * ({})", sum_of_shapes(across, "z")) } else { "0".to_owned() });
        let bearing = comb_laws::bearing(law, loss, "s");
        for (name, text) in comb_laws::field(law, ["u", "y0"]).into_iter().chain(bearing) {
            self.set(name, &text);
        }
        self.set(&format!("c{n}"), &format!("c{n} + cc"));
        self.set(&format!("k{n}"), &format!("k{n} + cu"));
        if shows {
            self.set(&format!("d{n}"), &if k == 0 { "co".to_owned() } else { format!("min(d{n}, co)") });
        }
        if weighs {
            self.set(&format!("m{n}"), &format!("m{n} + {}", comb_laws::pressing(law)));
        }
        if loss > 0.0 {
            self.point_noise(across, &format!("{loss:e} * {}", comb_laws::pressing(law)), "contact");
        }
        for (shares, [slope, pressed]) in [(along, ["cu", "cw"]), (across, ["cv", "cy"])] {
            self.set("f", &format!("{pressed} - 0.5 * g{n} * g{n} * {slope}"));
            self.press(shares);
        }
    }

    /// Adds the force `f` of a point with these shares to those of the shapes.
    fn press(&mut self, shares: &[(usize, f64)]) {
        for (l, share) in shares {
            self.set(&format!("f{}", l + 1), &format!("f{} + ({share:e}) * f", l + 1));
        }
    }

    /// Noise of a damping at a point with these shares, the expression `drag` (N·s/m), while the variable `u` is that of the point.
    fn point_noise(&mut self, shares: &[(usize, f64)], drag: &str, name: &str) {
        let unit = 1e-6 / self.of.energy_unit();
        let gain = |j: usize| -> String {
            let terms: Vec<String> = shares.iter().map(|(l, share)| format!("{share:e} * y{}_{j}", l + 1)).collect();
            format!("({unit:e} * ({}))", terms.join(" + "))
        };
        let targets: Vec<_> = (1..=self.of.size()).map(|j| (format!("I(v{j})"), gain(j))).collect();
        let power = format!("{:e} * {drag}", warm(self.model.johnson.temperature));
        self.noise.source(&targets, &power, name);
        // while `u` is that of the point
        let written = std::mem::take(&mut self.noise.text);
        self.body.push_str(&written);
    }

    /// Shapes with their share in the approach of a point.
    fn shares(&self, point: usize) -> Vec<(usize, f64)> {
        let row = self.of.approaches.mix.row(point);
        let largest = row.amax();
        (0..row.len()).map(|l| (l, row[l])).filter(|(_, share)| share.abs() > NONE * largest).collect()
    }

    /// Loads that act: their place among the works, and their size.
    fn loads(&self) -> Vec<(usize, String)> {
        let inputs = self.model.inputs.iter().enumerate().filter_map(|(k, text)| Some((k + 1, text.clone()?)));
        let acts = |of: &(usize, String)| self.of.work.coefficients.row(of.0).amax() > 0.0;
        std::iter::once((0, "1".to_owned())).chain(inputs).filter(acts).collect()
    }

    fn works(&mut self) {
        let of = self.of;
        for (k, _) in self.loads() {
            self.polynomial(&format!("w{}", k + 1), &of.work, k, 1.0, false);
        }
    }

    fn probes(&mut self) {
        let of = self.of;
        for p in 0..of.probes.coefficients.nrows() {
            self.polynomial(&format!("p{}", p + 1), &of.probes, p, 1.0, true);
        }
    }

    /// The equations of the coordinates.
    fn motion(&mut self) {
        let (of, m, follows) = (self.of, self.of.size(), &self.model.fitted.follows);
        let thermal = self.by_lag(&of.thermal);
        let unit = 1.0 / of.energy_unit();
        let (loads, strains) = (self.loads(), of.closures.strains.coefficients.nrows());
        for j in 0..m {
            let (n, second) = (j + 1, self.second(j));
            // one that follows its forces at once has a rate that jumps with theirs, where simulators take ever shorter steps
            let rate = match follows[j] && !self.moves() {
                true => String::new(),
                false => format!("ddt({second:e} * V(x{n})) "),
            };
            ContributionSum::begin(&format!("I(x{n}) <+ {rate}- V(v{n})")).end(&mut self.body);
            let inertia = match follows[j] {
                true => "0".to_owned(),
                false => format!("ddt({} * V(v{n}))", self.mass(j)),
            };
            let mut sum = ContributionSum::begin(&format!("I(v{n}) <+ {inertia}"));
            for k in 0..m {
                if !follows[j] && !follows[k] {
                    let damping = significant(of.damping[(j, k)], of.damping.amax());
                    let gains = [j, k].map(|of| self.drag_gain(of).map_or(String::new(), |gain| format!("{gain} * ")));
                    sum.add(damping / self.second(k), &format!("{}V(v{})", gains.concat(), k + 1));
                }
                sum.add(significant(of.stiffness[(j, k)], of.stiffness.amax()), &format!("q{}", k + 1));
            }
            // what the masses of others do with this coordinate
            for i in 0..m {
                let rate = self.second(i);
                sum.add(-0.5 * of.mass_slopes[(i, j)] / (rate * rate), &format!("V(v{0}) * V(v{0})", i + 1));
            }
            sum.add(-of.built_in[j], "1");
            for l in 0..self.model.heat.lags.len() {
                sum.add(-thermal[(j, l)], &self.lag(l));
            }
            for c in 1..=strains {
                sum.term(&format!("e{c} * e{c}_{n}"));
            }
            for l in 1..=of.approaches.shapes.coefficients.nrows() {
                sum.term(&format!("{:e} * f{l} * y{l}_{n}", 1e-6 * unit));
            }
            for (k, size) in &loads {
                sum.term(&format!("-{unit:e} * {size} * w{}_{n}", k + 1));
            }
            sum.end(&mut self.body);
        }
    }

    /// The variable by which the damping of a coordinate varies; none where it does not.
    fn drag_gain(&self, j: usize) -> Option<String> {
        let varies = !self.model.fitted.follows[j] && self.of.damping_slopes.row(j).amax() > 0.0;
        varies.then(|| format!("drag{}", j + 1))
    }

    fn drag_gains(&mut self) {
        let slopes = &self.of.damping_slopes;
        for j in 0..self.of.size() {
            let Some(name) = self.drag_gain(j) else { continue };
            let terms: Vec<String> = (slopes.row(j).iter().enumerate())
                .filter(|(_, slope)| **slope != 0.0)
                .map(|(l, slope)| format!(" + ({slope:e}) * q{}", l + 1))
                .collect();
            self.set(&name, &format!("1{}", terms.concat()));
        }
    }

    /// Mass of a coordinate over the seconds of its rate.
    fn mass(&self, j: usize) -> String {
        let (of, second) = (self.of, self.second(j));
        let slopes = of.mass_slopes.row(j);
        let terms: Vec<String> = (slopes.iter().enumerate())
            .filter(|(_, slope)| **slope != 0.0)
            .map(|(l, slope)| format!(" + ({:e}) * q{}", slope / second, l + 1))
            .collect();
        let rest = format!("{:e}", of.mass[j] / second);
        if terms.is_empty() { rest } else { format!("({rest}{})", terms.concat()) }
    }

    /// Noise of the damping, on coordinates that have inertia.
    fn drag_noise(&mut self) {
        let of = self.of;
        let moving: Vec<usize> = (0..of.size()).filter(|&j| !self.model.fitted.follows[j]).collect();
        let largest = of.damping.amax();
        let entry = |i: usize, k: usize| significant(of.damping[(moving[i], moving[k])], largest);
        let damping = DMatrix::from_fn(moving.len(), moving.len(), entry);
        let targets: Vec<_> = moving.iter().map(|j| (format!("I(v{})", j + 1), 1.0)).collect();
        let gains: Vec<_> = moving.iter().map(|&j| self.drag_gain(j)).collect();
        let power = format!("{:e}", warm(self.model.johnson.temperature) / of.energy_unit());
        self.noise.matrix_with_gains(&damping, (&targets, &gains), &power, "dampers");
    }

    /// Noise of resistances between ports at their own temperatures.
    fn conducted_noise(&mut self) {
        let johnson = &self.model.johnson;
        let targets: Vec<_> = johnson.ports.iter().map(|k| (format!("I(b{})", k + 1), 1.0)).collect();
        let power = format!("{:e}", warm(johnson.temperature));
        self.noise.matrix(&johnson.conductance, &targets, &power, "resistors");
        for (l, heated) in johnson.heated.iter().enumerate() {
            let power = format!("{:e} * max({}, 0)", warm(1.0), self.lag(l));
            self.noise.matrix(heated, &targets, &power, "heat");
        }
    }

    fn row(&mut self, row: usize, pins: &Pins) {
        let model = self.model;
        let scale = model.scales[row];
        let output = &model.rows[row];
        let left = match row.checked_sub(model.ports.len()) {
            Some(k) => format!("V({})", pins.signals[k]),
            None if matches!(output, FlexibleOutput::Current(..)) => format!("I(b{})", row + 1),
            None => format!("V(b{})", row + 1),
        };
        let mut sum = ContributionSum::begin(&format!("{left} <+ 0"));
        match output {
            FlexibleOutput::Nothing => return,
            FlexibleOutput::Current(conducted, shares) => {
                conducted.iter().for_each(|text| sum.term(text));
                for (m, share) in shares.iter().enumerate().filter(|(m, share)| **share != 0.0 && self.is_charged(*m)) {
                    sum.term(&format!("ddt({share:e} * c{0} * g{0})", m + 1));
                }
            }
            FlexibleOutput::Probe(p) => sum.add(scale, &format!("p{}", p + 1)),
            FlexibleOutput::ProbeRate(p) => {
                (1..=self.of.size()).for_each(|j| sum.add(scale, &format!("p{}_{j} * r{j}", p + 1)));
            }
            FlexibleOutput::Temperature(ambient, heater) => {
                sum.add(scale * ambient, "1");
                for l in 0..model.heat.lags.len() {
                    sum.add(scale * model.heat.shares[(*heater, l)], &self.lag(l));
                }
            }
            FlexibleOutput::Charge(m) if self.is_charged(*m) => sum.add(scale, &format!("c{0} * g{0}", m + 1)),
            FlexibleOutput::Capacitance(m) if self.is_charged(*m) => sum.add(scale, &format!("c{}", m + 1)),
            FlexibleOutput::Pull(m) if self.is_charged(*m) => {
                sum.add(0.5 * scale, &format!("g{0} * g{0} * k{0}", m + 1));
            }
            FlexibleOutput::Charge(_) | FlexibleOutput::Capacitance(_) | FlexibleOutput::Pull(_) => {}
            FlexibleOutput::Distance(m) => sum.add(scale, &format!("d{}", m + 1)),
            FlexibleOutput::Bearing(m) => sum.add(scale, &format!("m{}", m + 1)),
            FlexibleOutput::Conductance(m, metals) => {
                let a = format!("a{}", m + 1);
                self.set(&a, &radius(metals, &format!("m{}", m + 1)));
                sum.add(scale, &conductance(metals, &a));
            }
            FlexibleOutput::Constant(value) => sum.add(scale * value, "1"),
        }
        sum.end(&mut self.body);
    }

    /// Whether a member has a field.
    fn is_charged(&self, m: usize) -> bool {
        let field = |law: &PointLaw| match law.law {
            Some(Law::Field(capacitor, _)) => capacitor.acts(),
            Some(Law::Comb(_)) => true,
            _ => false,
        };
        self.of.approaches.members[m].laws.iter().any(field)
    }
}

/// The sum of variables of the shapes with these shares.
fn sum_of_shapes(shares: &[(usize, f64)], name: &str) -> String {
    let terms: Vec<String> = shares.iter().map(|(l, share)| format!("{share:e} * {name}{}", l + 1)).collect();
    if terms.is_empty() { "0".to_owned() } else { terms.join(" + ").replace("+ -", "- ") }
}

/// A number, or 0 where it is rounding beside the largest.
fn significant(x: f64, largest: f64) -> f64 {
    if x.abs() > 1e-13 * largest { x } else { 0.0 }
}
