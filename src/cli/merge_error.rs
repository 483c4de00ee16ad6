//! Why tables are not the shards of one sweep.

use bimorph::jobs::sweep::shard::COLUMN;
use std::path::PathBuf;
use thiserror::Error;

/// Columns behind the results.
pub(super) const LAST: [&str; 3] = ["estimated_error [1]", "warning", "error"];

/// Why tables are not the shards of one sweep.
#[derive(Debug, Error)]
pub(crate) enum MergeError {
    #[error("{}: {source}", path.display())]
    Csv { path: PathBuf, source: csv::Error },
    #[error(
        "{} is no table of `bimorph sweep`: its first line has to begin with \"point\" and end with \"{}\"",
        path.display(),
        LAST.join(",")
    )]
    NoTable { path: PathBuf },
    #[error(
        "{} does not say of which sweep it is a part: `bimorph sweep --shard I/N` writes tables that do, in the column \"{}\"",
        path.display(),
        COLUMN
    )]
    NoPart { path: PathBuf },
    #[error(
        "{} is of another sweep than {}: the netlist or its name, the options, the parameters or the version of bimorph differ",
        path.display(),
        first.display()
    )]
    Other { path: PathBuf, first: PathBuf },
    #[error("{}: \"{got}\" is no number of a point", path.display())]
    NoNumber { path: PathBuf, got: String },
    #[error("point {point} is in {} and in {}", first.display(), second.display())]
    Twice { point: usize, first: PathBuf, second: PathBuf },
    #[error("{missing} points are in none of the tables, the first of them point {first}: is a shard left out?")]
    Missing { missing: usize, first: usize },
}
