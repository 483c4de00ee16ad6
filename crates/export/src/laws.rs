//! Gap functions as expressions that SPICE and Verilog-A both read: of `u`, the text of an approach in micrometres.
//!
//! They are those of [`bimorph_domains::capacitor`], [`bimorph_domains::contact`] and [`bimorph_domains::stop`], with `min` and `max` in the place of
//! cases, so that no branch divides by what another one keeps away from 0.

use super::lumped::{Law, LumpedGap, LumpedOutput};
use bimorph_domains::attraction::Adhesion;
use bimorph_domains::capacitor::Capacitor;
use bimorph_domains::comb_field::CombField;
use bimorph_domains::contact::{Contact, DEEPEST, PRESSURE, TOUCH};
use bimorph_domains::contact_resistance;
use bimorph_domains::edge_field::EdgeField;
use bimorph_domains::squeeze_film::SqueezeFilm;
use bimorph_domains::stop::{SOFT, StopKind};
use bimorph_structure::OhmicContact;
use std::f64::consts::PI;

/// C(u) (F).
pub(super) fn capacitance(capacitor: &Capacitor, u: &str) -> String {
    match *capacitor {
        Capacitor::Comb { slope, overlap, parasitic, .. } if overlap.is_infinite() => {
            format!("({parasitic:e} + {slope:e} * 1e-6 * {u})")
        }
        Capacitor::Comb { slope, overlap, blend, parasitic, fingers: Some(fingers) } => {
            let ideal = Capacitor::Comb { slope, overlap, blend, parasitic, fingers: None };
            format!("({} + {})", capacitance(&ideal, u), finger_value(&fingers, &format!("({overlap:e} + 1e-6 * {u})")))
        }
        Capacitor::Comb { slope, overlap, blend, parasitic, fingers: None } => {
            let share = share(u, overlap, blend);
            let beyond = format!("max({:e} + 1e-6 * {u}, 0)", overlap - blend);
            format!("({parasitic:e} + {slope:e} * ({blend:e} * {share} * {share} + {beyond}))")
        }
        Capacitor::Plates { strength, edges, gap, shortening, closest } if has_fringe(&edges) => {
            let d = format!("({:e} - 1e-6 * {u})", gap - shortening);
            let at = format!("max({d}, {closest:e})");
            let value: String = edges.iter().map(|edge| edge_value(edge, &at)).collect();
            let below = format!("max({closest:e} - {d}, 0)");
            format!("({strength:e} * (1 / {at}{value} + ({}) * {below}))", fall(&edges, &at))
        }
        Capacitor::Plates { strength, gap, shortening, closest, .. } => {
            let d = format!("({:e} - 1e-6 * {u})", gap - shortening);
            format!("({strength:e} / max({d}, {closest:e}) * (2 - min({d}, {closest:e}) / {closest:e}))")
        }
    }
}

/// dC/du (F/m).
pub(super) fn slope(capacitor: &Capacitor, u: &str) -> String {
    match *capacitor {
        Capacitor::Comb { slope, overlap, .. } if overlap.is_infinite() => format!("{slope:e}"),
        Capacitor::Comb { slope, overlap, blend, fingers: Some(fingers), .. } => {
            let pull = finger_slope(&fingers, &format!("({overlap:e} + 1e-6 * {u})"));
            format!("({slope:e} * {} + {pull})", share(u, overlap, blend))
        }
        Capacitor::Comb { slope, overlap, blend, .. } => format!("({slope:e} * {})", share(u, overlap, blend)),
        Capacitor::Plates { strength, edges, gap, shortening, closest } if has_fringe(&edges) => {
            let d = format!("max({:e} - 1e-6 * {u}, {closest:e})", gap - shortening);
            format!("({strength:e} * ({}))", fall(&edges, &d))
        }
        Capacitor::Plates { strength, gap, shortening, closest, .. } => {
            let d = format!("max({:e} - 1e-6 * {u}, {closest:e})", gap - shortening);
            format!("({strength:e} / ({d} * {d}))")
        }
    }
}

fn has_fringe(edges: &[EdgeField]) -> bool {
    edges.iter().any(|edge| *edge != EdgeField::None)
}

/// Sum over the terms of A at the distance `d`, each times its power of 1/d to the `k`.
fn weighted(terms: &[f64; 4], unit: f64, d: &str, k: i32) -> String {
    let y = format!("({unit:e} / {d})");
    let scaled: [f64; 4] = std::array::from_fn(|j| terms[j] * EdgeField::POWERS[j].powi(k));
    let [quarter, half, one, two] = scaled;
    format!("({quarter:e} * sqrt(sqrt({y})) + {half:e} * sqrt({y}) + {one:e} * {y} + {two:e} * {y} * {y})")
}

