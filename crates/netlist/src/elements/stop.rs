//! Stops: how far a part may move.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::Stop;

/// Area on which a rigid stop bears unless it is given (m²): 10 µm by 10 µm.
const AREA: f64 = 1e-10;

/// stop2d: a may move by `gap` along local x, and by `back` against it, relative to b or to where it was drawn.
pub(super) fn stop2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let angle = site.direction(site.instance.rotation)?;
    let ways = [site.positive_if_any("gap")?, site.positive_if_any("back")?];
    if ways == [None; 2] {
        let message = "`stop2d` needs a way: `gap` or `back`, or both";
        return Err(site.error("E053", message.into(), "give `gap=` along local x, `back=` against it [m]"));
    }
    let stiffness = site.positive_if_any("k")?;
    let area = site.positive_if_any("A")?.unwrap_or(AREA);
    let impact = site.impact()?;
    let nodes = site.instance.nodes.clone();
    site.drawing.mechanical(&nodes);
    let name = site.name();
    let axis = [angle.cos(), angle.sin()];
    site.drawing.structure.stops.push(Stop {
        name,
        a: nodes[0],
        b: nodes.get(1).copied(),
        axis,
        ways,
        stiffness,
        area,
        impact,
    });
    Ok(())
}
