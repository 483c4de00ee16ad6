//! The states of a session as bytes, and back: the open request, and every stored state in order of last use.
//!
//! Little-endian words; numbers as the bits of their doubles, so that a restored device is bit-identical to the
//! original. Reading trusts nothing: lengths are bounded by the bytes that are there, and sizes by the model's.

use super::contract::{Agitation, DeviceError, OpenRequest, Token, refused};
use super::macro_step::{DisplayOffset, MacroStep, MacroStepPosition, PeakMotion, SquareExtrapolation};
use super::states::{Snapshot, States};
use super::step_history::StepHistory;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

/// Magic bytes: a name and the version of this format.
const HEAD: [u8; 8] = *b"bimorph\x06";
/// Those of states of a reduced model: the same behind the name of its coordinates.
const HEAD_REDUCED: [u8; 8] = *b"bimorph\x07";
/// Those of format 4, whose states of a reduced model lie in no macro steps.
const HEAD_4: [u8; 8] = *b"bimorph\x04";
/// Those of format 3, whose states lie in no macro steps.
const HEAD_3: [u8; 8] = *b"bimorph\x03";
/// Those of format 2, whose histories of steps count no alternations and whose states have no anchors.
const HEAD_2: [u8; 8] = *b"bimorph\x02";

/// Writes what is open and its states; `tag` names the coordinates of a reduced model.
pub(super) fn write(opened: &OpenRequest, states: &States, tag: Option<u64>) -> Vec<u8> {
    match tag {
        None => write_format(&HEAD, StepHistory::PARTS, opened, states),
        Some(tag) => {
            let head = [HEAD_REDUCED, tag.to_le_bytes()].concat();
            write_format(&head, StepHistory::PARTS, opened, states)
        }
    }
}

/// The same with `head`, and the first `parts` of each history; anchors with all of them.
fn write_format(head: &[u8], parts: usize, opened: &OpenRequest, states: &States) -> Vec<u8> {
    let mut out = SnapshotWriter(head.to_vec());
    for names in [&opened.ports, &opened.signals] {
        out.count(names.len());
        for name in names {
            out.count(name.len());
            out.0.extend(name.as_bytes());
        }
    }
    out.word(opened.noise.is_some().into());
    if let Some(noise) = &opened.noise {
        out.word(noise.seed);
        out.word(noise.band.map_or(0, f64::to_bits));
    }
    out.count(states.len());
    for (token, parent, state) in states.in_order() {
        out.word(token.0);
        out.word(parent.map_or(0, |token| token.0));
        out.poses(&state.q);
        out.poses(&state.v);
        out.numbers(&state.rise);
        out.numbers(&state.sources);
        if parts == StepHistory::PARTS {
            out.numbers(&state.anchors);
        }
        out.word(state.next_step.to_bits());
        out.word(state.elapsed.to_bits());
        for numbers in &state.shown.numbers()[..parts] {
            out.numbers(numbers);
        }
        out.count(state.carried.len());
        for motion in &state.carried {
            out.poses(&motion.q);
            out.poses(&motion.v);
        }
        if head.starts_with(&HEAD) || head.starts_with(&HEAD_REDUCED) {
            out.multirate(state);
        }
    }
    out.0
}

/// Reads them back.
///
/// # Errors
/// [`DeviceError::BadRequest`] for bytes that [`write`] has not made.
pub(super) fn read(bytes: &[u8]) -> Result<(OpenRequest, States, Option<u64>), DeviceError> {
    let mut from = SnapshotReader(bytes);
    let read = from.all();
    match read {
        Some(read) if from.0.is_empty() => Ok(read),
        _ => Err(refused("the bytes of a snapshot", "something else, or a part of one")),
    }
}

struct SnapshotWriter(Vec<u8>);

impl SnapshotWriter {
    fn word(&mut self, word: u64) {
        self.0.extend(word.to_le_bytes());
    }

    fn count(&mut self, count: usize) {
        self.word(count as u64);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.count(numbers.len());
        numbers.iter().for_each(|x| self.word(x.to_bits()));
    }