/// e(d) of an edge with its sign; empty where it has no field.
fn edge_value(edge: &EdgeField, d: &str) -> String {
    match edge {
        EdgeField::None => String::new(),
        EdgeField::Parallel { factor, inverse } => format!(" - {factor:e} * ln({inverse:e} * {d})"),
        EdgeField::Exact { factor, unit, terms } => format!(" + {factor:e} * ln({})", weighted(terms, *unit, d, 0)),
    }
}

/// 1/d² less e′(d) of both edges.
fn fall(edges: &[EdgeField], d: &str) -> String {
    let mut text = format!("1 / ({d} * {d})");
    for edge in edges {
        match edge {
            EdgeField::None => {}
            EdgeField::Parallel { factor, .. } => text.push_str(&format!(" + {factor:e} / {d}")),
            EdgeField::Exact { factor, unit, terms } => {
                let [first, sum] = [1, 0].map(|k| weighted(terms, *unit, d, k));
                text.push_str(&format!(" + {factor:e} * {first} / ({d} * {sum})"));
            }
        }
    }
    text
}

/// n and y of [`CombField`] as texts at the overlap `o`, a text in metres.
fn engagement(fingers: &CombField, o: &str) -> [String; 2] {
    let [lambda, g] = [CombField::STEEPNESS, fingers.gap];
    let n = format!("(max(-{o} / {g:e}, 0) + ln(1 + exp(-{:e} * abs({o}))) / {lambda:e})", lambda / g);
    let y = format!("({n} / {:e})", fingers.fade);
    [n, y]
}

/// q of the tips and their distance to the base.
pub(super) fn tips(fingers: &CombField, o: &str) -> [String; 2] {
    let d = format!("({:e} - {o})", fingers.length);
    [format!("exp(-{:e} * max({d}, {:e}))", fingers.decay, fingers.closest()), d]
}

/// Slope of the tips' field with the overlap, for N·ε·h = 1.
pub(super) fn tip_slope(fingers: &CombField, q: &str) -> String {
    let [facing, beside] = fingers.tips;
    format!("({:e} * {q} * ({facing:e} / (1 - {q}) + {beside:e}) / (1 - {q}))", 2.0 * fingers.decay)
}

/// C of the fingers in their plane at the overlap `o`.
fn finger_value(fingers: &CombField, o: &str) -> String {
    let ([n, y], [q, d]) = (engagement(fingers, o), tips(fingers, o));
    let ends = format!("{:e} * (1 + {:e} * {y} / (1 + {y})) / (1 + {y})", fingers.ends, CombField::SHAPE);
    format!("{:e} * ({o} / {:e} + {n} + {ends} + {})", fingers.strength, fingers.gap, tip_value(fingers, &q, &d))
}

/// Field of the tips, for N·ε·h = 1.
pub(super) fn tip_value(fingers: &CombField, q: &str, d: &str) -> String {
    let [facing, beside] = fingers.tips;
    let tip = format!("2 * ({facing:e} * {q} / (1 - {q}) - {beside:e} * ln(1 - {q}))");
    format!("({tip} + max({:e} - {d}, 0) * {})", fingers.closest(), tip_slope(fingers, q))
}

/// e of [`bimorph_domains::comb_field`] at the text `rho`.
pub(super) fn above(rho: &str) -> String {
    format!("((({rho} + 2) * ln({rho} + 2) - {rho} * ln({rho})) / {PI:e})")
}

/// dC/du of the fingers in their plane at the overlap `o`.
fn finger_slope(fingers: &CombField, o: &str) -> String {
    let ([_, y], [q, _]) = (engagement(fingers, o), tips(fingers, o));
    let open = format!("(1 / (1 + exp(min({:e} * {o}, 80))))", CombField::STEEPNESS / fingers.gap);
    let fall = format!("({:e} * (1 - {y}) / (1 + {y}) - 1) / ((1 + {y}) * (1 + {y}))", CombField::SHAPE);
    let engaged = format!("(1 - {open} - {:e} * {open} * {fall})", fingers.ends / fingers.fade);
    format!("{:e} * ({:e} * {engaged} + {})", fingers.strength, 1.0 / fingers.gap, tip_slope(fingers, &q))
}

