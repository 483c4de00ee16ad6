//! How far two runs of one deck lie apart: every vector of every plot, and every number printed by name.
//!
//! Runs in time have points of their own. At each point of the first, the second is known between the straight line and the cubic
//! through its nearest points; the difference is what lies outside of that. A corner of a source, which both runs have a point at, and
//! a smooth curve are thus treated alike.

pub use super::oscillation::Oscillation;
use super::oscillation::common;
use bimorph_results::table::{ColumnSamples, Table};
use serde::Serialize;

/// Smallest range that a voltage (V) or a current (A) is measured against: ngspice solves no finer (`vntol`, `abstol`).
const MIN_RANGE: [(&str, f64); 2] = [("V", 1e-6), ("A", 1e-12)];
/// Smallest range, as a fraction of the largest magnitude (1): of a constant, the difference is relative to a thousandth of it.
const MIN_SHARE: f64 = 1e-3;

/// How far apart a vector is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VectorComparison {
    /// Its name.
    pub name: String,
    /// Its unit, where ngspice gives it.
    pub unit: String,
    /// Scale of differences, in its unit: largest less smallest value, of complex ones the largest magnitude, and at
    /// least the resolution of ngspice.
    pub range: f64,
    /// Largest difference (1).
    pub largest: f64,
    /// Root mean square of the differences (1).
    pub rms: f64,
    /// Where the largest is: value of the axis.
    pub at: f64,
    /// Frequencies and amplitudes, where the differences are those of phase of an oscillator.
    pub oscillation: Option<Oscillation>,
}

impl VectorComparison {
    /// The largest difference that counts (1): of an oscillator that of its frequency or amplitude, not that of its phase.
    pub fn counts(&self) -> f64 {
        self.oscillation.map_or(self.largest, |o| o.difference[0].max(o.difference[1]))
    }
}

/// How far apart the vectors of a plot are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlotComparison {
    /// Its name ("Transient Analysis").
    pub name: String,
    /// Name of the axis.
    pub axis: String,
    /// Points of both runs.
    pub points: [usize; 2],
    /// Its vectors.
    pub vectors: Vec<VectorComparison>,
}

/// A number that both runs printed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PrintedNumber {
    /// Its name.
    pub name: String,
    /// The values of the first run and the second.
    pub values: [f64; 2],
    /// Their difference over the larger magnitude (1).
    pub difference: f64,
}

/// Compares plot by plot; a sentence for each plot that cannot be compared.
pub fn plots(first: &[Table], second: &[Table]) -> (Vec<PlotComparison>, Vec<String>) {
    let mut notes = Vec::new();
    if first.len() != second.len() {
        notes.push(format!("{} plots, and {} in the finer run", first.len(), second.len()));
    }
    let pairs = first.iter().zip(second).filter(|(a, b)| a.rows() > 0 && b.rows() > 0);
    let plots = pairs.filter_map(|(a, b)| match plot(a, b) {
        Ok(plot) => Some(plot),
        Err(note) => {
            notes.push(note);
            None
        }
    });
    let plots = plots.collect();
    (plots, notes)
}

