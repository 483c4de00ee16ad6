//! Motion in time: one step of each method, and what drives them. A method is written once, over the [`equations`](crate::equations) of
//! any formulation, unless it needs what one alone has.
//!
//! | file | what it holds |
//! |---|---|
//! | [`method`] | the trait of integrators: one step, its estimated error, its work |
//! | [`adaptive`] | drives any of them: error control, or equal steps |
//! | `pace` | how long the next step is |
//! | [`doubling`] | error control by step doubling for methods without an estimate |
//! | [`interpolation`] | the motion inside a step |
//! | [`event`] | when a quantity crosses zero during a step |
//!
//! Over any equations:
//!
//! | file | what it holds |
//! |---|---|
//! | [`dirk`] | diagonally implicit Runge–Kutta methods by their [`tableau`]: TR-BDF2, SDIRK4, implicit midpoint |
//! | [`alpha`] | generalized-α with a chosen damping of fast motions, and Newmark's rule |
//! | [`explicit`] | Dormand–Prince |
//! | [`dormand_prince`] | the pair itself; and its own driver, for mechanisms without a system, down to 1e-13 |
//! | [`joint_motion`] | such mechanisms in joint coordinates, loops closed after each step |
//!
//! On bodies, with what their tangent gives:
//!
//! | file | what it holds |
//! |---|---|
//! | `rosenbrock` | the stages of Rodas4, in any of the coordinates below |
//! | [`rodas4`] | the default: a Rosenbrock method with one factorization a step, and its sensitivities |
//! | [`joint_rodas4`] | the same in joint coordinates with loops closed by springs |
//! | [`reduced_rodas4`] | the same over the coordinates of a reduced model |
//! | [`formulated`] | either, by the formulation of a model |
//! | [`radau5`] | Radau IIA of order 5: one real and one complex block factorization a step |
//! | [`average_field`] | average vector field, which keeps the energy |
//! | [`defect`] | the error of a run with Rodas4, by its defect |
//! | `stage_loss` | forces of contact that loses energy in the stages of both |
//! | [`gyration`] | Coriolis' force in a frame that turns |
//! | [`batch`] | runs of many variants in lanes |
//! | [`reduced_batch`] | runs of one reduced model in lanes |

pub mod adaptive;
pub mod alpha;
pub mod average_field;
pub mod batch;
pub mod defect;
pub mod dirk;
pub mod dormand_prince;
pub mod doubling;
pub mod event;
pub mod explicit;
pub mod formulated;
pub mod gyration;
pub mod interpolation;
pub mod joint_motion;
pub mod joint_rodas4;
pub mod method;
mod pace;
pub mod radau5;
pub mod reduced_batch;
pub mod reduced_rodas4;
pub mod rodas4;
mod rosenbrock;
mod stage_loss;
pub mod tableau;
