//! Gap functions as expressions that SPICE and Verilog-A both read: of `u`, the text of an approach in micrometres.
//!
//! They are those of [`bimorph_domains::capacitor`], [`bimorph_domains::contact`] and [`bimorph_domains::stop`], with `min` and `max` in the place of
//! cases, so that no branch divides by what another one keeps away from 0.

use super::lumped::Law;
use bimorph_domains::capacitor::Capacitor;
use bimorph_domains::contact::{Contact, PRESSURE, TOUCH};
use bimorph_domains::stop::{SOFT, StopKind};

/// C(u) (F).
pub(super) fn capacitance(capacitor: &Capacitor, u: &str) -> String {
    match *capacitor {
        Capacitor::Comb { slope, overlap, parasitic, .. } if overlap.is_infinite() => {
            format!("({parasitic:e} + {slope:e} * 1e-6 * {u})")
        }
        Capacitor::Comb { slope, overlap, blend, parasitic } => {
            let share = share(u, overlap, blend);
            let beyond = format!("max({:e} + 1e-6 * {u}, 0)", overlap - blend);
            format!("({parasitic:e} + {slope:e} * ({blend:e} * {share} * {share} + {beyond}))")
        }
        Capacitor::Plates { strength, gap, closest } => {
            let d = format!("({gap:e} - 1e-6 * {u})");
            format!("({strength:e} / max({d}, {closest:e}) * (2 - min({d}, {closest:e}) / {closest:e}))")
        }
    }
}

/// dC/du (F/m).
pub(super) fn slope(capacitor: &Capacitor, u: &str) -> String {
    match *capacitor {
        Capacitor::Comb { slope, overlap, .. } if overlap.is_infinite() => format!("{slope:e}"),
        Capacitor::Comb { slope, overlap, blend, .. } => format!("({slope:e} * {})", share(u, overlap, blend)),
        Capacitor::Plates { strength, gap, closest } => {
            let d = format!("max({gap:e} - 1e-6 * {u}, {closest:e})");
            format!("({strength:e} / ({d} * {d}))")
        }
    }
}

/// How far a comb is engaged, 0 to 1, over the blend at its end.
fn share(u: &str, overlap: f64, blend: f64) -> String {
    format!("min(max(({:e} + 1e-6 * {u}) / {:e}, 0), 1)", overlap + blend, 2.0 * blend)
}

/// Contact force against the approach `u` at its `rate`, a text in m/s (N); none where parts never touch.
pub(super) fn bearing(law: &Law, loss: f64, u: &str, rate: &str) -> Option<String> {
    match law {
        Law::Field(_, None) => None,
        Law::Field(capacitor, Some(contact)) => {
            let sign = if matches!(capacitor, Capacitor::Comb { .. }) { "+" } else { "-" };
            Some(lossy(
                pressed(contact, &format!("({:e} {sign} 1e-6 * {u})", capacitor.distance(0.0))),
                loss,
                "+",
                rate,
            ))
        }
        Law::Stop(ways, stop) => {
            let side = |way: Option<f64>, [sign, closing]: [&str; 2]| {
                let left = format!("({:e} {sign} 1e-6 * {u})", way?);
                let elastic = match stop {
                    StopKind::Rigid(area) => {
                        pressed(&Contact { touch: TOUCH, area: *area }, &format!("({TOUCH:e} + {left})"))
                    }
                    StopKind::Elastic(k) => {
                        let p = format!("max(-{left}, 0)");
                        format!("({k:e} * {p} * {p} / ({p} + {SOFT:e}))")
                    }
                };
                Some(lossy(elastic, loss, closing, rate))
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

/// True where the contact force depends on the rate.
pub(super) fn loses(law: &Law, loss: f64) -> bool {
    loss > 0.0 && !matches!(law, Law::Field(_, None))
}

/// A contact force with the loss of an impact ([`bimorph_domains::contact_loss`]); `closing` is the sign of the closing speed in the rate.
fn lossy(force: String, loss: f64, closing: &str, rate: &str) -> String {
    if loss > 0.0 { format!("({force} * max(1 {closing} {loss:e} * {rate}, 0))") } else { force }
}

/// The force of a contact at the distance `d`, a text in metres.
fn pressed(contact: &Contact, d: &str) -> String {
    let s = format!("max({:e} * ({:e} - {d}), 0)", 2.0 / contact.touch, contact.touch);
    format!("({:e} * {s} * {s} * {s} * {s})", contact.area * PRESSURE)
}