fn plot(a: &Table, b: &Table) -> Result<PlotComparison, String> {
    let points = [a.rows(), b.rows()];
    let refused = |why: &str| Err(format!("{}: {why}", a.plot_name));
    if a.plot_name != b.plot_name {
        return refused("the finer run has another plot in its place");
    }
    let (Some(x), Some(y)) = (a.columns().first(), b.columns().first()) else { return refused("it has no vectors") };
    let single = points == [1, 1];
    let (x, y) = (real(&x.samples), real(&y.samples));
    let same = x.len() == y.len() && x.iter().zip(&y).all(|(x, y)| (x - y).abs() <= 1e-9 * x.abs().max(y.abs()));
    let rises = |t: &[f64]| t.windows(2).all(|t| t[1] >= t[0]);
    let comparable = single || same || (rises(&x) && rises(&y));
    if !comparable {
        return refused("the axes of the two runs differ and do not rise");
    }
    let mut vectors = Vec::new();
    for (n, column) in a.columns().iter().enumerate().skip(usize::from(!single)) {
        let at_same_place = b.columns().get(n).filter(|c| c.name == column.name);
        let Some(other) = at_same_place.or_else(|| b.column(&column.name)) else { continue };
        let (values, others) = (complex(&column.samples), complex(&other.samples));
        let difference = |i: usize| match single || same {
            true => distance(values[i], others[i], others[i]),
            false => {
                let (line, cubic) = between(&y, &others, x[i]);
                distance(values[i], line, cubic)
            }
        };
        let differences: Vec<f64> = (0..values.len()).map(difference).collect();
        let range = range(&column.samples, &column.name, &column.unit);
        let worst = (0..differences.len()).max_by(|&i, &j| differences[i].total_cmp(&differences[j])).unwrap_or(0);
        let squares: f64 = differences.iter().map(|d| d * d).sum();
        let relative = |d: f64| if range > 0.0 { d / range } else { d };
        let oscillation = match (&column.samples, &other.samples) {
            (ColumnSamples::Real(v), ColumnSamples::Real(w)) if a.plot_name.starts_with("Transient") => {
                common((&x, v), (&y, w), relative(differences[worst]))
            }
            _ => None,
        };
        vectors.push(VectorComparison {
            oscillation,
            name: column.name.clone(),
            unit: column.unit.clone(),
            range,
            largest: relative(differences[worst]),
            rms: relative((squares / differences.len() as f64).sqrt()),
            at: if single { 0.0 } else { x[worst] },
        });
    }
    let axis = if single { String::new() } else { a.columns()[0].name.clone() };
    Ok(PlotComparison { name: a.plot_name.clone(), axis, points, vectors })
}

fn real(samples: &ColumnSamples) -> Vec<f64> {
    complex(samples).iter().map(|z| z[0]).collect()
}

fn complex(samples: &ColumnSamples) -> Vec<[f64; 2]> {
    match samples {
        ColumnSamples::Real(v) => v.iter().map(|x| [*x, 0.0]).collect(),
        ColumnSamples::Complex(v) => v.clone(),
    }
}

/// Scale of the differences of a vector.
fn range(samples: &ColumnSamples, name: &str, unit: &str) -> f64 {
    let largest = samples.magnitudes().into_iter().fold(0.0, |m: f64, y| m.max(y.abs()));
    let span = match samples {
        ColumnSamples::Real(v) if v.len() > 1 => {
            let (low, high) = v.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, y| (r.0.min(*y), r.1.max(*y)));
            (high - low).max(MIN_SHARE * largest)
        }
        _ => largest,
    };
    // ngspice reports every quantity read by `@` as a voltage
    let least = MIN_RANGE.iter().find(|(u, _)| *u == unit && !name.contains('@')).map_or(0.0, |(_, least)| *least);
    span.max(least)
}

/// How far a value lies outside of what is between two others; infinitely far where one is not a number.
fn distance(value: [f64; 2], one: [f64; 2], other: [f64; 2]) -> f64 {
    if [value, one, other].as_flattened().iter().any(|x| x.is_nan()) {
        return f64::INFINITY;
    }
    let outside = |d: usize| {
        let (low, high) = (one[d].min(other[d]), one[d].max(other[d]));
        (low - value[d]).max(value[d] - high).max(0.0)
    };
    outside(0).hypot(outside(1))
}

