//! Stops: how far a part may move.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::{Adhesion, Friction, MAX_STICK_STIFFNESS, OhmicContact, Stop};

/// Area on which a rigid stop bears unless it is given (m²): 10 µm by 10 µm.
const AREA: f64 = 1e-10;

/// Range of the adhesion unless it is given (m).
const ADHESION_RANGE: f64 = 10e-9;
/// Speed below which parts stick unless it is given (m/s).
const SLIP_SPEED: f64 = 1e-5;

/// stop2d: a may move by `gap` along local x, and by `back` against it, relative to b or to where it was drawn.
pub(super) fn stop2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let angle = site.direction(site.instance.rotation)?;
    let ways = [site.etched_travel("gap")?, site.etched_travel("back")?];
    if ways == [None; 2] {
        let message = "`stop2d` needs a way: `gap` or `back`, or both";
        return Err(site.error("E053", message.into(), "give `gap=` along local x, `back=` against it [m]"));
    }
    let stiffness = site.positive_if_any("k")?;
    let area = site.positive_if_any("A")?.unwrap_or(AREA);
    let impact = site.impact()?;
    let ohmic = ohmic(site)?;
    let range = site.positive_if_any("adhesionrange")?.unwrap_or(ADHESION_RANGE);
    let adhesion = above_zero(site, "adhesion")?.map(|force| Adhesion { force, range });
    let slip_speed = site.positive_if_any("slipspeed")?.unwrap_or(SLIP_SPEED);
    let stick_stiffness = above_zero(site, "stickstiffness")?;
    if let Some(k) = stick_stiffness.filter(|k| *k > MAX_STICK_STIFFNESS) {
        return Err(site.out_of_range("stickstiffness", k, &format!("at most {MAX_STICK_STIFFNESS:e}")));
    }
    let coefficient = above_zero(site, "friction")?;
    if stick_stiffness.is_some() && site.number("friction")?.is_none() {
        return Err(site.missing("friction"));
    }
    let friction = coefficient.map(|coefficient| Friction { coefficient, slip_speed, stick_stiffness });
    if let Some(way) = ways.into_iter().flatten().find(|way| *way <= range && adhesion.is_some()) {
        return Err(site.out_of_range("adhesionrange", range, &format!("below the travel of {way:e} m")));
    }
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
        ohmic,
        impact,
        adhesion,
        friction,
    });
    Ok(())
}

/// A parameter that is zero, which is none, or positive.
fn above_zero(site: &mut ElementSite<'_, '_>, name: &str) -> Result<Option<f64>, Reported> {
    Ok(Some(site.non_negative_or(name, 0.0)?).filter(|x| *x > 0.0))
}

/// The metals of an ohmic contact, where `hardness` and `contactresistivity` are given.
fn ohmic(site: &mut ElementSite<'_, '_>) -> Result<Option<OhmicContact>, Reported> {
    let found = [site.positive_if_any("hardness")?, site.positive_if_any("contactresistivity")?];
    let electron_path = site.non_negative_or("electronpath", 0.0)?;
    let missing = match found {
        [Some(hardness), Some(resistivity)] => return Ok(Some(OhmicContact { hardness, resistivity, electron_path })),
        [None, Some(_)] => "hardness",
        [Some(_), None] => "contactresistivity",
        [None, None] if site.is_given("electronpath") => "hardness",
        [None, None] => return Ok(None),
    };
    Err(site.missing(missing))
}