/// How far a comb is engaged, 0 to 1, over the blend at its end.
fn share(u: &str, overlap: f64, blend: f64) -> String {
    format!("min(max(({:e} + 1e-6 * {u}) / {:e}, 0), 1)", overlap + blend, 2.0 * blend)
}

/// Contact force against the approach `u` at its `rate`, a text in m/s (N); none where parts never touch.
pub(super) fn bearing(law: &Law, loss: f64, u: &str, rate: &str) -> Option<String> {
    match law {
        Law::Field(_, None) | Law::Comb(_) | Law::Across => None,
        Law::Field(capacitor, Some(contact)) => {
            let sign = if matches!(capacitor, Capacitor::Comb { .. }) { "+" } else { "-" };
            Some(lossy(
                pressed(contact, &format!("({:e} {sign} 1e-6 * {u})", capacitor.distance(0.0))),
                loss,
                "+",
                rate,
            ))
        }
        Law::Spring([quadratic, cubic]) => {
            Some(format!("({:e} * {u} * {u} * {u} - {:e} * {u} * {u})", 1e-18 * cubic, 1e-12 * quadratic))
        }
        Law::Stop(ways, stop, adhesion) => {
            let side = |way: Option<f64>, [sign, closing]: [&str; 2]| {
                let left = left(way?, sign, u);
                let pressing = lossy(stopped(stop, &left), loss, closing, rate);
                Some(match adhesion {
                    Some(adhesion) => format!("({pressing} - {})", attracted(adhesion, &left)),
                    None => pressing,
                })
            };
            match (side(ways[0], ["-", "+"]), side(ways[1], ["+", "-"])) {
                (Some(ahead), Some(back)) => Some(format!("({ahead} - {back})")),
                (Some(ahead), None) => Some(ahead),
                (None, Some(back)) => Some(format!("(-{back})")),
                (None, None) => None,
            }
        }
    }
}

/// A reading of a contact with a `law` at the approach `u`: the way that is left, its force or its conductance; other readings are 0. `named` takes the expression of
/// the radius of a contact that conducts (µm), and gives it a name.
pub(super) fn contact_reading(
    reading: &LumpedOutput,
    law: &Law,
    u: &str,
    named: impl FnOnce(String) -> String,
) -> String {
    match (reading, law) {
        (LumpedOutput::Way(_), Law::Stop(ways, ..)) => nearer_way(ways, u),
        (LumpedOutput::Bearing(_), _) => pressing(law, u),
        (LumpedOutput::Conductance(_, metals), _) => conductance(metals, &named(radius(metals, &pressing(law, u)))),
        _ => "0".to_owned(),
    }
}

/// Size of the elastic contact force at the approach `u` (N), as `GAP.N` shows it; 0 where parts never touch. Combs of two approaches have their own.
pub(super) fn pressing(law: &Law, u: &str) -> String {
    match law {
        Law::Field(_, None) | Law::Spring(_) | Law::Comb(_) | Law::Across => "0".to_owned(),
        Law::Field(capacitor, Some(contact)) => {
            let sign = if matches!(capacitor, Capacitor::Comb { .. }) { "+" } else { "-" };
            pressed(contact, &format!("({:e} {sign} 1e-6 * {u})", capacitor.distance(0.0)))
        }
        Law::Stop(ways, stop, _) => {
            let sides = ways.iter().zip(["-", "+"]);
            let forces: Vec<_> = sides.filter_map(|(way, sign)| Some(stopped(stop, &left((*way)?, sign, u)))).collect();
            format!("({})", forces.join(" + "))
        }
    }
}

/// Way that is left before the nearer side of a stop at the approach `u` (m), as `STOP.gap` shows it.
pub(super) fn nearer_way(ways: &[Option<f64>; 2], u: &str) -> String {
    match [ways[0].map(|way| left(way, "-", u)), ways[1].map(|way| left(way, "+", u))] {
        [Some(ahead), Some(back)] => format!("min({ahead}, {back})"),
        [way, other] => way.or(other).unwrap_or_else(|| "0".to_owned()),
    }
}

/// Force that conducts next to nothing (N): from there on the root of the radius has a finite slope.
const LEAST: f64 = 1e-18;

/// Radius of the contact of two metals under the force `pressing`, a text in newtons (µm).
pub(super) fn radius(contact: &OhmicContact, pressing: &str) -> String {
    format!("sqrt(max({pressing}, {LEAST:e}) / {:e})", 1e-12 * PI * contact.hardness)
}

