//! The closed branch: up to the largest voltage, through further snaps, and down from the last of them to release.

use super::super::AnalysisError;
use super::super::contact_range::within_contact_range;
use super::sweep::{MAX_LIMIT_POINTS, PAST, VoltageSweep, last, named};
use bimorph_multibody::planar::Pose;
use bimorph_solve::continuation::PathEnd;

/// Longest upward step of the voltage, as a fraction of the voltage: pressed parts move little.
const UPWARDS: f64 = 0.5;
/// Releases that differ by less than this fraction are one (1).
const RELEASE_TOLERANCE: f64 = 1e-6;

/// Release of a closed part.
pub(super) struct ReleaseVoltages {
    /// Voltage at which the last of the closed gaps opens (V); none: it is closed without any.
    pub(super) release_v: Option<f64>,
    /// Voltages at which it snaps further (V).
    pub(super) snaps_v: Vec<f64>,
    /// Release without the last of those snaps (V).
    pub(super) release_before_snaps_v: Option<f64>,
}

impl VoltageSweep<'_> {
    /// From the state `q` at `volts`, to which pull-in leads, up to `max` and down to release.
    pub(super) fn held_down(&mut self, q: Vec<Pose>, volts: f64, max: f64) -> Result<ReleaseVoltages, AnalysisError> {
        let (snaps_v, top) = self.climb(q.clone(), volts, max)?;
        let Some((top_volts, top)) = top else {
            let release_v = self.release(q, volts)?;
            return Ok(ReleaseVoltages { release_v, snaps_v, release_before_snaps_v: None });
        };
        let known = self.of_closed.len();
        let before = self.release(q, volts);
        self.of_closed.truncate(known);
        let release_v = self.release(top, top_volts)?;
        // a way down that was not found says nothing of the one that counts
        let before = before.ok().flatten();
        let differs = match (before, release_v) {
            (Some(a), Some(b)) => (a - b).abs() > RELEASE_TOLERANCE * a.max(b),
            (a, b) => a != b,
        };
        let without = before.map_or("stays closed".to_owned(), |v| format!("is released at {v:.4} V"));
        let sentence = match differs {
            true => format!("the closed part snaps further at {}; without that it {without}", named(&snaps_v)),
            false => {
                format!("the closed part snaps further at {}; it is released at the same voltage", named(&snaps_v))
            }
        };
        self.of_closed.push(sentence);
        Ok(ReleaseVoltages { release_v, snaps_v, release_before_snaps_v: before })
    }

    /// The voltages below `max` at which the closed part snaps further, and the state beyond the last of them with its voltage.
    /// The way up ends where the law of contact does.
    #[allow(clippy::type_complexity)]
    fn climb(
        &mut self,
        mut q: Vec<Pose>,
        mut volts: f64,
        max: f64,
    ) -> Result<(Vec<f64>, Option<(f64, Vec<Pose>)>), AnalysisError> {
        let (mut snaps, mut top) = (Vec::new(), None);
        for _ in 0..MAX_LIMIT_POINTS {
            if volts >= max {
                break;
            }
            // measured in the voltage that holds it
            let traced = self.trace_by(UPWARDS, &q, [volts, 2.0 * volts], max / volts - 1.0)?;
            if traced.end == PathEnd::Arrived
                || traced
                    .points
                    .iter()
                    .any(|p| within_contact_range(self.compiled, &p.q, |gap| self.drives(gap)).is_err())
            {
                break;
            }
            let (s, before) = last(&traced);
            let limit = volts * (1.0 + s);
            let beyond = limit * (1.0 + PAST);
            q.copy_from_slice(&before);
            let lost = traced.end != PathEnd::Unstable;
            if beyond >= max
                || self.fall(&mut q, beyond).is_err()
                || within_contact_range(self.compiled, &q, |gap| self.drives(gap)).is_err()
            {
                if lost && beyond < max {
                    self.of_closed.push(format!(
                        "the closed branch was followed up to {limit:.4} V only: what snaps beyond is not known"
                    ));
                }
                break;
            }
            if !lost {
                snaps.push(limit);
                top = Some((beyond, q.clone()));
            }
            volts = beyond;
        }
        Ok((snaps, top))
    }

    /// From the closed state `q` at `volts` down to where none of the gaps touches any more that do there and not at rest.
    fn release(&mut self, mut q: Vec<Pose>, mut volts: f64) -> Result<Option<f64>, AnalysisError> {
        let system = self.system;
        let made: Vec<usize> = (0..self.rest.len()).filter(|&g| !self.rest[g] && system.touches(g, &q)).collect();
        let free = |q: &[Pose]| made.iter().all(|&g| !system.touches(g, q));
        let mut peeled = Vec::new();
        for _ in 0..MAX_LIMIT_POINTS {
            let traced = self.trace(&q, volts, 0.0, 1.0)?;
            let at = |s: f64| volts * (1.0 - s);
            if let Some(k) = traced.points.iter().position(|p| free(&p.q)) {
                // contact is lost without a fold
                let (before, after) = (&traced.points[k.saturating_sub(1)], &traced.points[k]);
                self.peels(&peeled);
                return Ok(Some(self.sharpen(&before.q, at(before.s), at(after.s), |q| !free(q))));
            }
            if traced.end == PathEnd::Arrived {
                self.peels(&peeled);
                return Ok(None);
            }
            let (s, before) = last(&traced);
            let fold = at(s);
            q.copy_from_slice(&before);
            let beyond = fold * (1.0 - PAST);
            self.fall(&mut q, beyond)?;
            let lost = traced.end != PathEnd::Unstable;
            if free(&q) {
                self.peels(&peeled);
                return Ok(Some(if lost { self.sharpen(&before, fold, beyond, |q| !free(q)) } else { fold }));
            }
            peeled.extend((!lost).then_some(fold));
            volts = beyond;
        }
        Err(AnalysisError::NoEquilibrium {
            detail: format!("no release found after {MAX_LIMIT_POINTS} folds of the closed branch"),
            coarse: Vec::new(),
            overbent: false,
        })
    }

    /// Notes where the part opened in part on its way down.
    fn peels(&mut self, volts: &[f64]) {
        if !volts.is_empty() {
            self.of_closed.push(format!("on the way down it opens in part at {}", named(volts)));
        }
    }
}
