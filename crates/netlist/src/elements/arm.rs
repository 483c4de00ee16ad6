//! Members between two rigid arms, as beam3dlink has them: a → arm 1 (L1 along R·R₁·x) → member → arm 2 (L2 along R·R₂·x) → b.
//!
//! A negative length turns its arm round. Offsets of an arm normal to the drawing plane are omitted: they change the
//! member's height and nothing in the plane.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::arguments::ElementSite;
use bimorph_structure::{Link, NodeId};

/// Standard gravity (m/s²).
const GRAVITY: f64 = 9.806_65;
/// Arms whose in-plane length is below this fraction of their length are ignored (1).
const SEEN: f64 = 1e-9;

impl ElementSite<'_, '_> {
    /// The vector of arm `number` (m), global axes; zero without a length.
    pub(super) fn arm(&mut self, number: usize) -> Result<[f64; 3], Reported> {
        let length = self.number_or(if number == 1 { "L1" } else { "L2" }, 0.0)?;
        let [ox, oy, oz] = [format!("ox{number}"), format!("oy{number}"), format!("oz{number}")];
        let (ox, oy, oz) = (self.number_or(&ox, 0.0)?, self.number_or(&oy, 0.0)?, self.number_or(&oz, 0.0)?);
        Ok(self.instance.rotation.turned(ox, oy, oz).apply([length, 0.0, 0.0]))
    }

    /// Builds arm 1, what `member` adds between the two given nodes, and arm 2.
    pub(super) fn between_arms(
        &mut self,
        member: impl FnOnce(&mut Self, [NodeId; 2]) -> Result<(), Reported>,
    ) -> Result<(), Reported> {
        let (a, b) = (self.node(0), self.node(1));
        let arms = [self.arm(1)?, self.arm(2)?];
        let seen = arms.map(|[x, y, z]| x.hypot(y) > SEEN * x.hypot(y).hypot(z));
        let mut node = |end: &str, seen: bool, otherwise| {
            let name = || format!("{}.{end}", self.instance.name);
            if seen { self.drawing.add_node(name(), self.instance.span) } else { otherwise }
        };
        let (p, q) = (node("start", seen[0], a), node("end", seen[1], b));
        if seen[0] {
            self.add_link(format!("{}.arm1", self.instance.name), a, p, [arms[0][0], arms[0][1]]);
        }
        member(self, [p, q])?;
        if seen[1] {
            self.add_link(format!("{}.arm2", self.instance.name), q, b, [arms[1][0], arms[1][1]]);
        }
        Ok(())
    }

    /// Adds a rigid, massless link whose second node lies at `offset` (m) from the first.
    pub(super) fn add_link(&mut self, name: String, a: NodeId, b: NodeId, offset: [f64; 2]) {
        self.drawing.place(self.instance.span, &[a, b], &[[0.0; 2], offset]);
        self.drawing.structure.links.push(Link { name, a, b });
    }
}

/// beam3dlink and its kin: a beam between two rigid arms.
pub(super) fn beam3dlink(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    if site.has_no_section()? {
        return tracer(site);
    }
    let width = site.etched("w")?;
    let length = site.positive("l")?;
    if site.leaves_plane() {
        let beam = site.instance.rotation.apply([length, 0.0, 0.0]);
        let (first, second) = (site.arm(1)?, site.arm(2)?);
        let offset = std::array::from_fn(|i| first[i] + beam[i] + second[i]);
        return site.upright(site.name(), [site.node(0), site.node(1)], width, offset);
    }
    site.between_arms(|site, ends| site.add_beam(site.name(), ends, width))
}

/// beam_link_grav: the same with its weight, which is left out.
pub(super) fn beam_link_grav(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let volume = site.positive("l")? * site.etched("w")? * site.positive("h")?;
    let weight = GRAVITY * volume * site.density()?;
    site.drawing.note_number(Fact::Weight, site.instance.span, weight);
    beam3dlink(site)
}

/// tracer: a conductor that is drawn between two nodes and neither holds nor weighs; it places them.
pub(super) fn tracer(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let length = site.positive("l")?;
    let along = site.instance.rotation.apply([length, 0.0, 0.0]);
    let (first, second) = (site.arm(1)?, site.arm(2)?);
    let way = [0, 1].map(|i| first[i] + along[i] + second[i]);
    site.drawing.lay(site.instance.span, &[site.node(0), site.node(1)], &[[0.0; 2], way]);
    Ok(())
}

/// rigidlinkbeam: the same, where SUGAR's places its node b as if it had no arms.
pub(super) fn rigidlinkbeam(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let reach = site.number_or("L1", 0.0)?.abs().max(site.number_or("L2", 0.0)?.abs());
    if reach > 0.0 {
        site.drawing.note_number(Fact::ArmsPlace, site.instance.span, reach);
    }
    beam3dlink(site)
}
