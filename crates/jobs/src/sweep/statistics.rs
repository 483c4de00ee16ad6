//! Statistics of a sweep: moments, percentiles, the fraction of points within limits, and histograms.
//!
//! A point without a result is beyond every limit on that result, and in no moment, percentile or histogram. Percentiles are interpolated
//! linearly between ordered values (R. J. Hyndman and Y. Fan, 1996, type 7), confidence intervals of fractions are those of E. B. Wilson (1927).

use super::distribution::number;
use super::error::{SweepError, bad};
use super::table::{SweepRow, SweepTable};
use bimorph_base::Setting;
use std::fmt;
use std::str::FromStr;

/// Percentiles of every column [%].
pub const PERCENTILES: [f64; 3] = [5.0, 50.0, 95.0];
/// Quantile of the normal distribution for 95 % on both sides.
const QUANTILE_95: f64 = 1.959_963_984_540_054;
/// Most bins of a histogram.
const MAX_BINS: f64 = 200.0;

/// How a value and a limit compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// `<`
    Below,
    /// `<=`
    AtMost,
    /// `>`
    Above,
    /// `>=`
    AtLeast,
}

/// Limit of a result, or a parameter: `yoke.y>-1.1u`.
#[derive(Debug, Clone, PartialEq)]
pub struct YieldLimit {
    /// Name of the column.
    pub name: String,
    /// Unit of the column, where it was written with the name: `yoke.y [m]`.
    pub unit: Option<String>,
    /// How its values and the limit compare.
    pub relation: Relation,
    /// The limit, in the unit of the column.
    pub value: f64,
}

impl FromStr for YieldLimit {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let what = || format!("limit \"{text}\"");
        let form = "NAME>NUMBER, with <, <=, > or >=";
        let at = text.find(['<', '>']).ok_or_else(|| bad(what(), form, "no < or >"))?;
        let (name, rest) = text.split_at(at);
        let (relation, value) = match (rest.strip_prefix("<="), rest.strip_prefix(">=")) {
            (Some(value), _) => (Relation::AtMost, value),
            (_, Some(value)) => (Relation::AtLeast, value),
            _ if rest.starts_with('<') => (Relation::Below, &rest[1..]),
            _ => (Relation::Above, &rest[1..]),
        };
        let (name, value) = (name.trim(), value.trim());
        if name.is_empty() {
            return Err(bad(what(), form, "no name"));
        }
        let parsed = number(value).filter(|value| value.is_finite());
        let value = parsed.ok_or_else(|| bad(what(), "a number behind the relation", value))?;
        let (name, unit) = match name.strip_suffix(']').and_then(|name| name.split_once(" [")) {
            Some((name, unit)) => (name, Some(unit.to_owned())),
            None => (name, None),
        };
        Ok(Self { name: name.to_owned(), unit, relation, value })
    }
}

impl fmt::Display for YieldLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let relation = match self.relation {
            Relation::Below => "<",
            Relation::AtMost => "<=",
            Relation::Above => ">",
            Relation::AtLeast => ">=",
        };
        write!(f, "{} {relation} {:e}", self.name, self.value)
    }
}

impl YieldLimit {
    fn holds(&self, value: f64) -> bool {
        match self.relation {
            Relation::Below => value < self.value,
            Relation::AtMost => value <= self.value,
            Relation::Above => value > self.value,
            Relation::AtLeast => value >= self.value,
        }
    }

    /// Whether the estimated error of a result, a fraction of it, reaches to the limit. Parameters have none.
    fn is_within_error(&self, row: &SweepRow, place: Place, value: f64) -> bool {
        let error = row.estimated_error.filter(|_| matches!(place, Place::Result(_)));
        error.is_some_and(|error| (value - self.value).abs() <= error * value.abs())
    }
}

/// A fraction of the points of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fraction {
    /// Points within the limits.
    pub passed: usize,
    /// All points.
    pub points: usize,
}

impl Fraction {
    /// `passed / points` (1); 0 without points.
    pub fn value(self) -> f64 {
        self.passed as f64 / self.points.max(1) as f64
    }

