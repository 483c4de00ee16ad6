//! Dead loads: f2d, f3d, and the pair of loads of a prestressed beam.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::Load;

/// Part of a force or moment that may point out of the plane, or of a moment that may lie in it, unsaid (1).
const NEGLIGIBLE: f64 = 1e-6;

pub(super) fn f2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let moment = site.number("M")?;
    add(site, moment.unwrap_or(0.0), moment.is_some())
}

/// f3d: force and moment both act along the local x axis.
pub(super) fn f3d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
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

fn add(site: &mut ElementSite<'_, '_>, moment: f64, moment_given: bool) -> Result<(), Reported> {
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

/// prestressedbeam: no beam, but the loads K22·q on its first node and −K22·q on its second. SUGAR applies them for a
/// beam whose end is displaced by q = (qx, qy, qoz in degrees). As in SUGAR, the moments do not balance the couple of
/// the forces.
pub(super) fn prestressed(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (l, w, h) = (site.positive("l")?, site.etched("w")?, site.positive("h")?);
    let modulus = site.material()?.youngs_modulus;
    let angle = site.direction(site.instance.rotation)?;
    let side = site.side()?;
    for across in ["qz", "qox", "qoy"] {
        if site.number_or(across, 0.0)? != 0.0 {
            let span = site.span_of(across);
            let message = format!("`{across}` acts out of the drawing plane and is left out");
            site.sink.warning("W020", span, message, "models are planar (x, y, rotation about z)");
        }
    }
    let (qx, qy) = (site.number_or("qx", 0.0)?, site.number_or("qy", 0.0)?);
    let qoz = site.number_or("qoz", 0.0)?.to_radians();
    let lean = site.lean()?;
    let bending = modulus * h * w * (w * w + lean * lean) / 12.0;
    let along = modulus * w * h / l * qx;
    let across = bending * (12.0 * qy / l.powi(3) - 6.0 * qoz / (l * l));
    let moment = bending * (4.0 * qoz / l - 6.0 * qy / (l * l));
    let (s, c) = angle.sin_cos();
    let force = [along * c - side * across * s, along * s + side * across * c];
    let nodes = [site.node(0), site.node(1)];
    site.drawing.mechanical(&nodes);
    for (node, sign) in nodes.into_iter().zip([1.0, -1.0]) {
        let (force, moment) = (force.map(|f| sign * f), sign * side * moment);
        site.drawing.structure.loads.push(Load { name: site.name(), node, force, moment });
    }
    Ok(())
}
