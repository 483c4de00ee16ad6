//! No result from beyond the law of contact: a part pressed further into another than the law knows is refused by name.
//! Combs have no contact at the ends of their fingers: fingers beyond them cause a warning. Neither have fingers that do not overlap.

use super::AnalysisError;
use bimorph_domains::Domain;
use bimorph_domains::domain::SideRoom;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;

/// Refuses a configuration in which a gap is closed beyond the range of its law, see [`bimorph_domains::contact`], or fingers of a comb lie aside of their gaps under a
/// voltage, where they do not overlap. `energised` says which gaps have one. Without it such fingers cause a warning, as those beyond the other side do.
///
/// # Errors
/// [`AnalysisError::ContactRange`] with the gap, [`AnalysisError::SidePullIn`] with the comb.
pub fn within_contact_range(
    compiled: &CompiledModel,
    q: &[Pose],
    energised: impl Fn(usize) -> bool,
) -> Result<(), AnalysisError> {
    let system = &compiled.parts.system;
    match system.overrun(q) {
        None => match comb_aside(compiled, q, energised) {
            None => Ok(()),
            Some((comb, [aside, room])) => Err(AnalysisError::SidePullIn { comb: comb.to_owned(), aside, room }),
        },
        Some((gap, [left, least])) => {
            Err(AnalysisError::ContactRange { gap: compiled.parts.gap_names[gap].clone(), left, least })
        }
    }
}

/// Of the combs among these gaps the one whose fingers lie beyond their gaps at `q` and do not overlap: its name, how far they lie aside and how far they can (m).
pub(crate) fn comb_aside<'a>(
    compiled: &'a CompiledModel,
    q: &[Pose],
    among: impl Fn(usize) -> bool,
) -> Option<(&'a str, [f64; 2])> {
    let system = &compiled.parts.system;
    let gaps = system.members.iter().zip(&compiled.parts.gap_names).enumerate().filter(|(g, _)| among(*g));
    let beyond = gaps.filter_map(|(gap, (member, name))| {
        let (across, SideRoom { drawn, room }) = member.side_room()?;
        let aside = (drawn + across.value(q, system.model.linear)).abs();
        (aside > room && system.side_contact(gap, q).is_none()).then_some((name.as_str(), [aside, room]))
    });
    beyond.max_by(|a, b| (a.1[0] - a.1[1]).total_cmp(&(b.1[0] - b.1[1])))
}

/// Warning about that comb.
pub(crate) fn comb_beyond_reported(compiled: &CompiledModel, q: &[Pose]) -> Option<String> {
    if let Some((name, [way, room])) = comb_beyond(compiled, q) {
        return Some(format!(
            "the comb `{name}` closes by {:.3} µm, and its fingers have {:.3} µm to the other side: nothing stops them there",
            1e6 * way,
            1e6 * room
        ));
    }
    let (name, [aside, room]) = comb_aside(compiled, q, |_| true)?;
    Some(format!(
        "the fingers of the comb `{name}` lie {:.3} µm aside of the middle of gaps that leave {:.3} µm, and do not overlap: nothing stops them there",
        1e6 * aside,
        1e6 * room
    ))
}

/// The comb whose fingers go furthest through the other side at `q`: its name, and how far its sides have come together of how
/// much they can (m).
pub(crate) fn comb_beyond<'a>(compiled: &'a CompiledModel, q: &[Pose]) -> Option<(&'a str, [f64; 2])> {
    let system = &compiled.parts.system;
    // combs are the first gaps, in their order
    let beyond = compiled.structure.combs.iter().zip(&system.members).filter_map(|(comb, gap)| {
        let (approach, _) = gap.law()?;
        let (way, room) = (approach.value(q, system.model.linear), comb.finger[0] - comb.overlap);
        (comb.finger[0] > 0.0 && way > room * (1.0 + 1e-9)).then_some((comb.name.as_str(), [way, room]))
    });
    beyond.max_by(|a, b| (a.1[0] - a.1[1]).total_cmp(&(b.1[0] - b.1[1])))
}
