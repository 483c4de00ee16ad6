//! Why no equilibrium was found, as a physical reason where one can be measured.

use super::fall::FallFailure;
use super::loss::MAX_LOSSES;
use super::{Equilibrium, Path};
use crate::SolveError;
use bimorph_domains::domain::SideRoom;
use bimorph_domains::{BeamLine, Domain, System};
use bimorph_multibody::BodyId;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::Pose;
use std::sync::Arc;

/// Compliance ratio above which a body counts as unsupported.
const UNSUPPORTED_COMPLIANCE_RATIO: f64 = 1e8;
/// Rotation of the end of a segment from its chord beyond which its law means nothing (rad).
const TURNED: f64 = 1.0;
/// Rotation of an end of a segment from its chord, and between its ends, beyond which a refusal suggests shorter
/// segments (rad).
const COARSE: [f64; 2] = [0.7, 1.0];
/// Axial strain beyond which a segment is no beam (1).
const CRUSHED: f64 = 0.3;
/// Bending strain beyond which a segment is no beam (1): its radius is less than half its width.
const OVERBENT: f64 = 1.0;
/// Turn along a beam beyond which it has a loop (rad); a hairpin has π.
const WOUND: f64 = 1.5 * std::f64::consts::PI;
/// Longest displacement of a part that is still there, in lengths of the longest beam.
const GONE: f64 = 100.0;

impl Equilibrium {
    /// The reason why the search ended at the displacement `q` beyond the last stable equilibrium at `share`.
    pub(super) fn lost(
        &mut self,
        system: &System,
        share: f64,
        why: FallFailure,
        done: &Path,
        q: &[Pose],
    ) -> SolveError {
        let coarse = Self::coarse_beams(system, q);
        let first = Self::fingers_aside(system, q).or_else(|| self.touching_without_contact(system, q));
        if first.is_none()
            && let Some(reason) = Self::overbent(system, q)
        {
            return Self::refused(share, done, (reason, true), coarse);
        }
        let reason = first
            .or_else(|| Self::beyond_beams(system, q))
            .or_else(|| self.unheld(system, q))
            .or_else(|| self.gone(system, q))
            .or_else(|| Self::folded(system, &coarse))
            .unwrap_or_else(|| self.unsettled(system, why, q));
        Self::refused(share, done, (reason, false), coarse)
    }

    /// A load that is far more than the part bears.
    pub(super) fn too_far(&self, system: &System, share: f64, done: &Path, at: Option<ZeroPivot>) -> SolveError {
        let body = at.map_or(String::new(), |pivot| system.model.bodies[pivot.body].name.to_string());
        let reason = format!(
            "\"{body}\" is deformed so far there that rounding hides what resists it: the load is too large for this part"
        );
        Self::refused(share, done, (reason, false), Vec::new())
    }

    /// A path that loses stability again and again.
    pub(super) fn too_many(share: f64, done: &Path) -> SolveError {
        let reason = format!(
            "{MAX_LOSSES} stability losses lie below that load, as where a part is crumpled: the load is far beyond what the part bears"
        );
        Self::refused(share, done, (reason, false), Vec::new())
    }

    /// The error, with the reason and whether that is a beam bent to a radius below half its width.
    fn refused(share: f64, done: &Path, (reason, overbent): (String, bool), coarse: Vec<usize>) -> SolveError {
        let first = done.passed.first().map(|passed| passed.share);
        let passed = first.map_or(String::new(), |first| {
            format!(" (the part as drawn loses its stability at {first:.4} of the load)")
        });
        SolveError::Lost { share, passed, reason, coarse, overbent }
    }

