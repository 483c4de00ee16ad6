//! Mass of points that have none and that contacts act on.
//!
//! A point without mass follows the force on it at once. Contact forces begin with the fourth power of the penetration and depend on its rate,
//! so that no step in time is short enough for such a point. With `rotary_inertia`, which runs of parts that may touch have, it gets
//! a millionth of the mass of all bodies.

use crate::options::CompileOptions;
use bimorph_domains::domain::Domain;
use bimorph_domains::from_structure::PlacedMember;
use bimorph_domains::member::Member;
use bimorph_multibody::{Body, BodyId};

/// Mass of such a point, of that of all bodies (1).
const LIGHT: f64 = 1e-6;

/// The bodies, with some mass where they have none and a contact of `members` acts on them.
pub(super) fn weighed(
    mut bodies: Vec<Body>,
    members: &[PlacedMember<'_, Member>],
    options: &CompileOptions,
) -> Vec<Body> {
    if !options.rotary_inertia {
        return bodies;
    }
    let light = LIGHT * bodies.iter().map(|body| body.mass).sum::<f64>();
    let touches = |member: &Member| member.touching().is_some() || member.side_room().is_some();
    for laid in members.iter().filter(|laid| touches(&laid.member)) {
        laid.member.bodies(|id| match id {
            BodyId::Free(k) if bodies[k].mass == 0.0 => bodies[k].mass = light,
            _ => {}
        });
    }
    bodies
}
