//! What is there for speed alone, with the bits that come out without it.
//!
//! | file | what it holds |
//! |---|---|
//! | `pins` | runs of pins, walked side by side |
//! | `small`, `kernels` | one coordinate and small fronts: which, and their turn in closed form |
//! | `dispatch` | the recursion in the widest instructions of the processor at hand |
//! | `packs` | equal subtrees of one mechanism side by side |

mod dispatch;
mod kernels;
mod packs;
mod pins;
mod small;

pub(super) use dispatch::{place, reduce};
pub(super) use small::SmallFront;
