//! Column that identifies the sweep and the shard of a row, so that a merge accepts only the complete set of shards of
//! one sweep.

use super::error::SweepError;
use super::journal;
use super::spec::{Shard, SweepSpec};
use bimorph_base::Bundle;
use bimorph_model::options::CompileOptions;
use std::fmt;
use std::str::FromStr;

/// The column that says it.
pub const COLUMN: &str = "part";

/// A part of a sweep: `1/3 of 201 points of 0123456789abcdef0123456789abcdef`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepPart {
    shard: String,
    /// Points of the whole.
    pub points: usize,
    /// The name of the whole: the same for the same points and the same program.
    sweep: String,
}

impl SweepPart {
    /// The shard of a specification.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`] for an invalid grid.
    pub fn of(spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> Result<Self, SweepError> {
        let whole = SweepSpec { shard: Shard::default(), ..spec.clone() };
        let shard = format!("{}/{}", spec.shard.index, spec.shard.count);
        Ok(Self { shard, points: whole.grid_points()?, sweep: journal::name(&whole, bundle, options) })
    }

    /// Whether both are of one sweep.
    pub fn is_with(&self, other: &Self) -> bool {
        (self.points, &self.sweep) == (other.points, &other.sweep)
    }
}

impl fmt::Display for SweepPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} points of {}", self.shard, self.points, self.sweep)
    }
}

/// It is not written as a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SweepPartError;

impl FromStr for SweepPart {
    type Err = SweepPartError;

    fn from_str(text: &str) -> Result<Self, SweepPartError> {
        let mut words = text.split(' ');
        let mut word = || words.next().ok_or(SweepPartError);
        let (shard, of, points, name, of_sweep, sweep) = (word()?, word()?, word()?, word()?, word()?, word()?);
        if (of, name, of_sweep, words.next()) != ("of", "points", "of", None) {
            return Err(SweepPartError);
        }
        let points = points.parse().map_err(|_| SweepPartError)?;
        Ok(Self { shard: shard.to_owned(), points, sweep: sweep.to_owned() })
    }
}