    /// Multirate integration of a state.
    fn multirate(&mut self, state: &Snapshot) {
        self.word(state.pause.into());
        self.peak(state.peak);
        self.poses(&state.origin);
        self.word(state.offset.is_some().into());
        if let Some(DisplayOffset { start, length, elapsed }) = state.offset.as_deref() {
            [&start.q, &start.v].iter().for_each(|poses| self.poses(poses));
            [length, elapsed].iter().for_each(|x| self.word(x.to_bits()));
        }
        self.word(state.macro_step.is_some().into());
        let Some(MacroStepPosition { step, elapsed, points, integrals }) = state.macro_step.as_deref() else { return };
        self.word(step.start.0);
        [&step.motion, &step.displayed].iter().flat_map(|m| [&m.q, &m.v]).for_each(|poses| self.poses(poses));
        self.numbers(&step.sources);
        self.count(step.extrapolations.len());
        for SquareExtrapolation { mean, value, slope, is_linear } in &step.extrapolations {
            [mean, value, slope].iter().for_each(|x| self.word(x.to_bits()));
            self.word((*is_linear).into());
        }
        self.peak(step.peak);
        self.word(step.history.into());
        self.word(step.trial_step.to_bits());
        self.word(elapsed.to_bits());
        self.word((*points).into());
        self.count(integrals.len());
        integrals.as_flattened().iter().for_each(|x| self.word(x.to_bits()));
    }

    fn peak(&mut self, PeakMotion { displacement, rate }: PeakMotion) {
        self.word(displacement.to_bits());
        self.word(rate.to_bits());
    }

    fn poses(&mut self, poses: &[Pose]) {
        self.count(poses.len());
        poses.iter().flat_map(|pose| pose.iter()).for_each(|x| self.word(x.to_bits()));
    }
}

/// Remaining bytes; every read returns `None` for invalid bytes.
struct SnapshotReader<'a>(&'a [u8]);

