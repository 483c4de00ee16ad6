//! Natural frequencies about an operating point, and the small-signal response there.
//!
//! | file | what it holds |
//! |---|---|
//! | [`eigen`] | lowest natural frequencies: shift-invert Lanczos on the same factor |
//! | [`lanczos`] | largest eigenvalues of an operator |
//! | [`inverse_iteration`] | the last digits of modes, and how good each is |
//! | [`mac`] | which mode of one model is which of another |
//! | [`refined`] | solves that correct themselves in extended precision |
//! | [`subspace`] | many of them at once |
//! | [`batch`] | modes of variants of one mechanism, in lanes |
//! | [`fastest`] | the highest natural frequency in joint coordinates |
//! | [`harmonic`] | small-signal response at one frequency: the same factorization over complex numbers |
//! | [`pole`] | where that has no bound: a damped mode |
//! | [`gyroscopic`] | the same in a frame that turns |

pub mod batch;
pub mod eigen;
pub mod fastest;
pub mod gyroscopic;
pub mod harmonic;
pub mod inverse_iteration;
pub mod lanczos;
pub mod mac;
mod mass;
pub mod pole;
pub mod refined;
pub mod subspace;
mod tridiagonal;
