//! Axes and shards as text: `w=1.8u:2.2u:21`, `w=1.8u,2u,2.2u`, `1/4`.

use super::axis::SweepParameter;
use super::distribution::number;
use super::error::{SweepError, bad};
use super::spec::Shard;
use super::values::Values;
use bimorph_netlist::parse_setting;
use std::str::FromStr;

/// Most values one axis may be given as text; a longer one is a slip of the keyboard.
const AXIS_MAX: usize = 10_000_000;

impl FromStr for SweepParameter {
    type Err = SweepError;

    /// `NAME=low:high:count` is `count` equally spaced numbers, both ends included; `NAME=a,b,c` is a list. Numbers may
    /// carry a netlist suffix (`2u`); list entries are read as [`parse_setting`] reads them, words as strings.
    fn from_str(text: &str) -> Result<Self, SweepError> {
        let what = || format!("parameter \"{text}\"");
        let forms = "NAME=low:high:count or NAME=a,b,c";
        let (name, values) = text.split_once('=').ok_or_else(|| bad(what(), forms, "no \"=\""))?;
        let (name, values) = (name.trim(), values.trim());
        if name.is_empty() || values.is_empty() {
            return Err(bad(what(), forms, "an empty side of \"=\""));
        }
        let parts: Vec<&str> = values.split(':').map(str::trim).collect();
        let values = match parts[..] {
            [list] => {
                let entry = |text: &str| {
                    let refused = |_| bad(what(), "numbers or words, separated by commas", text);
                    parse_setting(text).map_err(refused)
                };
                list.split(',').map(|text| entry(text.trim())).collect::<Result<Vec<_>, _>>()?.into()
            }
            [low, high, count] => {
                let low = number(low).ok_or_else(|| bad(what(), "a number as low end", low))?;
                let high = number(high).ok_or_else(|| bad(what(), "a number as high end", high))?;
                let n = count.parse().ok().filter(|n| (1..=AXIS_MAX).contains(n));
                Values::Linear { low, high, count: n.ok_or_else(|| bad(what(), "a count from 1", count))? }
            }
            _ => return Err(bad(what(), forms, values)),
        };
        Ok(Self { name: name.to_owned(), values, in_step: false })
    }
}

impl FromStr for Shard {
    type Err = SweepError;

    /// `i/N`, i from 0.
    fn from_str(text: &str) -> Result<Self, SweepError> {
        let parsed = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match parsed {
            Some((index, count)) if index < count => Ok(Self { index, count }),
            _ => Err(bad("shard".into(), "i/N with 0 <= i < N", text)),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Axes read as they are written, and slips are refused.
    use super::*;
    use bimorph_base::Setting;

    fn numbers(text: &str) -> Vec<f64> {
        let axis: SweepParameter = text.parse().expect("an axis");
        axis.values.iter().map(|v| if let Setting::Number(x) = v { x } else { f64::NAN }).collect()
    }

    #[test]
    fn linear_axes_include_both_ends_exactly() {
        assert_eq!(numbers("w=1u:2u:3"), [1e-6, 1.5e-6, 2e-6]);
        assert_eq!(numbers("w=0.1:0.7:7").last(), Some(&0.7));
        assert_eq!(numbers("w=3:9:1"), [3.0]);
    }

    #[test]
    fn lists_hold_numbers_with_suffixes_and_strings() {
        assert_eq!(numbers("w = 1.8u, 2u,-3M"), [1.8e-6, 2e-6, -3e6]);
        let axis: SweepParameter = "layer=p1,'p2'".parse().expect("an axis");
        assert_eq!(axis.values, vec![Setting::Text("p1".into()), Setting::Text("p2".into())].into());
    }

    #[test]
    fn slips_are_refused() {
        for text in ["w", "=1", "w=", "w=1:2", "w=1:2:0", "w=1:2:x", "w=a:2:3", "w=1:2:3:4", "w=1:2:1e9"] {
            assert!(text.parse::<SweepParameter>().is_err(), "{text}");
        }
        for text in ["", "1", "2/2", "0/0", "-1/2", "a/b"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
        assert_eq!("1/4".parse(), Ok(Shard { index: 1, count: 4 }));
    }
}