/// Conductance of two metals at the radius `a`, a text in micrometres (S), as [`bimorph_domains::contact_resistance`].
pub(super) fn conductance(contact: &OhmicContact, a: &str) -> String {
    let OhmicContact { resistivity, electron_path, .. } = *contact;
    let path = 1e6 * electron_path;
    let constriction = format!("0.5 * {a} * ({a} + {:e}) / ({a} + {:e})", 0.83 * path, 1.33 * path);
    let (crossing, start) = (4.0 * path / (3.0 * PI), contact_resistance::conductance(contact, LEAST).0);
    format!("({a} * {a} / ({:e} * ({constriction} + {crossing:e})) - {start:e})", 1e6 * resistivity)
}

/// Way that is left of `way` (m) at the approach `u`, which it falls with at the `sign` "-".
fn left(way: f64, sign: &str, u: &str) -> String {
    format!("({way:e} {sign} 1e-6 * {u})")
}

/// Elastic force of a stop with the way `left`, a text in metres.
fn stopped(stop: &StopKind, left: &str) -> String {
    match stop {
        StopKind::Rigid(area) => pressed(&Contact { touch: TOUCH, area: *area }, &format!("({TOUCH:e} + {left})")),
        StopKind::Elastic(k) => {
            let p = format!("max(-{left}, 0)");
            format!("({k:e} * {p} * {p} / ({p} + {SOFT:e}))")
        }
    }
}

/// True where a force of the gap depends on the rate.
pub(super) fn loses(gap: &LumpedGap) -> bool {
    gap.film.is_some() || gap.loss > 0.0 && !matches!(gap.law, Law::Field(_, None))
}

/// Force of the gas against the approach `u` at its `rate`, a text in m/s (N), as [`bimorph_domains::squeeze_film`].
pub(super) fn drag(film: Option<(f64, SqueezeFilm)>, u: &str, rate: &str) -> Option<String> {
    let (drawn, film) = film?;
    let beyond = format!("({:e} - 1e-6 * {u})", drawn - film.touch);
    let s = format!("max({:e} * {beyond}, 0)", -1.0 / film.closed);
    let g = format!("({:e} / (1 + {s} + {s} * {s}) + max({beyond}, 0))", film.closed);
    let slip = format!("(1 + {:e} * pow({g}, -1.159))", 9.638 * film.free_path.powf(1.159));
    Some(format!("({:e} * pow({g}, -3) / {slip} * {rate})", film.strength))
}

/// A contact force with the loss of an impact ([`bimorph_domains::contact_loss`]); `closing` is the sign of the closing speed in the rate.
pub(super) fn lossy(force: String, loss: f64, closing: &str, rate: &str) -> String {
    if loss > 0.0 { format!("({force} * max(1 {closing} {loss:e} * {rate}, 0))") } else { force }
}

/// The adhesion at the distance `d`, a text in metres ([`bimorph_domains::attraction`]).
fn attracted(adhesion: &Adhesion, d: &str) -> String {
    let x = format!("min(max({:e} * {d}, 0), 1)", 1.0 / adhesion.range);
    format!("{:e} * (1 - {x} * {x} * (3 - 2 * {x}))", adhesion.force)
}

/// The force of a contact at the distance `d`, a text in metres. Beyond the range of the law it continues along its tangent, from where a
/// simulator's iterations come back sooner.
pub(super) fn pressed(contact: &Contact, d: &str) -> String {
    let s = format!("max({:e} * ({:e} - {d}), 0)", 2.0 / contact.touch, contact.touch);
    let within = format!("min({s}, {DEEPEST:e})");
    format!("({:e} * {within} * {within} * (3 * {s} - 2 * {within}))", contact.area * PRESSURE)
}

#[cfg(test)]
mod tests {
    use super::super::expression_values::ExpressionValues;
    use super::*;

