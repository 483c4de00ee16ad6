//! Supports: anchors, hinges, sliders, guides, sliding beams; and `pos`, which only places nodes.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::super::rotation::Rotation;
use super::arguments::ElementSite;
use bimorph_structure::{AnchorMotion, NodeId, Pad, Support};

/// Strain of a substrate beyond the strength of any (1).
const LARGEST_STRAIN: f64 = 0.1;

impl ElementSite<'_, '_> {
    fn support(&mut self, held: [bool; 3]) -> Result<(), Reported> {
        let undercut = self.undercut()?;
        let [l, w, _] = [self.positive_if_any("l")?, self.positive_if_any("w")?, self.positive_if_any("h")?];
        let node = self.node(0);
        let angle = self.instance.rotation.angle();
        self.hold(node, held, angle, undercut);
        if let (Some(l), Some(w)) = (l, w) {
            let support = self.drawing.structure.supports.len() - 1;
            self.drawing.structure.pads.push(Pad { support, size: [l, w] });
        }
        Ok(())
    }

    /// Distance by which the pad is etched free at its edge (m), if the layer says so.
    fn undercut(&mut self) -> Result<Option<f64>, Reported> {
        match self.number("undercut")? {
            Some(undercut) if undercut < 0.0 => self.non_negative_or("undercut", 0.0).map(Some),
            given => Ok(given),
        }
    }

    /// How an anchor moves, if anything says so.
    fn motion(&mut self) -> Result<Option<AnchorMotion>, Reported> {
        let both = self.number("packagestrain")?;
        let strain = [self.number("packagestrainx")?.or(both), self.number("packagestrainy")?.or(both)];
        let displacement = [self.number("anchorx")?, self.number("anchory")?];
        for (name, strain) in ["packagestrainx", "packagestrainy"].into_iter().zip(strain) {
            if let Some(strain) = strain.filter(|strain| strain.abs() > LARGEST_STRAIN) {
                let given = if self.number(name)?.is_some() { name } else { "packagestrain" };
                return Err(self.out_of_range(given, strain, "at most 0.1"));
            }
        }
        let rotation = self.number("anchorrz")?;
        let driven = match self.number("moves")? {
            Some(moves) if moves != 0.0 && moves != 1.0 => return Err(self.out_of_range("moves", moves, "0 or 1")),
            given => given == Some(1.0),
        };
        let moves = driven || strain.iter().chain(&displacement).chain([&rotation]).any(Option::is_some);
        let or_none = |of: [Option<f64>; 2]| of.map(|x| x.unwrap_or(0.0));
        Ok(moves.then(|| AnchorMotion {
            strain: or_none(strain),
            displacement: or_none(displacement),
            rotation: rotation.unwrap_or(0.0),
            driven,
        }))
    }

    fn hold(&mut self, node: NodeId, held: [bool; 3], angle: f64, undercut: Option<f64>) {
        self.drawing.place(self.instance.span, &[node], &[[0.0; 2]]);
        let name = self.name();
        self.drawing.structure.supports.push(Support {
            name,
            node,
            held,
            angle,
            undercut,
            temperature: None,
            motion: None,
        });
    }
}

/// An anchor holds every node that it is given.
pub(super) fn anchor(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let first = site.drawing.structure.supports.len();
    site.support([true, true, true])?;
    let (angle, undercut) = (site.instance.rotation.angle(), site.undercut()?);
    for k in 1..site.instance.nodes.len() {
        site.hold(site.node(k), [true; 3], angle, undercut);
        site.drawing.note(Fact::AnchorNodes, site.instance.span);
    }
    let temperature = site.absolute("anchortemperature")?;
    let motion = site.motion()?;
    for support in &mut site.drawing.structure.supports[first..] {
        (support.temperature, support.motion) = (temperature, motion);
    }
    Ok(())
}

pub(super) fn hinge(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.support([true, true, false])
}

pub(super) fn slider(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.support([false, false, true])
}

/// SUGAR's pinjoint holds z only: nothing in the drawing plane.
pub(super) fn pinjoint(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.place(site.instance.span, &[site.node(0)], &[[0.0; 2]]);
    Ok(())
}

pub(super) fn guide2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.direction(site.instance.rotation)?;
    site.support([false, true, true])
}

/// slider2: a beam whose far end slides along a direction of the whole drawing, that of x turned by `sliderox slideroy slideroz`.
pub(super) fn slider2(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    let [ox, oy, oz] =
        [site.number_or("sliderox", 0.0)?, site.number_or("slideroy", 0.0)?, site.number_or("slideroz", 0.0)?];
    let slope = Rotation::IDENTITY.turned(ox, oy, oz);
    let angle = site.direction(slope)?;
    let width = site.etched("w")?;
    site.positive("l")?;
    site.add_beam(site.name(), [site.node(0), site.node(1)], width)?;
    site.hold(site.node(1), [false, true, false], angle, None);
    Ok(())
}

pub(super) fn pos(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let offset = [site.number_or("x", 0.0)?, site.number_or("y", 0.0)?, site.number_or("z", 0.0)?];
    let [x, y, _] = site.instance.rotation.apply(offset);
    site.drawing.lay(site.instance.span, &[site.node(0), site.node(1)], &[[0.0; 2], [x, y]]);
    Ok(())
}