/// A vector at `at` by the straight line between its nearest points, and by the cubic through four of them.
fn between(t: &[f64], y: &[[f64; 2]], at: f64) -> ([f64; 2], [f64; 2]) {
    let i = t.partition_point(|&x| x < at).clamp(1, t.len().max(2) - 1);
    if t.len() < 2 || t[i] <= t[i - 1] {
        let only = y[i.min(y.len() - 1)];
        return (only, only);
    }
    let share = ((at - t[i - 1]) / (t[i] - t[i - 1])).clamp(0.0, 1.0);
    let line = [0, 1].map(|d| y[i - 1][d] + share * (y[i][d] - y[i - 1][d]));
    let nearest = i.saturating_sub(2)..(i + 2).min(t.len());
    let apart = nearest.clone().skip(1).all(|k| t[k] > t[k - 1]);
    if nearest.len() < 4 || !apart || share == 0.0 || share == 1.0 {
        return (line, line);
    }
    let mut cubic = [0.0; 2];
    for k in nearest.clone() {
        let weight: f64 = nearest.clone().filter(|&j| j != k).map(|j| (at - t[j]) / (t[k] - t[j])).product();
        (0..2).for_each(|d| cubic[d] += weight * y[k][d]);
    }
    (line, cubic)
}

/// Numbers that ngspice printed by name, as `print` and `.measure` do, in both outputs, in their order.
pub fn printed(first: &str, second: &str) -> Vec<PrintedNumber> {
    let (first, second) = (numbers(first), numbers(second));
    let mut used = vec![false; second.len()];
    let mut found = Vec::new();
    for (name, value) in first {
        let Some(n) = (0..second.len()).find(|&n| !used[n] && second[n].0 == name) else { continue };
        used[n] = true;
        let other = second[n].1;
        let most = value.abs().max(other.abs());
        let difference = if most > 0.0 { (value - other).abs() / most } else { 0.0 };
        found.push(PrintedNumber { name, values: [value, other], difference });
    }
    found
}

fn numbers(output: &str) -> Vec<(String, f64)> {
    let number = |line: &str| {
        let (name, rest) = line.split_once('=')?;
        let name = name.trim();
        let mut words = rest.split_whitespace();
        let value: f64 = words.next()?.trim_end_matches(',').parse().ok().filter(|v: &f64| v.is_finite())?;
        let named =
            !name.is_empty() && !name.contains(char::is_whitespace) && !name.starts_with(|c: char| c.is_ascii_digit());
        (named && words.next().is_none_or(|word| word.contains('='))).then(|| (name.to_owned(), value))
    };
    output.lines().filter_map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(points: usize, off: f64) -> Table {
        let t: Vec<f64> = (0..=points).map(|i| i as f64 / points as f64).collect();
        let y = t.iter().map(|t| (6.0 * t).sin() + off * (t * 3.0).cos()).collect();
        let mut table = Table::new("made up", "Transient Analysis");
        table.push_real("time", "s", t).unwrap();
        table.push_real("v(y)", "V", y).unwrap();
        table
    }

    /// The same curve sampled at other points differs by less than linear interpolation would show. A curve with an
    /// error of 1 % of its amplitude differs by half of that of its range.
    #[test]
    fn points_of_their_own_do_not_count() {
        let (plots, notes) = plots(&[sine(60, 0.0), sine(60, 0.01)], &[sine(101, 0.0), sine(101, 0.0)]);
        assert_eq!((plots.len(), notes.len()), (2, 0));
        let (same, off) = (&plots[0].vectors[0], &plots[1].vectors[0]);
        assert!(same.largest < 1e-6, "{same:?}");
        assert!((off.largest / 0.005 - 1.0).abs() < 0.02 && off.at < 0.1, "{off:?}");
        assert!(off.rms < off.largest && off.rms > 0.3 * off.largest, "{off:?}");
    }

    /// Measured and printed numbers are compared by name; ngspice's times and memory are excluded.
    #[test]
    fn numbers_are_compared_by_name() {
        let first =
            "far   =  4.0e-08 at=  5.0e-06\nTotal elapsed time (seconds) = 0.026\nStack = 0 bytes.\nv(x) = 2.0\n";
        let second =
            "far   =  4.1e-08 at=  5.0e-06\nTotal elapsed time (seconds) = 0.011\nStack = 0 bytes.\nv(x) = 2.0\n";
        let found = printed(first, second);
        assert_eq!(found.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["far", "v(x)"]);
        assert!((found[0].difference - 0.1 / 4.1).abs() < 1e-12 && found[1].difference == 0.0);
    }
}