    fn fingers_aside(system: &System, q: &[Pose]) -> Option<String> {
        let name = |id: BodyId| match id {
            BodyId::Free(k) => system.model.bodies[k].name.to_string(),
            BodyId::Ground => String::new(),
        };
        system.members.iter().enumerate().find_map(|(gap, member)| {
            let (across, SideRoom { drawn, room }) = member.side_room()?;
            let aside = (drawn + across.value(q, system.model.linear)).abs();
            // sides that face each other bear
            (aside > room && system.side_contact(gap, q).is_none()).then(|| {
                let part = [across.a.body, across.b.body].map(name).concat();
                format!(
                    "the fingers of the comb at \"{part}\" are drawn aside of their gaps where they do not overlap: the side force exceeds what holds them (a \
                     stiffer part across the fingers, wider gaps, or a `stop2d`)"
                )
            })
        })
    }

    fn touching_without_contact(&self, system: &System, q: &[Pose]) -> Option<String> {
        (0..system.members.len())
            .find(|&gap| {
                let member = &system.members[gap];
                member.is_electrostatic()
                    && member.touching().is_none()
                    && system.distance(gap, q) <= 0.1 * system.distance(gap, &self.before)
            })
            .map(|_| "two electrodes touch and no contact is declared".into())
    }

    /// The segment that is farthest beyond what a beam segment describes, in words; none where all are beams.
    pub fn beyond_beams(system: &System, q: &[Pose]) -> Option<String> {
        let linear = system.model.linear;
        if linear {
            return None;
        }
        let states = system.beams.iter().flat_map(|beam| {
            (0..beam.segments()).filter_map(move |k| {
                let state = beam.segment(k, q, linear);
                let turn = state.turns[0].abs().max(state.turns[1].abs());
                let over = (turn / TURNED).max(state.strain.abs() / CRUSHED);
                (over > 1.0).then_some((over, beam, k, turn, state.strain))
            })
        });
        let (_, beam, k, turn, strain) = states.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let place = format!("segment {} of beam {}", k + 1, beam.name);
        Some(if turn > TURNED {
            format!(
                "{place} is turned {:.0}° from its chord where the search ended: finer segments are needed (--segments), or the load is beyond \
                 beams (strain {strain:.2})",
                turn.to_degrees()
            )
        } else {
            format!("{place} comes to a strain of {strain:.2} where the search ended: the load is beyond beams")
        })
    }