impl SnapshotReader<'_> {
    fn all(&mut self) -> Option<(OpenRequest, States, Option<u64>)> {
        let (head, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        let is_multirate = [HEAD, HEAD_REDUCED].contains(head);
        let (parts, tag) = match *head {
            HEAD | HEAD_3 => (StepHistory::PARTS, None),
            HEAD_REDUCED | HEAD_4 => (StepHistory::PARTS, Some(self.word()?)),
            HEAD_2 => (StepHistory::PARTS_OF_FORMAT_2, None),
            _ => return None,
        };
        let opened = OpenRequest { ports: self.names()?, signals: self.names()?, noise: self.noise()? };
        let mut states = States::default();
        for _ in 0..self.count(8)? {
            let (token, parent) = (Token(self.word()?), self.word()?);
            let mut state = Snapshot {
                q: self.poses()?,
                v: self.poses()?,
                rise: self.numbers()?,
                sources: self.numbers()?,
                anchors: if parts == StepHistory::PARTS { self.numbers()? } else { Vec::new() },
                next_step: f64::from_bits(self.word()?),
                elapsed: f64::from_bits(self.word()?),
                shown: {
                    let mut history = [const { Vec::new() }; StepHistory::PARTS];
                    for part in &mut history[..parts] {
                        *part = self.numbers()?;
                    }
                    StepHistory::from_numbers(history)?
                },
                carried: {
                    let mut carried = Vec::new();
                    for _ in 0..self.count(16)? {
                        carried.push(self.motion()?);
                    }
                    carried
                },
                ..Snapshot::default()
            };
            if is_multirate {
                (state.pause, state.peak) = (self.small()?, self.peak()?);
                (state.origin, state.offset, state.macro_step) =
                    (self.poses()?.into(), self.offset()?, self.macro_step()?);
            }
            states.put(token, (parent != 0).then_some(Token(parent)), state);
        }
        Some((opened, states, tag))
    }

    fn bytes(&mut self, count: usize) -> Option<&[u8]> {
        let (taken, left) = self.0.split_at_checked(count)?;
        self.0 = left;
        Some(taken)
    }

    fn word(&mut self) -> Option<u64> {
        self.bytes(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// A number of things of at least `each` bytes: there are no more than the bytes that are left hold.
    fn count(&mut self, each: usize) -> Option<usize> {
        let count = usize::try_from(self.word()?).ok()?;
        (count <= self.0.len() / each).then_some(count)
    }

    /// A number below 2³².
    fn small(&mut self) -> Option<u32> {
        self.word()?.try_into().ok()
    }

    fn number(&mut self) -> Option<f64> {
        self.word().map(f64::from_bits)
    }

    fn motion(&mut self) -> Option<Motion> {
        Some(Motion { q: self.poses()?, v: self.poses()? })
    }

    /// True or false; none for any other word.
    fn flag(&mut self) -> Option<bool> {
        [false, true].get(usize::try_from(self.word()?).ok()?).copied()
    }

    fn peak(&mut self) -> Option<PeakMotion> {
        Some(PeakMotion { displacement: self.number()?, rate: self.number()? })
    }

    /// Offset of a displayed motion.
    fn offset(&mut self) -> Option<Option<Box<DisplayOffset>>> {
        if !self.flag()? {
            return Some(None);
        }
        let start = Arc::new(self.motion()?);
        Some(Some(Box::new(DisplayOffset { start, length: self.number()?, elapsed: self.number()? })))
    }

    /// Position of a state in a macro step.
    fn macro_step(&mut self) -> Option<Option<Box<MacroStepPosition>>> {
        if !self.flag()? {
            return Some(None);
        }
        let step = MacroStep {
            start: Token(self.word()?),
            motion: self.motion()?,
            displayed: self.motion()?,
            sources: self.numbers()?,
            extrapolations: {
                let mut extrapolations = Vec::new();
                for _ in 0..self.count(32)? {
                    let [mean, value, slope] = [self.number()?, self.number()?, self.number()?];
                    extrapolations.push(SquareExtrapolation { mean, value, slope, is_linear: self.flag()? });
                }
                extrapolations
            },
            peak: self.peak()?,
            history: self.small()?,
            trial_step: self.number()?,
        };
        Some(Some(Box::new(MacroStepPosition {
            step: Arc::new(step),
            elapsed: self.number()?,
            points: self.small()?,
            integrals: {
                let mut integrals = Vec::new();
                for _ in 0..self.count(16)? {
                    integrals.push([self.number()?, self.number()?]);
                }
                integrals
            },
        })))
    }

    fn noise(&mut self) -> Option<Option<Agitation>> {
        Some(match self.word()? {
            0 => None,
            1 => {
                let (seed, band) = (self.word()?, self.word()?);
                Some(Agitation { seed, band: (band != 0).then(|| f64::from_bits(band)) })
            }
            _ => return None,
        })
    }

    fn names(&mut self) -> Option<Vec<String>> {
        let mut names = Vec::new();
        for _ in 0..self.count(8)? {
            let length = self.count(1)?;
            names.push(String::from_utf8(self.bytes(length)?.to_vec()).ok()?);
        }
        Some(names)
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = self.count(8)?;
        let bytes = self.bytes(8 * count)?;
        Some(bytes.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
    }

    fn poses(&mut self) -> Option<Vec<Pose>> {
        let count = self.count(24)?;
        let bytes = self.bytes(24 * count)?;
        let number = |k: usize, pose: &[[u8; 8]]| f64::from_le_bytes(pose[k]);
        Some(
            (bytes.as_chunks::<8>().0.chunks_exact(DOF))
                .map(|pose| Pose::new(number(0, pose), number(1, pose), number(2, pose)))
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    //! States come back with the same bits, and nothing else is taken for them.
    use super::*;
    use crate::{Mode, Trial};
    use bimorph_base::ErrorBudget;

    fn some(of_macro_steps: bool) -> (OpenRequest, States) {
        let opened = OpenRequest {
            ports: vec!["drive".into()],
            signals: vec!["µ.x".into(), String::new()],
            noise: Some(Agitation { seed: 7, band: Some(1e6) }),
        };
        let mut states = States::default();
        let mut parent = None;
        for k in 0..3i32 {
            let pose = |x: f64| vec![Pose::new(x, f64::NAN, -0.0), Pose::new(f64::INFINITY, 1e-320, x)];
            let carried = if k == 2 { vec![Motion { q: pose(7.0), v: pose(8.0) }] } else { vec![] };
            let state = Snapshot {
                q: pose(1.0 + f64::from(k)),
                v: pose(0.1),
                rise: vec![300.0; k as usize],
                sources: vec![1.0, -2.0],
                anchors: vec![3e-9; k as usize],
                elapsed: 3e-6,
                next_step: f64::INFINITY,
                shown: StepHistory::start(vec![1.0, 2.0])
                    .step(
                        1e-6,
                        vec![1.5, 2.5],
                        ErrorBudget::of(1e-3),
                        |_| 1e-9,
                        |_| crate::step_history::SteppingRule::Line,
                    )
                    .0,
                carried,
                macro_step: (of_macro_steps && k > 0).then(|| {
                    let motion = |x: f64| Motion { q: pose(x), v: pose(x + 1.0) };
                    let step = MacroStep {
                        start: Token(5),
                        motion: motion(1.0),
                        displayed: motion(3.0),
                        sources: vec![1.0, 2.0],
                        extrapolations: vec![
                            SquareExtrapolation { mean: 0.5, value: 0.6, slope: 0.7, is_linear: true },
                            SquareExtrapolation::default(),
                        ],
                        peak: PeakMotion { displacement: 3e-9, rate: 1e-9 },
                        history: 2,
                        trial_step: 1e-7,
                    };
                    let integrals = vec![[1e-9, 2e-18], [0.0, -0.0]];
                    Box::new(MacroStepPosition { step: Arc::new(step), elapsed: 1e-8, points: 3, integrals })
                }),
                offset: (of_macro_steps && k == 0).then(|| {
                    let start = Arc::new(Motion { q: pose(1.0), v: pose(2.0) });
                    Box::new(DisplayOffset { start, length: 1e-7, elapsed: 1e-8 })
                }),
                pause: u32::from(of_macro_steps),
                peak: match of_macro_steps {
                    true => PeakMotion { displacement: 4e-9, rate: 2e-9 },
                    false => PeakMotion::default(),
                },
                origin: if of_macro_steps { pose(5.0).into() } else { Arc::default() },
            };
            let voltages = [f64::from(k)];
            parent = Some(
                states.insert(&Trial { mode: Mode::Transient, parent, t: 0.0, dt: 1e-6, voltages: &voltages }, state),
            );
        }
        (opened, states)
    }

    #[test]
    fn states_come_back() {
        for (tag, of_macro_steps) in [(None, false), (Some(7), false), (None, true), (Some(7), true)] {
            let (opened, states) = some(of_macro_steps);
            let bytes = write(&opened, &states, tag);
            let (read_opened, read_states, read_tag) = read(&bytes).expect("its own bytes");
            assert_eq!((&read_opened, read_tag), (&opened, tag));
            assert_eq!(write(&read_opened, &read_states, tag), bytes, "with the same bits, in the same order");
        }
    }

    /// Snapshots of formats 2 to 4 come back: with histories that have counted no alternations, and with states in no macro steps.
    #[test]
    fn states_of_earlier_formats_come_back() {
        let of_reduced = [HEAD_4, 9u64.to_le_bytes()].concat();
        let formats = [(&HEAD_2[..], StepHistory::PARTS_OF_FORMAT_2), (&HEAD_3, StepHistory::PARTS)];
        for (head, parts) in formats.into_iter().chain([(&of_reduced[..], StepHistory::PARTS)]) {
            let (opened, states) = some(false);
            let bytes = write_format(head, parts, &opened, &states);
            let (read_opened, read_states, _) = read(&bytes).expect("bytes of an earlier format");
            assert_eq!(read_opened, opened);
            assert_eq!(write_format(head, parts, &read_opened, &read_states), bytes);
        }
    }

    #[test]
    fn other_bytes_are_refused() {
        let (opened, states) = some(true);
        let bytes = write(&opened, &states, None);
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
        assert!(read(&[bytes.as_slice(), &[0]].concat()).is_err());
        for at in 0..bytes.len() {
            for bit in [0, 7] {
                let mut wrong = bytes.clone();
                wrong[at] ^= 1 << bit;
                // it may be a state, but it neither panics nor allocates more than its bytes
                let _ = read(&wrong);
            }
        }
        assert!(read(&[&HEAD[..], &[255; 64]].concat()).is_err());
    }
}