    /// The texts have the values of C and dC/du to rounding: of ideal and fringing plates and combs, open, close and below the range of their laws.
    #[test]
    fn texts_have_the_values_of_the_laws() {
        let plates =
            |edges| Capacitor::Plates { strength: 8.85e-20, edges, gap: 2.1e-6, shortening: 0.1e-6, closest: 0.07e-6 };
        let comb = |fingers| Capacitor::Comb { slope: 1e-10, overlap: 3e-6, blend: 2e-6, parasitic: 1e-15, fingers };
        let exact = [EdgeField::over_plane(10e-6, 2e-6, 2e-6), EdgeField::over_plane(40e-6, 2e-6, 2e-6)];
        let parallel = EdgeField::Parallel { factor: 0.65 / 1e-5, inverse: 1e5 };
        for capacitor in [
            plates([EdgeField::None; 2]),
            plates(exact),
            plates([parallel; 2]),
            plates([EdgeField::None, parallel]),
            comb(None),
            comb(Some(CombField::new(3e-16, [2e-6, 3e-6, 20e-6]))),
        ] {
            for u in [-15.0, -4.0, -1.0, 0.0, 0.7, 1.9, 1.99, 9.0, 16.85] {
                let c = capacitor.at(1e-6 * u);
                for (text, value) in [
                    (capacitance(&capacitor, &format!("({u:e})")), c.value),
                    (slope(&capacitor, &format!("({u:e})")), c.slope),
                ] {
                    let found = ExpressionValues::default().value(&text);
                    let scale = value.abs().max(1e-22);
                    assert!((found - value).abs() < 1e-9 * scale, "{capacitor:?} {u}: {found} {value}\n{text}");
                }
            }
        }
    }

    /// Way, contact force and conductance that are read have the values of the stop and of the contact of metals, open and closed on both sides; those of plates that
    /// touch the force of the contact alone.
    #[test]
    fn contacts_are_read() {
        let (ways, stop) = ([Some(0.5e-6), Some(0.3e-6)], StopKind::Rigid(1e-12));
        let metals = OhmicContact { hardness: 2e9, resistivity: 2.2e-8, electron_path: 38e-9 };
        let law = Law::Stop(ways, stop, Some(Adhesion { force: 2e-6, range: 20e-9 }));
        let read = |reading: &LumpedOutput, law: &Law, u: f64| {
            let text = contact_reading(reading, law, &format!("({u:e})"), |radius| format!("({radius})"));
            ExpressionValues::default().value(&text)
        };
        for u in [-0.303_f64, -0.29, 0.0, 0.2, 0.4999, 0.504] {
            let (ahead, back) = (0.5e-6 - 1e-6 * u, 0.3e-6 + 1e-6 * u);
            let force = stop.force(ahead).0 + stop.force(back).0;
            let conductance = contact_resistance::conductance(&metals, force).0;
            for (reading, value) in [
                (LumpedOutput::Way(0), ahead.min(back)),
                (LumpedOutput::Bearing(0), force),
                (LumpedOutput::Conductance(0, metals), conductance),
            ] {
                let found = read(&reading, &law, u);
                assert!((found - value).abs() < 1e-9 * value.abs() + 1e-12, "{reading:?} {u}: {found} {value}");
            }
        }
        let plates = Capacitor::Plates {
            strength: 1e-19,
            edges: [EdgeField::None; 2],
            gap: 2e-6,
            shortening: 0.0,
            closest: 0.07e-6,
        };
        let contact = Contact { touch: 0.1e-6, area: 1e-9 };
        let force = read(&LumpedOutput::Bearing(0), &Law::Field(plates, Some(contact)), 1.902);
        assert!((force / contact.force(0.098e-6).0 - 1.0).abs() < 1e-9, "{force}");
    }

    /// A nonlinear spring, and a stop with adhesion on both sides, have the force against the approach of their domains.
    #[test]
    fn springs_and_adhesion() {
        let adhesion = Adhesion { force: 2e-6, range: 20e-9 };
        let ways = [Some(0.5e-6), Some(0.3e-6)];
        let stop = StopKind::Elastic(1e3);
        for u in [-0.301_f64, -0.29, 0.0, 0.2, 0.487, 0.4999, 0.502] {
            let (ahead, back) = (0.5e-6 - 1e-6 * u, 0.3e-6 + 1e-6 * u);
            let side = |left: f64| stop.force(left).0 - bimorph_domains::attraction::attraction(&adhesion, left).0;
            let spring = -1e5 * (1e-6 * u) * (1e-6 * u) + 4e10 * (1e-6 * u).powi(3);
            for (law, value) in
                [(Law::Stop(ways, stop, Some(adhesion)), side(ahead) - side(back)), (Law::Spring([1e5, 4e10]), spring)]
            {
                let text = bearing(&law, 0.0, &format!("({u:e})"), "0").unwrap_or_default();
                let found = ExpressionValues::default().value(&text);
                assert!((found - value).abs() < 1e-9 * value.abs().max(1e-9), "{u}: {found} {value}\n{text}");
            }
        }
    }
}
