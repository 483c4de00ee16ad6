//! The law of a point of a gap at an approach and its rate: its force with the derivatives.

use bimorph_domains::PointLaw;
use bimorph_domains::comb_sides::CombLaw;

/// A point of a gap that has its share in shapes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PointState {
    pub(super) approach: f64,
    /// Force of its law, its gas and its loss, and their derivatives with the approach and with its rate.
    pub(super) force: f64,
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// Of a comb: derivative of its force with the next approach, and of the next force with its own.
    pub(super) mixed: [f64; 2],
}

impl PointState {
    /// Both of a comb with the impact loss χ at its approaches (m) with their rates (m/s), under a voltage (V). Its contact resists across the fingers.
    #[inline]
    pub(super) fn of_comb((comb, loss): (&CombLaw, f64), motion: [(f64, f64); 2], volts: f64) -> [Self; 2] {
        let at = [motion[0].0, motion[1].0];
        let potential = comb.potential(at, volts);
        let [along, mixed, across] = potential.second;
        let state = |k: usize, stiffness: f64| Self {
            approach: at[k],
            force: potential.first[k],
            stiffness,
            ..Self::default()
        };
        let mut both = [Self { mixed: [mixed; 2], ..state(0, along) }, state(1, across)];
        if loss > 0.0
            && let Some(pressed) = comb.pressed(at)
        {
            let force = pressed.first[1];
            let (added, by_rate) = lost(loss, force.signum() * motion[1].1);
            both[1].force += force * added;
            both[1].stiffness += pressed.second[2] * added;
            both[1].damping = force.abs() * by_rate;
            both[0].mixed[1] += pressed.second[1] * added;
        }
        both
    }

    /// Of a law at an approach (m) with its rate (m/s), under a voltage (V).
    #[inline]
    pub(super) fn of(law: &PointLaw, (approach, rate): (f64, f64), volts: f64) -> Self {
        let pressed = law.at(approach, volts);
        let mut state = Self { approach, force: pressed.force, stiffness: pressed.stiffness, ..Self::default() };
        if law.loss > 0.0 {
            let bears = law.at(approach, 0.0);
            let (share, by_rate) = lost(law.loss, rate);
            state.force += bears.force * share;
            state.stiffness += bears.stiffness * share;
            state.damping += bears.force * by_rate;
        }
        if let Some((drawn, film)) = law.film {
            let (damping, by_distance) = film.damping(drawn - approach);
            state.force += damping * rate;
            state.stiffness -= by_distance * rate;
            state.damping += damping;
        }
        state
    }
}

/// Force of an impact loss χ (s/m) at a closing speed (m/s) over the elastic force, and its derivative with the speed.
#[inline]
fn lost(chi: f64, closing: f64) -> (f64, f64) {
    let added = chi * closing;
    if added > -1.0 { (added, chi) } else { (-1.0, 0.0) }
}
