//! The law of a comb over the overlap and the distance aside of its fingers, as assignments of variables that Verilog-A reads.
//!
//! It is that of [`bimorph_domains::comb_sides`], with `min` and `max` in the place of cases.
//!
//! | variable | what it is |
//! |---|---|
//! | `co`, `ca` | overlap and distance aside (m) |
//! | `cs`, `cf` | share of the engaged fingers (1), and overlap that ends over a gap on both sides of 0 (m) |
//! | `ct`, `ch`, `ci`, `cj` | gap of one side, the same above its least, its inverse and the slope of that across |
//! | `cr`, `cz`, `cn`, `ce`, `cb`, `cx`, `cg`, `cd`, `cq`, `cl` | w/g, o/g, n, c, b, y, G and G′ of the field in the plane, its slopes with o/g and w/g |
//! | `cc`, `cu`, `cv` | capacitance (F), and its slopes along and across (F/m) |
//! | `cw`, `cy` | forces of the contact along and across, against the displacements (N) |

use super::laws::{above, lossy, pressed, tip_slope, tip_value, tips};
use bimorph_domains::comb_field::CombField;
use bimorph_domains::comb_sides::CombLaw;
use bimorph_domains::contact::{Contact, DEEPEST, PRESSURE};

/// A variable and its value.
pub(super) type Assignment = (&'static str, String);

/// The slope of e at the text `x`.
fn above_slope(x: &str) -> String {
    format!("(ln(({x} + 2) / {x}) / {:e})", std::f64::consts::PI)
}

/// `co`, `ca`, and `cc`, `cu` and `cv` of the field, of displacements `u` and `y` in micrometres.
pub(super) fn field(law: &CombLaw, [u, y]: [&str; 2]) -> Vec<Assignment> {
    let (sides, [overlap, aside]) = (&law.sides, law.drawn);
    let (g, h) = (sides.gap, sides.height);
    let mut all: Vec<Assignment> = vec![
        ("co", format!("{overlap:e} + 1e-6 * ({u})")),
        ("ca", format!("{aside:e} + 1e-6 * ({y})")),
        ("cs", format!("min(max((co + {g:e}) / {:e}, 0), 1)", 2.0 * g)),
        ("cf", format!("{g:e} * cs * cs + max(co - {g:e}, 0)")),
        ("cc", "0".to_owned()),
        ("cu", "0".to_owned()),
        ("cv", "0".to_owned()),
    ];
    for sign in [1.0, -1.0] {
        all.extend(side(law, sign));
    }
    let half = 0.5 * sides.strength;
    let [mut value, mut along] = [format!("{:e} + {half:e} * cc", sides.parasitic), format!("{half:e} * cu")];
    if let Some((_, fingers)) = &sides.fingers {
        let ([q, d], strength) = (tips(fingers, "co"), sides.strength * h);
        value.push_str(&format!(" + {strength:e} * {}", tip_value(fingers, &q, &d)));
        along.push_str(&format!(" + {strength:e} * {}", tip_slope(fingers, &q)));
    }
    all.extend([("cc", value), ("cu", along), ("cv", format!("{half:e} * cv"))]);
    all
}

/// The part of the gaps of one side in `cc`, `cu` and `cv`, for N·ε = 1.
fn side(law: &CombLaw, sign: f64) -> Vec<Assignment> {
    let sides = &law.sides;
    let (h, t) = (sides.height, sides.contact.least());
    let mut all: Vec<Assignment> = vec![
        ("ct", format!("{:e} - ({sign:e}) * ca", sides.gap)),
        ("ch", format!("max(ct, {t:e})")),
        ("ci", format!("(2 - min(ct, {t:e}) / {t:e}) / ch")),
        ("cj", format!("({sign:e}) / (ch * ch)")),
    ];
    let Some((width, _)) = &sides.fingers else {
        all.extend([
            ("cc", format!("cc + {h:e} * cf * ci")),
            ("cu", format!("cu + {h:e} * cs * ci")),
            ("cv", format!("cv + {h:e} * cf * cj")),
        ]);
        return all;
    };
    let ([scale, power], shape) = (CombField::FADING, CombField::SHAPE);
    let steep = CombField::STEEPNESS;
    all.extend([
        ("cr", format!("{width:e} * ci")),
        ("cz", "co * ci".to_owned()),
        ("cn", format!("max(-cz, 0) + ln(1 + exp(-{steep:e} * abs(cz))) / {steep:e}")),
        ("ce", format!("2 * {}", above("(0.5 * cr)"))),
        ("cb", format!("{scale:e} * pow(ce, {power:e})")),
        ("cx", "cn / cb".to_owned()),
        ("cg", format!("(1 + ({shape:e}) * cx / (1 + cx)) / (1 + cx)")),
        ("cd", format!("(({shape:e}) * (1 - cx) / (1 + cx) - 1) / ((1 + cx) * (1 + cx))")),
        ("cq", format!("1 - (1 + ce * cd / cb) / (1 + exp(min({steep:e} * cz, 80)))")),
        ("cl", format!("{} * (cg - {power:e} * cx * cd)", above_slope("(0.5 * cr)"))),
        ("cc", format!("cc + ({} - {:e}) * cf + {h:e} * (cn + cz + ce * cg)", above("cr"), sides.substrate)),
        ("cu", format!("cu + ({} - {:e}) * cs + {h:e} * ci * cq", above("cr"), sides.substrate)),
        ("cv", format!("cv + {} * {width:e} * cj * cf + {h:e} * cj * (cq * co + {width:e} * cl)", above_slope("cr"))),
    ]);
    all
}

/// Distances between the sides of the fingers (m): both close where the fingers move to one side.
fn distances(law: &CombLaw) -> [String; 2] {
    ["-", "+"].map(|sign| format!("({:e} {sign} ca)", law.sides.gap))
}

/// `cw` and `cy` of the contact with the impact loss χ = `loss` (s/m) at the rate across, a text in m/s.
pub(super) fn bearing(law: &CombLaw, loss: f64, rate: &str) -> [Assignment; 2] {
    let contact = &law.sides.contact;
    let [near, far] = distances(law);
    let across = |d: &str, closing: &str| lossy(pressed(contact, d), loss, closing, rate);
    [
        ("cw", format!("cs * ({} + {})", stored(contact, &near), stored(contact, &far))),
        ("cy", format!("cf * ({} - {})", across(&near, "+"), across(&far, "-"))),
    ]
}

/// Size of the elastic contact force across (N).
pub(super) fn pressing(law: &CombLaw) -> String {
    let [near, far] = distances(law).map(|d| pressed(&law.sides.contact, &d));
    format!("(cf * ({near} + {far}))")
}

/// Energy of a contact at the distance `d`, a text in metres, whose force [`pressed`] is.
fn stored(contact: &Contact, d: &str) -> String {
    let s = format!("max({:e} * ({:e} - {d}), 0)", 2.0 / contact.touch, contact.touch);
    let within = format!("min({s}, {DEEPEST:e})");
    let beyond = format!("max({s} - {DEEPEST:e}, 0)");
    let unit = 0.5 * contact.touch * contact.area * PRESSURE;
    let [first, second] = [DEEPEST.powi(3), 1.5 * DEEPEST * DEEPEST];
    format!(
        "({unit:e} * (0.25 * {within} * {within} * {within} * {within} + {beyond} * ({first:e} + {second:e} * {beyond})))"
    )
}

#[cfg(test)]
mod tests {
    use super::super::expression_values::ExpressionValues;
    use super::*;
    use bimorph_domains::comb_sides::{CombSides, substrate_share};

    fn comb(rho: f64) -> CombLaw {
        let (g, strength, height) = (2e-6, 20.0 * 8.854e-12, 4e-6);
        let sides = CombSides {
            strength,
            height,
            gap: g,
            fingers: Some((rho * g, CombField::new(strength * height, [g, rho * g, 40e-6]))),
            substrate: substrate_share(rho, 1.5),
            contact: Contact { touch: 0.1e-6, area: 10.0 * height },
            parasitic: 1e-15,
        };
        CombLaw { sides, drawn: [15e-6, 0.1e-6] }
    }

    /// The assignments have the values of C and of its slopes along and across to rounding, with and without fringe field, from far apart to the base, in the
    /// middle, aside and below the least distance of the contact.
    #[test]
    fn texts_have_the_values_of_the_law() {
        let plain = CombLaw { sides: CombSides { fingers: None, ..comb(1.0).sides }, ..comb(1.0) };
        for law in [comb(0.5), comb(2.0), plain] {
            for u in [-40.0, -18.0, -15.4, -14.0, -3.0, 0.0, 9.0, 23.5] {
                for y in [-0.1, 0.0, 0.4, -1.3, 1.76, 1.85, -1.99] {
                    let at = law.field([1e-6 * u, 1e-6 * y]);
                    let mut values = ExpressionValues::default();
                    for (name, text) in field(&law, [&format!("({u:e})"), &format!("({y:e})")]) {
                        values.set(name, &text);
                    }
                    let size = law.sides.strength * law.sides.height / law.sides.gap;
                    for (name, value, size) in
                        [("cc", at.value, 1e-15), ("cu", at.first[0], size), ("cv", at.first[1], size)]
                    {
                        let (found, scale) = (values.of(name), value.abs().max(1e-3 * size));
                        assert!((found - value).abs() < 1e-9 * scale, "{name} {u} {y}: {found} {value}");
                    }
                }
            }
        }
    }

    /// The contact's forces are those of its energy: along and across, on both sides, within the range of its law to 1e-9; apart they are 0. Approaching fingers
    /// press harder by χ times their speed. Beyond the range the force along is the energy under the force across that is written.
    #[test]
    fn sides_bear() {
        let law = comb(1.0);
        let forces = |y: f64, loss: f64, rate: &str| {
            let mut values = ExpressionValues::default();
            let of_field = field(&law, ["0.5", &format!("({:e})", 1e6 * y)]);
            for (name, text) in of_field.into_iter().chain(bearing(&law, loss, rate)) {
                values.set(name, &text);
            }
            [values.of("cw"), values.of("cy")]
        };
        for y in [1.81e-6, -2.02e-6] {
            let at = law.pressed([0.5e-6, y]).unwrap().first;
            for (found, wanted) in forces(y, 0.0, "0").into_iter().zip(at) {
                assert!((found / wanted - 1.0).abs() < 1e-9, "{y}: {found} {wanted}");
            }
            let closing = if y > 0.0 { "0.2" } else { "(-0.2)" };
            assert!((forces(y, 3.0, closing)[1] / at[1] - 1.6).abs() < 1e-9);
        }
        assert_eq!(forces(1.7e-6, 3.0, "0.2"), [0.0; 2]);
        let (deep, step) = (1.86e-6, 1e-10);
        let slope = (forces(deep + step, 0.0, "0")[0] - forces(deep - step, 0.0, "0")[0]) / (2.0 * step);
        let over_overlap = forces(deep, 0.0, "0")[1] / 15.5e-6;
        assert!((slope / over_overlap - 1.0).abs() < 1e-5, "{slope} {over_overlap}");
    }
}
