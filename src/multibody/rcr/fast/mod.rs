//! What is there for speed alone, with the bits that come out without it.
//!
//! | file | what it holds |
//! |---|---|
//! | `pins` | runs of pins, walked side by side |
//! | `kernels` | one coordinate and small fronts, in closed form |
//! | `lanes` | numbers of eight variants side by side |
//! | `dispatch` | the recursion in the widest instructions of the processor at hand |
//! | `packs` | equal subtrees of one mechanism side by side |

mod dispatch;
mod kernels;
mod lanes;
mod packs;
mod pins;

pub(crate) use dispatch::has_lanes;
pub(super) use dispatch::{accelerate, place, reduce};
pub(super) use kernels::Small;
pub use lanes::Lanes;
pub(super) use packs::Packs;
