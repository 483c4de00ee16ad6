//! Beams that are curved as drawn: circular arcs and predisplaced beams, as chains of straight beams between points of the curve.
//!
//! | element | curve, from its first node in local axes |
//! |---|---|
//! | semicircularbeam, circbeam and its kin | radius·(sin φ, 1 − cos φ), φ from 0 to alpha |
//! | predisplacedbeam3, predisplacedbeam4 | x = s·(1 + qx2/l), y the cubic with the slopes qoz1 at s = 0, qoz2 at s = l and y(l) = qy2 |
//!
//! These are the positions of Clark's models for SUGAR (2001), whose semicircularbeam is condensed from 30 chords. An arc has as
//! many here, and more where they would turn by more than [`TURN`]: chords that turn by δ are stiffer than the arc by some δ²/6.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::super::value::short;
use super::arguments::ElementSite;
use bimorph_structure::{Beam, NodeId};
use std::f64::consts::TAU;

/// Chords of a curve, at least.
const CHORDS: usize = 30;
/// Turn of an arc from chord to chord, at most (rad): 2.5°.
const TURN: f64 = TAU / 144.0;

impl ElementSite<'_, '_> {
    /// Adds a chain of straight beams through `points` (m), local axes, from the first node to the second. Inner nodes and beams are
    /// called `NAME.1`, `NAME.2`, …
    fn add_chain(&mut self, ends: [NodeId; 2], points: &[[f64; 2]], width: f64) -> Result<(), Reported> {
        let name = self.name();
        let whole = self.beam(name.clone(), ends, width, None)?;
        let last = points.len() - 1;
        let mut a = ends[0];
        for k in 1..=last {
            let b = if k == last { ends[1] } else { self.drawing.add_node(format!("{name}.{k}"), self.instance.span) };
            let [dx, dy] = self.global([points[k][0] - points[k - 1][0], points[k][1] - points[k - 1][1]]);
            let (length, angle) = (dx.hypot(dy), dy.atan2(dx));
            let material = self.material_along(&whole.material, angle)?;
            let beam = Beam { name: format!("{name}.{k}"), a, b, length, angle, material, ..whole.clone() };
            self.drawing.add_beam(self.instance.span, beam, true);
            a = b;
        }
        Ok(())
    }

    /// The error for a curve whose plane is not the drawing plane.
    fn flat(&mut self) -> Result<(), Reported> {
        match self.instance.rotation.side() {
            Some(side) if side != 0 && self.instance.rotation.x_in_plane() => Ok(()),
            _ => {
                let message = format!("the curve of `{}` leaves the drawing plane", self.instance.name);
                Err(self.error("E061", message, "models are planar (x, y, rotation about z): turn it with `oz` only"))
            }
        }
    }
}

/// SUGAR's arcs, which bend out of the plane too.
pub(super) fn spatial_arc(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    arc(site)
}

/// A circular arc of the angle `alpha` that starts along local x and turns to its left.
pub(super) fn arc(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (radius, width) = (site.positive("radius")?, site.positive("w")?);
    let alpha = site.required("alpha")?;
    if alpha == 0.0 || alpha.abs() > TAU {
        let wanted = "an angle in radians, not 0 and at most a full turn";
        return Err(site.out_of_range("alpha", alpha, wanted));
    }
    // an arc as wide as its diameter is a sector: its inner edge is its centre
    if width > 2.0 * radius * (1.0 + 1e-9) {
        let message =
            format!("`{}` is {} m wide with a radius of {} m", site.instance.name, short(width), short(radius));
        return Err(site.error("E060", message, "a width up to twice the radius; a plate is drawn with `plate2d`"));
    }
    site.flat()?;
    let width = site.etched_from("w", width)?;
    let chords = CHORDS.max((alpha.abs() / TURN).ceil() as usize);
    let at = |k: usize| {
        let (s, c) = (alpha * k as f64 / chords as f64).sin_cos();
        [radius * s, radius * (1.0 - c)]
    };
    let points: Vec<[f64; 2]> = (0..=chords).map(at).collect();
    site.between_arms(|site, ends| site.add_chain(ends, &points, width))
}

/// A beam that is bent as drawn: its far end is displaced by (qx2, qy2) and its ends lean by qoz1 and qoz2.
pub(super) fn predisplaced(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    let (length, width) = (site.positive("l")?, site.etched("w")?);
    for across in ["qz2", "qoy1", "qoy2"] {
        if site.number_or(across, 0.0)? != 0.0 {
            let message = format!("`{across}` bends `{}` out of the drawing plane", site.instance.name);
            return Err(site.error(
                "E061",
                message,
                "models are planar: `qx2`, `qy2`, `qoz1` and `qoz2` bend in the plane",
            ));
        }
    }
    site.flat()?;
    let (x, y) = (site.number_or("qx2", 0.0)?, site.number_or("qy2", 0.0)?);
    let (first, last) = (site.number_or("qoz1", 0.0)?, site.number_or("qoz2", 0.0)?);
    if length + x <= 0.0 {
        return Err(site.out_of_range("qx2", x, "more than −l: the beam would end behind its start"));
    }
    let at = |k: usize| {
        let t = k as f64 / CHORDS as f64;
        let hermite = y * t * t * (3.0 - 2.0 * t) + length * t * (1.0 - t) * (first * (1.0 - t) - last * t);
        [t * (length + x), hermite]
    };
    let points: Vec<[f64; 2]> = (0..=CHORDS).map(at).collect();
    site.between_arms(|site, ends| site.add_chain(ends, &points, width))
}

/// Largest change of the width of a taper over one piece, as a logarithm. Bending compliance is then within 7e-4 of ∫
/// M²/EI, and masses and axial compliances within 1e-4.
const STEEP: f64 = 0.025;

/// Most pieces of a taper.
const MAX_PIECES: usize = 400;

/// A beam whose width goes from `w1` to `w2` along it, as pieces over which the width changes by one factor, each of the width whose compliance in
/// bending is that of the piece: `1/w³ = ∫ dx/w(x)³ / l`.
pub(super) fn taper(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (length, w1, w2) = (site.positive("l")?, site.etched("w1")?, site.etched("w2")?);
    let direction = site.direction(site.instance.rotation)?;
    let name = site.name();
    let steep = (w2 / w1).ln();
    let pieces = ((steep.abs() / STEEP).ceil() as usize).clamp(CHORDS, MAX_PIECES);
    let share = |k: usize| k as f64 / pieces as f64;
    // where the width is w, the share (w − w1)/(w2 − w1) of the length is behind
    let behind = |k: usize| if steep == 0.0 { share(k) } else { (steep * share(k)).exp_m1() / steep.exp_m1() };
    let width = |k: usize| w1 * (steep * share(k)).exp();
    let mut a = site.node(0);
    for k in 1..=pieces {
        let b =
            if k == pieces { site.node(1) } else { site.drawing.add_node(format!("{name}.{k}"), site.instance.span) };
        let (from, to) = (width(k - 1), width(k));
        let wider = to / from;
        let mean = from * (2.0 * wider * wider / (1.0 + wider)).cbrt();
        let piece = site.beam(format!("{name}.{k}"), [a, b], mean, Some(length * (behind(k) - behind(k - 1))))?;
        debug_assert_eq!(piece.angle, direction);
        site.drawing.add_beam(site.instance.span, piece, true);
        a = b;
    }
    Ok(())
}
