//! Natural frequencies about an operating point, and the small-signal response there.
//!
//! | file | what it holds |
//! |---|---|
//! | [`eigen`] | lowest natural frequencies: shift-invert Lanczos on the same factor |
//! | [`subspace`] | many of them at once |
//! | [`fastest`] | the highest natural frequency in joint coordinates |
//! | [`harmonic`] | small-signal response at one frequency: the same factorization over complex numbers |

pub mod eigen;
pub mod fastest;
pub mod harmonic;
pub mod subspace;
