//! Coefficients of Rodas4.
//!
//! Source: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), table 7.1 (RODAS).

/// γ, the diagonal of the method.
pub(crate) const GAMMA: f64 = 0.25;
/// Stage positions α_i and γ_i.
pub(crate) const ALPHA: [f64; 6] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// From this stage on the motion itself carries the argument: the last stages add increments to it, as the result does.
pub(super) const IN_PLACE: usize = 4;
/// True for a stage at another time than the one before it, or than the start.
pub(crate) fn moves_on(i: usize) -> bool {
    i > 0 && ALPHA[i] != ALPHA[i - 1]
}
pub(crate) const GAMMA_I: [f64; 6] = [0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0];
#[rustfmt::skip]
pub(crate) const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0],
];
#[rustfmt::skip]
pub(crate) const C: [[f64; 5]; 6] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
    [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616, 0.0],
    [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
];
