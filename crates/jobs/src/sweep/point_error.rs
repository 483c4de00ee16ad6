//! Why a point has no result.

use bimorph_base::budget::Stopped;
use std::fmt;

/// Why a point has no result.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Failed {
    /// It has no result with any executor.
    Point(String),
    /// The quota of its owner is used up; a later run may succeed.
    Owner(Stopped),
}

impl From<String> for Failed {
    fn from(text: String) -> Self {
        Self::Point(text)
    }
}

impl From<Stopped> for Failed {
    fn from(why: Stopped) -> Self {
        match why {
            Stopped::OwnerBytes { .. } | Stopped::OwnerCpu { .. } => Self::Owner(why),
            why => Self::Point(why.to_string()),
        }
    }
}

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Point(text) => f.write_str(text),
            Self::Owner(why) => why.fmt(f),
        }
    }
}