    /// The segment whose radius is farthest below half the width of its beam, in words: strains of 1, whatever the law of a segment says.
    fn overbent(system: &System, q: &[Pose]) -> Option<String> {
        let linear = system.model.linear;
        let curvature = |beam: &BeamLine, k: usize| {
            let [a, b] = beam.segment(k, q, linear).turns;
            (a - b).abs() / beam.segment_length()
        };
        let all = system.beams.iter().filter(|_| !linear).flat_map(|beam| (0..beam.segments()).map(move |k| (beam, k)));
        let bent = all.map(|(beam, k)| (0.5 * beam.width * curvature(beam, k), beam, k));
        let (_, beam, k) = bent.filter(|(bent, ..)| *bent > OVERBENT).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            "segment {} of beam {} is bent to a radius of {:.2e} m where the search ended, less than half its width of {:.2e} m: the load is \
             beyond beams",
            k + 1,
            beam.name,
            1.0 / curvature(beam, k),
            beam.width
        ))
    }

    /// Beams with segments that bend farther than their law describes well, by index.
    pub fn coarse_beams(system: &System, q: &[Pose]) -> Vec<usize> {
        let linear = system.model.linear;
        let bends = |beam: &BeamLine, k: usize| {
            let [a, b] = beam.segment(k, q, linear).turns;
            a.abs().max(b.abs()) > COARSE[0] || (a - b).abs() > COARSE[1]
        };
        let coarse = |beam: &BeamLine| !linear && (0..beam.segments()).any(|k| bends(beam, k));
        system.beams.iter().enumerate().filter(|(_, beam)| coarse(beam)).map(|(k, _)| k).collect()
    }

    fn folded(system: &System, coarse: &[usize]) -> Option<String> {
        let beam = &system.beams[*coarse.first()?].name;
        Some(format!(
            "beam {beam} folds within a segment where the search ended: finer segments are needed (--segments), or the load is beyond beams"
        ))
    }

    fn gone(&self, system: &System, q: &[Pose]) -> Option<String> {
        let size = system.beams.iter().map(|beam| beam.length).fold(system.length_scale, f64::max);
        let moved = |body: &usize| q[*body].x.hypot(q[*body].y);
        let body = (0..q.len())
            .max_by(|a, b| moved(a).total_cmp(&moved(b)))
            .filter(|b| moved(b).is_nan() || moved(b) >= GONE * size)?;
        let name = &system.model.bodies[body].name;
        Some(format!("\"{name}\" moves away without end: nothing that this load cannot overcome holds it"))
    }

    fn unsettled(&mut self, system: &System, why: FallFailure, q: &[Pose]) -> String {
        if let (FallFailure::Budget, Some((beam, turn))) = (why, Self::wound(system, q)) {
            return format!(
                "beyond it beam {beam} winds up, by {:.0}° along its length where the search ended: a loop slides along its beam with next to no \
                 resistance, so that nothing holds it",
                turn.to_degrees()
            );
        }
        system.residual(q, &self.drive, &mut self.residual);
        let size = |body: &usize| self.residual[*body].amax();
        let worst = (0..self.residual.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
        let name = system.model.bodies.get(worst).map_or(String::new(), |body| body.name.to_string());
        let force = self.residual.get(worst).map_or(0.0, |r| r.amax());
        match why {
            FallFailure::Budget => format!(
                "beyond it the part falls on and on, farthest from equilibrium at \"{name}\" ({force:.1e} N): no stable equilibrium near"
            ),
            FallFailure::Stuck => format!(
                "beyond it rounding hides which way the energy falls, farthest from equilibrium at \"{name}\" ({force:.1e} N): the stiffness of \
                 its parts differs too much, or the load is beyond beams"
            ),
        }
    }

    /// The beam that turns farthest along its length, by how much (rad), where that makes a loop.
    fn wound(system: &System, q: &[Pose]) -> Option<(Arc<str>, f64)> {
        let turn = |beam: &BeamLine| {
            let turns = beam.points.iter().map(|point| point.rotation(q));
            let [least, most] = turns.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(z), b.max(z)]);
            most - least
        };
        let turned = system.beams.iter().map(|beam| (beam.name.clone(), turn(beam)));
        turned.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, turn)| *turn > WOUND)
    }

    /// Names the body of largest compliance under a force on every body, if it exceeds most by far.
    fn unheld(&mut self, system: &System, q: &[Pose]) -> Option<String> {
        let model = &system.model;
        system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
        model.project_matrix(&mut self.tangent);
        model.factor_holding(&mut self.tangent, &mut self.held).ok()?;
        for (j, x) in self.step.iter_mut().enumerate() {
            *x = Pose::new(1.0, 1.0 + 0.1 * (j % 7) as f64, 0.0);
        }
        model.project(&mut self.step);
        self.tangent.solve(&model.pattern, &mut self.step);
        let moved: Vec<f64> = self.step.iter().map(|p| p.x.hypot(p.y)).collect();
        let mut sorted = moved.clone();
        sorted.sort_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2].max(f64::MIN_POSITIVE);
        // the middle body may have the same slender supports: then all are soft, and the stiffest is the reference
        let stiff = sorted[sorted.len() / 20].max(f64::MIN_POSITIVE);
        let softest = (0..moved.len()).max_by(|&a, &b| moved[a].total_cmp(&moved[b])).unwrap_or(0);
        let over = moved[softest] / typical.min(stiff);
        if over < UNSUPPORTED_COMPLIANCE_RATIO {
            return None;
        }
        let name = &model.bodies[softest].name;
        Some(format!(
            "the part with \"{name}\" is nearly unsupported: it is {over:.0e} times as compliant as supported parts"
        ))
    }
}
