//! Why a point has no result.

use crate::budget::Stopped;
use std::fmt;

/// Why a point has no result.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Failed {
    /// It has none, whoever computes it.
    Point(String),
    /// What its owner may use is used up: it may have one another time.
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
