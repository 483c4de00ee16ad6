//! Dead loads: f2d and f3d.

use super::super::sink::Reported;
use super::arguments::Site;
use crate::structure::Load;

/// Part of a force or moment that may point out of the plane, or of a moment that may lie in it, unsaid [1].
const NEGLIGIBLE: f64 = 1e-6;

pub(super) fn f2d(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let moment = site.number("M")?;
    add(site, moment.unwrap_or(0.0), moment.is_some())
}

/// f3d: force and moment both act along the local x axis.
pub(super) fn f3d(site: &mut Site<'_, '_>) -> Result<(), Reported> {
    let moment = site.number("M")?;
    let along_z = site.instance.rotation.x_axis()[2];
    if let Some(m) = moment
        && m != 0.0
        && along_z.abs() < 1.0 - NEGLIGIBLE
    {
        let span = site.span_of("M");
        let message = "this moment does not act about z: only its z part is kept".to_owned();
        site.sink.warning("W020", span, message, "for a moment about z turn it with `oy=-pi/2`, or use `f2d`");
    }
    add(site, moment.unwrap_or(0.0) * along_z, moment.is_some())
}

fn add(site: &mut Site<'_, '_>, moment: f64, moment_given: bool) -> Result<(), Reported> {
    let force = site.number("F")?;
    if force.is_none() && !moment_given {
        let message = format!("`{}` has neither `F` (force [N]) nor `M` (moment [N·m])", site.instance.model);
        return Err(site.error("E053", message, "give `F=` or `M=`"));
    }
    let force = force.unwrap_or(0.0);
    let [x, y, z] = site.instance.rotation.x_axis();
    if force != 0.0 && z.abs() > NEGLIGIBLE {
        let span = site.span_of("F");
        let message = "this force points out of the drawing plane: only its in-plane part is kept".to_owned();
        site.sink.warning("W020", span, message, "models are planar (x, y, rotation about z)");
    }
    let node = site.node(0);
    site.drawing.mechanical(&[node]);
    site.drawing.structure.loads.push(Load { name: site.name(), node, force: [force * x, force * y], moment });
    Ok(())
}
