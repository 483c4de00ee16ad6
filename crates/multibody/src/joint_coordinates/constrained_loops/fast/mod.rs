//! Optional optimizations; results are bit-identical without them.
//!
//! | file | what it holds |
//! |---|---|
//! | `pins` | runs of pins, traversed together |
//! | `small`, `kernels` | one coordinate and small fronts: which, and their turn in closed form |
//! | `dispatch` | the recursion in the widest instructions of the processor at hand |
//! | `packs` | equal subtrees of one mechanism, one per lane |

mod dispatch;
mod kernels;
mod packs;
mod pins;
mod small;

pub(super) use dispatch::{place, reduce};
pub(super) use small::SmallFront;
