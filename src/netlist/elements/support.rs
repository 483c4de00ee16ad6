//! What holds nodes: anchors, hinges, sliders, guides; and `pos`, which only places them.

use super::super::sink::Reported;
use super::arguments::Site;
use crate::structure::Support;

impl Site<'_, '_> {
    fn support(&mut self, held: [bool; 3]) -> Result<(), Reported> {
        for size in ["l", "w", "h"] {
            self.positive_if_any(size)?;
        }
        let node = self.node(0);
        let angle = self.instance.rotation.angle();
        self.drawing.place(self.instance.span, &[node], &[[0.0; 2]]);
        self.drawing.structure.supports.push(Support { name: self.name(), node, held, angle });
        Ok(())
    }
}

pub(super) fn anchor(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.support([true, true, true])
}

pub(super) fn hinge(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.support([true, true, false])
}

pub(super) fn slider(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.support([false, false, true])
}

/// SUGAR's pinjoint holds z only: nothing in the drawing plane.
pub(super) fn pinjoint(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.drawing.place(site.instance.span, &[site.node(0)], &[[0.0; 2]]);
    Ok(())
}

pub(super) fn guide2d(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    site.direction(site.instance.rotation)?;
    site.support([false, true, true])
}

pub(super) fn pos(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let offset = [site.number_or("x", 0.0)?, site.number_or("y", 0.0)?, site.number_or("z", 0.0)?];
    let [x, y, _] = site.instance.rotation.apply(offset);
    site.drawing.lay(site.instance.span, &[site.node(0), site.node(1)], &[[0.0; 2], [x, y]]);
    Ok(())
}
