//! The values of an axis: listed, or counted out between two ends, which takes no memory however many they are.

use bimorph_base::Setting;

/// Values in order.
#[derive(Debug, Clone)]
pub enum Values {
    /// Any.
    List(Vec<Setting>),
    /// Equally spaced numbers, the ends exact; one: `low`.
    Linear {
        /// The first.
        low: f64,
        /// The last.
        high: f64,
        /// How many.
        count: usize,
    },
}

impl Values {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::List(list) => list.len(),
            Self::Linear { count, .. } => *count,
        }
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at a place; none beyond the last.
    pub fn get(&self, place: usize) -> Option<Setting> {
        match self {
            Self::List(list) => list.get(place).cloned(),
            Self::Linear { low, high, count } => (place < *count).then(|| {
                let last = place + 1 == *count && *count > 1;
                let share = place as f64 / count.saturating_sub(1).max(1) as f64;
                Setting::Number(if last { *high } else { whole(low + (high - low) * share, (*low, *high)) })
            }),
        }
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = Setting> {
        (0..self.len()).filter_map(|place| self.get(place))
    }

    /// The places of the least and of the largest; a word counts as its place.
    pub(super) fn ends(&self) -> Option<(usize, usize)> {
        let number = |place: &usize| match self.get(*place) {
            Some(Setting::Number(x)) => x,
            Some(Setting::Text(_)) | None => *place as f64,
        };
        match self {
            Self::Linear { low, high, count } => {
                let last = count.checked_sub(1)?;
                Some(if low <= high { (0, last) } else { (last, 0) })
            }
            Self::List(list) => {
                let by = |a: &usize, b: &usize| number(a).total_cmp(&number(b));
                Some(((0..list.len()).min_by(by)?, (0..list.len()).max_by(by)?))
            }
        }
    }
}

/// A number between two whole ones that is whole but for rounding is so: a count stays one.
fn whole(x: f64, (low, high): (f64, f64)) -> f64 {
    let near = x.round();
    let rounding = 4.0 * f64::EPSILON * low.abs().max(high.abs());
    if low.fract() == 0.0 && high.fract() == 0.0 && (x - near).abs() <= rounding { near } else { x }
}

impl From<Vec<Setting>> for Values {
    fn from(list: Vec<Setting>) -> Self {
        Self::List(list)
    }
}

/// Equal values are equal in any notation.
impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

#[cfg(test)]
mod tests {
    //! A range gives the same values as the equivalent list.
    use super::*;

    #[test]
    fn ends_are_exact_and_lists_are_equal() {
        let axis = Values::Linear { low: 0.1, high: 0.7, count: 7 };
        let list: Values = axis.iter().collect::<Vec<_>>().into();
        assert_eq!(axis, list);
        assert_eq!((axis.get(0), axis.get(6)), (Some(Setting::Number(0.1)), Some(Setting::Number(0.7))));
        assert_eq!((axis.get(7), axis.len(), axis.ends(), list.ends()), (None, 7, Some((0, 6)), Some((0, 6))));
        let down = Values::Linear { low: 3.0, high: 1.0, count: 3 };
        assert_eq!((down.ends(), down.get(1)), (Some((2, 0)), Some(Setting::Number(2.0))));
        for last in 2..=200 {
            let counts = Values::Linear { low: 1.0, high: f64::from(last), count: last as usize };
            let listed: Values = (1..=last).map(|n| Setting::Number(f64::from(n))).collect::<Vec<_>>().into();
            assert_eq!(counts, listed);
        }
        let one = Values::Linear { low: 3.0, high: 9.0, count: 1 };
        assert_eq!((one.get(0), one.ends()), (Some(Setting::Number(3.0)), Some((0, 0))));
        let none = Values::Linear { low: 3.0, high: 9.0, count: 0 };
        assert!(none.is_empty() && none.ends().is_none() && none.get(0).is_none());
        let words: Values = ["b", "a"].map(|word| Setting::Text(word.into())).to_vec().into();
        assert_eq!(words.ends(), Some((0, 1)));
    }
}
