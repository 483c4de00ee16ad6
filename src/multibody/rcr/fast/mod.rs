//! What is there for speed alone.
//!
//! | file | what it holds |
//! |---|---|
//! | `pins` | runs of pins without loops |
//! | `kernels` | one coordinate and small fronts, in closed form |
//! | `lanes` | numbers of eight variants side by side |
//! | `dispatch` | the recursion in the widest instructions of the processor at hand |
//! | `subtrees` | subtrees of one mechanism that are equal in structure |
//! | `packing` | how they are laid into packs of eight |
//! | `packs` | their recursion side by side, and what they exchange with the rest |

mod dispatch;
mod kernels;
mod lanes;
mod packing;
pub(super) mod packs;
mod pins;
mod subtrees;

pub use lanes::Lanes;