    /// 95 % confidence interval of the fraction, where the points are independent random samples (1).
    pub fn interval(self) -> [f64; 2] {
        if self.points == 0 {
            return [0.0, 1.0];
        }
        let (n, p, z2) = (self.points as f64, self.value(), QUANTILE_95 * QUANTILE_95);
        let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = QUANTILE_95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
        [(centre - half).max(0.0), (centre + half).min(1.0)]
    }
}

/// Statistics of a result over the points that have it.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnStatistics {
    /// Name of the result.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Points that have it; without any, all that follows is NaN.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of a sample, with `count - 1`; NaN of one point.
    pub deviation: f64,
    /// Values at [`PERCENTILES`].
    pub percentiles: [f64; 3],
    /// Smallest and largest value.
    pub range: [f64; 2],
}

/// Statistics of every result of a sweep, and how many points keep to limits.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepStatistics {
    /// One for each result.
    pub columns: Vec<ColumnStatistics>,
    /// Points that keep to each limit.
    pub limits: Vec<(YieldLimit, Fraction)>,
    /// Points that keep to all of them: the yield.
    pub passed: Fraction,
    /// Points with a result that is closer to a limit than its estimated error.
    pub undecided: usize,
}

impl SweepStatistics {
    /// Of a table.
    ///
    /// # Errors
    /// [`SweepError`] for a limit on what is no column.
    pub fn of(table: &SweepTable, limits: &[YieldLimit]) -> Result<Self, SweepError> {
        let columns = (0..table.results.len()).map(|k| column(table, k)).collect();
        let points = table.rows.len();
        let mut passes = vec![true; points];
        let mut is_close = vec![false; points];
        let mut found = Vec::with_capacity(limits.len());
        for limit in limits {
            let place = place(table, limit)?;
            let mut passed = 0;
            for (row, (passes, is_close)) in table.rows.iter().zip(passes.iter_mut().zip(&mut is_close)) {
                let keeps = value(row, place).is_some_and(|value| limit.holds(value));
                passed += usize::from(keeps);
                *passes &= keeps;
                *is_close |= value(row, place).is_some_and(|value| limit.is_within_error(row, place, value));
            }
            found.push((limit.clone(), Fraction { passed, points }));
        }
        let count = |of: &[bool]| of.iter().filter(|one| **one).count();
        let (passed, undecided) = (count(&passes), count(&is_close));
        Ok(Self { columns, limits: found, passed: Fraction { passed, points }, undecided })
    }
}

/// Where a column stands.
#[derive(Clone, Copy)]
enum Place {
    Parameter(usize),
    Result(usize),
    EstimatedError,
}

/// Name of the column of the estimated relative errors by the mesh.
pub const ESTIMATED_ERROR: &str = "estimated_error";

fn place(table: &SweepTable, limit: &YieldLimit) -> Result<Place, SweepError> {
    let name = limit.name.as_str();
    let at = |names: &[String]| names.iter().position(|known| known == name);
    let error = || (name == ESTIMATED_ERROR).then_some(Place::EstimatedError);
    let found = at(&table.results).map(Place::Result).or_else(|| at(&table.parameters).map(Place::Parameter));
    let known = || [table.parameters.as_slice(), table.results.as_slice()].concat().join(", ");
    let missing = || bad("limits".into(), &format!("a column of the table, one of {}", known()), name);
    let place = found.or_else(error).ok_or_else(missing)?;
    let unit = match place {
        Place::Parameter(_) => "",
        Place::Result(k) => &table.units[k],
        Place::EstimatedError => "1",
    };
    match &limit.unit {
        Some(other) if other != unit => {
            Err(bad(format!("limit on {name}"), &format!("the unit of the column, [{unit}]"), &format!("[{other}]")))
        }
        _ => Ok(place),
    }
}

fn value(row: &SweepRow, place: Place) -> Option<f64> {
    match place {
        Place::Parameter(k) => match row.parameters[k] {
            Setting::Number(value) => Some(value),
            Setting::Text(_) => None,
        },
        Place::Result(k) => row.values.as_ref().ok()?.get(k).copied().flatten(),
        Place::EstimatedError => row.estimated_error,
    }
}

/// The values that a result has.
pub fn values(table: &SweepTable, result: usize) -> Vec<f64> {
    table.rows.iter().filter_map(|row| value(row, Place::Result(result))).collect()
}

