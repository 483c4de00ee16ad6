//! The frequencies of a response: those of an even grid, and more about each resonance, so that no peak falls between two of them.

use super::root::Root;

/// How the frequencies of the even grid lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spacing {
    /// Equal quotients.
    #[default]
    Logarithmic,
    /// Equal quotients, the number of points being that in a decade.
    PerDecade,
    /// Equal differences.
    Linear,
}

/// Where points are added about a resonance, in half widths.
const ABOUT: [f64; 13] = [-8.0, -4.0, -2.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0];
/// The same where nothing damps it, as fractions of its frequency: its height has no bound, so that it is drawn by its flanks.
const FLANK_OFFSETS: [f64; 8] = [-1e-3, -1e-4, -1e-5, -1e-6, 1e-6, 1e-5, 1e-4, 1e-3];
/// Points that are added at most.
pub(super) const MAX_ADDED: usize = 4000;
/// Doublings of the distance from a resonance at most, on its flanks.
const MAX_DOUBLED: i32 = 40;
/// Nearer than this fraction of its frequency to an undamped resonance a value says nothing: rounding moves the resonance by as much.
pub(super) const UNBOUNDED: f64 = 1e-9;
/// Steps shorter than this fraction of the others are omitted.
const WHOLE: f64 = 1e-6;
/// Two frequencies nearer than this fraction are one.
const FREQUENCY_TOLERANCE: f64 = 1e-12;

/// How many points the even grid has; none where they cannot be counted.
pub fn count(spacing: Spacing, points: usize, [from, to]: [f64; 2]) -> Option<usize> {
    match spacing {
        Spacing::Logarithmic | Spacing::Linear => Some(points),
        Spacing::PerDecade => {
            let count = ((to / from).log10() * points as f64 - WHOLE).ceil() + 1.0;
            (count < 1e15).then_some((count as usize).max(2))
        }
    }
}

/// The even grid (Hz), both ends included; of [`Spacing::PerDecade`] its last step may be shorter.
pub(super) fn even(spacing: Spacing, points: usize, band: [f64; 2]) -> Vec<f64> {
    let [from, to] = band;
    let count = count(spacing, points, band).unwrap_or(2);
    let last = (count - 1) as f64;
    let at = |k: usize| {
        let frequency = match spacing {
            Spacing::Logarithmic => from * (to / from).powf(k as f64 / last),
            Spacing::PerDecade => from * 10f64.powf(k as f64 / points as f64),
            Spacing::Linear => from + (to - from) * (k as f64 / last),
        };
        frequency.min(to)
    };
    let mut grid: Vec<f64> = (0..count).map(at).collect();
    grid[0] = from;
    grid[count - 1] = to;
    grid
}

/// The grid with points about each resonance and each zero within it, ascending, and how many were added: about every root those in
/// which its shape shows, then more on its flanks until the grid is as fine.
pub(super) fn with_roots(mut grid: Vec<f64>, roots: &[Root], band: [f64; 2]) -> (Vec<f64>, usize) {
    let before = grid.len();
    let ringing: Vec<(f64, &Root)> =
        roots.iter().filter(|root| root.im > 0.0).map(|root| (root.im / std::f64::consts::TAU, root)).collect();
    let mut more = Vec::new();
    for (own, root) in &ringing {
        let half = 0.5 * root.width_hz();
        match root.quality() {
            None => more.extend(FLANK_OFFSETS.iter().map(|share| own * (1.0 + share))),
            Some(_) => more.extend(ABOUT.iter().map(|k| own + k * half)),
        }
    }
    for (own, root) in &ringing {
        let after = grid.partition_point(|f| f < own).clamp(1, before - 1);
        let spacing = grid[after] - grid[after - 1];
        let first = root
            .quality()
            .map_or(FLANK_OFFSETS[FLANK_OFFSETS.len() - 1] * own, |_| 0.5 * root.width_hz() * ABOUT[ABOUT.len() - 1]);
        let distances = (1..=MAX_DOUBLED).map(|k| first * 2f64.powi(k)).take_while(|d| *d < spacing);
        more.extend(distances.flat_map(|d| [own - d, own + d]));
    }
    more.retain(|f| *f > band[0] * (1.0 + FREQUENCY_TOLERANCE) && *f < band[1] * (1.0 - FREQUENCY_TOLERANCE));
    more.truncate(MAX_ADDED);
    grid.append(&mut more);
    grid.sort_by(f64::total_cmp);
    grid.dedup_by(|b, a| *b - *a <= FREQUENCY_TOLERANCE * *a);
    let added = grid.len().saturating_sub(before);
    (grid, added)
}

/// Whether a frequency is too near to a resonance that nothing damps.
pub(super) fn unbounded(frequency: f64, poles: &[Root]) -> bool {
    let near = |pole: &Root| pole.quality().is_none() && (frequency / pole.frequency_hz() - 1.0).abs() <= UNBOUNDED;
    poles.iter().any(near)
}

#[cfg(test)]
mod tests {
    //! Even grids end where they should; a sharp resonance gets its points, and one that is not damped none on itself.
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn even_grids() {
        assert_eq!(even(Spacing::Linear, 5, [1.0, 9.0]), [1.0, 3.0, 5.0, 7.0, 9.0]);
        let log = even(Spacing::Logarithmic, 4, [1.0, 1000.0]);
        assert!(log.iter().zip([1.0, 10.0, 100.0, 1000.0]).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{log:?}");
        let decade = even(Spacing::PerDecade, 2, [1.0, 50.0]);
        assert_eq!(decade.len(), 5);
        assert_eq!((decade[0], decade[4]), (1.0, 50.0));
        assert_eq!(count(Spacing::PerDecade, 10, [1.0, 1e6]), Some(61));
    }

    #[test]
    fn resonances_get_points() {
        let sharp = Root { re: -TAU * 50.0, im: TAU * 1e5 };
        let bare = Root { re: 0.0, im: TAU * 2e5 };
        let (grid, added) = with_roots(even(Spacing::Logarithmic, 11, [1e3, 1e6]), &[sharp, bare], [1e3, 1e6]);
        // 13 about the sharp one and 8 beside the other; flanks of 8·2^k times 50 Hz and 2^k times 200 Hz up to the step of the grid
        assert_eq!((grid.len(), added), (11 + added, 13 + 8 + 2 * (7 + 9)));
        assert!(grid.windows(2).all(|w| w[0] < w[1]));
        assert!(grid.iter().any(|f| (f / 100_050.0 - 1.0).abs() < 1e-12), "a half-power point");
        assert!(!grid.iter().any(|f| unbounded(*f, &[sharp, bare])) && unbounded(2e5, &[sharp, bare]));
    }
}
