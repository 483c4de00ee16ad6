//! Beams that are alike get equal numbers of segments, so that symmetric mechanisms stay symmetric.

use crate::options::CompileOptions;
use crate::structure::Beam;
use std::collections::HashMap;

/// Fraction of the tolerance that predictions may use.
pub(super) const MARGIN: f64 = 0.9;

/// Segments of a beam for each of those it has, at most, by one prediction: further it is a guess.
const MAX_GROWTH: usize = 8;

/// Beams that are alike, as indices.
pub(super) struct Groups(pub(super) Vec<Vec<usize>>);

impl Groups {
    /// Beams of equal length, section and material, to nine digits.
    pub(super) fn new(beams: &[Beam]) -> Self {
        let mut known: HashMap<[i64; 5], usize> = HashMap::new();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, beam) in beams.iter().enumerate() {
            let m = &beam.material;
            let key = [beam.length, beam.width, beam.thickness, m.youngs_modulus, m.density]
                .map(|x| (x.ln() * 1e9).round() as i64);
            let group = *known.entry(key).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(index);
        }
        Self(groups)
    }

    /// The same in at most `most` groups: those of similar slenderness together.
    pub(super) fn merged(mut self, beams: &[Beam], most: usize) -> Self {
        if self.0.len() <= most {
            return self;
        }
        let slenderness = |group: &Vec<usize>| beams[group[0]].length / beams[group[0]].width;
        self.0.sort_by(|a, b| slenderness(a).total_cmp(&slenderness(b)).then(a[0].cmp(&b[0])));
        let size = self.0.len().div_ceil(most);
        Self(self.0.chunks(size).map(<[_]>::concat).collect())
    }

    /// The fewest segments, `floor` at least, for which every result is predicted to hold its `goal`. `shares` holds for each
    /// result what each group contributes to its error with `segments`, which falls with the power of the scheme.
    pub(super) fn fewest(
        &self,
        options: &CompileOptions,
        shares: &[Vec<f64>],
        goals: &[f64],
        segments: &[usize],
        floor: &[usize],
    ) -> Vec<usize> {
        let most = |beams: &[usize], of: &[usize]| beams.iter().map(|&b| of[b]).max().unwrap_or(1);
        let now: Vec<usize> = self.0.iter().map(|g| most(g, segments)).collect();
        let mut next: Vec<usize> = self.0.iter().map(|g| most(g, floor)).collect();
        let power = options.scheme.order();
        // rigid beams have no segments, and no share
        let scaled = |g: usize, n: usize| if now[g] == 0 { 0.0 } else { (now[g] as f64 / n as f64).powi(power) };
        let mut sums: Vec<f64> =
            shares.iter().map(|s| s.iter().enumerate().map(|(g, s)| s.abs() * scaled(g, next[g])).sum()).collect();
        // a step in N of at least a fiftieth keeps long searches short
        let step = |n: usize| options.scheme.segments(n + 1 + n / 50);
        for _ in 0..100_000 {
            let gain = |g: usize| {
                if now[g] == 0 || next[g] > MAX_GROWTH * (now[g] + 1) {
                    return 0.0;
                }
                let less = scaled(g, next[g]) - scaled(g, step(next[g]));
                let bodies = (step(next[g]) - next[g]) * self.0[g].len();
                let useful = sums.iter().zip(goals).zip(shares).filter(|((sum, goal), _)| sum > goal);
                useful.map(|((sum, goal), s)| (s[g].abs() * less).min(sum - goal) / sum).sum::<f64>() / bodies as f64
            };
            let Some((best, gained)) = (0..now.len()).map(|g| (g, gain(g))).max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            if gained <= 0.0 {
                break;
            }
            let less = scaled(best, next[best]) - scaled(best, step(next[best]));
            for (sum, s) in sums.iter_mut().zip(shares) {
                *sum -= s[best].abs() * less;
            }
            next[best] = step(next[best]);
        }
        let mut counts = segments.to_vec();
        for (group, n) in self.0.iter().zip(next) {
            for &beam in group {
                counts[beam] = n;
            }
        }
        counts
    }
}