fn column(table: &SweepTable, result: usize) -> ColumnStatistics {
    let mut values = values(table, result);
    let n = values.len() as f64;
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let scale = power_of_two(largest * n);
    let mean = values.iter().map(|value| value / scale).sum::<f64>() / n * scale;
    let deviation = deviation(&values, mean);
    values.sort_by(f64::total_cmp);
    let ends = [values.first(), values.last()].map(|end| end.copied().unwrap_or(f64::NAN));
    ColumnStatistics {
        name: table.results[result].clone(),
        unit: table.units[result].clone(),
        count: values.len(),
        mean,
        deviation,
        percentiles: PERCENTILES.map(|percent| percentile(&values, percent)),
        range: ends,
    }
}

/// Standard deviation with `n - 1`. Squares neither overflow nor vanish: they are of differences of the size of 1.
fn deviation(values: &[f64], mean: f64) -> f64 {
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max((value / 2.0 - mean / 2.0).abs()));
    let scale = power_of_two(largest);
    let squares: f64 = values.iter().map(|value| (value / 2.0 - mean / 2.0) / scale).map(|x| x * x).sum();
    2.0 * scale * (squares / (values.len() as f64 - 1.0)).sqrt()
}

/// The power of two below a size, by which numbers are divided and multiplied without rounding; 1 for what has none.
fn power_of_two(size: f64) -> f64 {
    if size == 0.0 || size.is_nan() { 1.0 } else { size.log2().floor().clamp(-1000.0, 1000.0).exp2() }
}

/// The value at a percentage of ordered values; NaN without any.
fn percentile(ordered: &[f64], percent: f64) -> f64 {
    let Some(last) = ordered.len().checked_sub(1) else { return f64::NAN };
    let at = last as f64 * percent / 100.0;
    let below = (at.floor() as usize).min(last);
    let above = (below + 1).min(last);
    ordered[below] + (ordered[above] - ordered[below]) * (at - below as f64)
}

/// Edges and counts of bins of equal width: the narrower of the widths of H. A. Sturges (1926) and of D. Freedman and P. Diaconis (1981). A
/// value on an inner edge is in the bin above. Without values there are no bins.
pub fn histogram(values: &[f64]) -> (Vec<f64>, Vec<usize>) {
    let mut ordered = values.to_vec();
    ordered.sort_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (ordered.first(), ordered.last()) else { return (Vec::new(), Vec::new()) };
    if low == high {
        let room = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
        return (vec![low - room, low + room], vec![values.len()]);
    }
    let n = ordered.len() as f64;
    let sturges = (high - low) / (n.log2() + 1.0);
    let quartiles = percentile(&ordered, 75.0) - percentile(&ordered, 25.0);
    let diaconis = 2.0 * quartiles / n.cbrt();
    let width = if diaconis > 0.0 { sturges.min(diaconis) } else { sturges };
    let bins = ((high - low) / width).ceil().clamp(1.0, MAX_BINS);
    let edges: Vec<f64> = (0..=bins as usize).map(|k| low + (high - low) * (k as f64 / bins)).collect();
    let mut counts = vec![0; bins as usize];
    for value in &ordered {
        let above = edges.partition_point(|edge| edge <= value);
        counts[above.clamp(1, bins as usize) - 1] += 1;
    }
    (edges, counts)
}

#[cfg(test)]
mod tests {
    //! Moments, percentiles and yields of a small table, computed by hand and by Python's `statistics`.
    use super::*;

    fn table(values: &[Option<f64>]) -> SweepTable {
        let row = |(point, value): (usize, &Option<f64>)| SweepRow {
            point,
            parameters: vec![Setting::Number(point as f64)],
            values: value.map(|value| vec![Some(value)]).ok_or_else(|| "none".to_owned()),
            estimated_error: None,
            warning: String::new(),
        };
        SweepTable {
            parameters: vec!["k".into()],
            results: vec!["f1".into()],
            units: vec!["Hz".into()],
            rows: values.iter().enumerate().map(row).collect(),
        }
    }

    /// mean 26.1/7 and deviation 2.7372561… are those of `statistics.mean` and `statistics.stdev`, the median that of `statistics.median`.
    #[test]
    fn moments() {
        let found = SweepStatistics::of(
            &table(&[Some(3.0), Some(1.0), Some(4.0), Some(1.5), Some(9.0), Some(2.6), Some(5.0), None]),
            &[],
        );
        let found = found.expect("statistics");
        let one = &found.columns[0];
        assert!((one.mean - 26.1 / 7.0).abs() < 1e-14);
        let by_hand: f64 = [3.0, 1.0, 4.0, 1.5, 9.0, 2.6, 5.0].iter().map(|x: &f64| (x - 26.1 / 7.0).powi(2)).sum();
        assert!((one.deviation - (by_hand / 6.0).sqrt()).abs() < 1e-14);
        assert_eq!((one.count, one.range, one.percentiles[1]), (7, [1.0, 9.0], 3.0));
        // 5 % of six intervals is 0.3 of the first, 95 % is 0.7 of the last
        assert!((one.percentiles[0] - 1.15).abs() < 1e-14 && (one.percentiles[2] - 7.8).abs() < 1e-14);
    }

    /// Moments of a multiple are the multiple of the moments, to the smallest and the largest numbers.
    #[test]
    fn moments_scale() {
        let of = |factor: f64| {
            let values = [3.0, 1.0, 4.0, 1.5, 9.0].map(|x| Some(x * factor));
            SweepStatistics::of(&table(&values), &[]).expect("statistics").columns.remove(0)
        };
        let one = of(1.0);
        for factor in [1e-300, 1e-160, 1e160, 1e307] {
            let found = of(factor);
            assert!((found.mean / factor / one.mean - 1.0).abs() < 1e-12, "{factor:e}: {found:?}");
            assert!((found.deviation / factor / one.deviation - 1.0).abs() < 1e-12, "{factor:e}: {found:?}");
        }
        assert_eq!(of(0.0).deviation, 0.0);
    }

    /// A point without a result is beyond each limit; Wilson's interval of 8 in 10 is 0.4901625 to 0.9433178.
    #[test]
    fn yields() {
        let values: Vec<Option<f64>> = (1..=10).map(|k| (k != 9).then_some(f64::from(k))).collect();
        let limits: Vec<YieldLimit> = ["f1>=1", "f1 < 10"].iter().map(|text| text.parse().expect("a limit")).collect();
        let found = SweepStatistics::of(&table(&values), &limits).expect("statistics");
        assert_eq!(found.limits.iter().map(|(_, fraction)| fraction.passed).collect::<Vec<_>>(), [9, 8]);
        assert_eq!((found.passed, found.undecided), (Fraction { passed: 8, points: 10 }, 0));
        // 10 is closer to the limit than 1e-3 of itself
        let mut estimated = table(&values);
        estimated.rows.iter_mut().for_each(|row| row.estimated_error = Some(1e-3));
        let found_with_errors = SweepStatistics::of(&estimated, &limits).expect("statistics");
        assert_eq!((found_with_errors.passed, found_with_errors.undecided), (found.passed, 2));
        let [low, high] = found.passed.interval();
        assert!((low - 0.490_162_5).abs() < 1e-7 && (high - 0.943_317_8).abs() < 1e-7, "{low} {high}");
        let limit: YieldLimit = "yoke.y>-1.1u".parse().expect("a limit");
        assert_eq!((limit.name.as_str(), limit.relation, limit.value), ("yoke.y", Relation::Above, -1.1e-6));
        for wrong in ["f1", ">3", "f1>", "f1=3", "f1>x", "f1>nan"] {
            assert!(wrong.parse::<YieldLimit>().is_err(), "{wrong}");
        }
        let error = SweepStatistics::of(&table(&values), &["f2>0".parse().expect("a limit")]).expect_err("no column");
        assert!(error.to_string().contains("one of k, f1"), "{error}");
    }

    /// Every value is in one bin, and the largest one in the last.
    #[test]
    fn bins() {
        let values: Vec<f64> = (0..1000).map(|k| f64::from(k * 7919 % 1000)).collect();
        let (edges, counts) = histogram(&values);
        assert_eq!(edges.len(), counts.len() + 1);
        assert_eq!(counts.iter().sum::<usize>(), 1000);
        assert_eq!((edges[0], edges[counts.len()]), (0.0, 999.0));
        assert_eq!(histogram(&[]), (vec![], vec![]));
        assert_eq!(histogram(&[2.0, 2.0]).1, [2]);
    }
}
