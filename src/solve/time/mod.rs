//! Motion in time: one step of each method, and what drives them.
//!
//! On bodies:
//!
//! | file | what it holds |
//! |---|---|
//! | [`method`] | what every integrator is: one step, its estimated error, its work |
//! | [`adaptive`] | drives any of them: error control, or equal steps |
//! | [`doubling`] | error control by step doubling for methods without an estimate |
//! | [`interpolation`] | the motion inside a step |
//! | [`event`] | when a quantity crosses zero during a step |
//! | [`rodas4`] | the default: a Rosenbrock method with one factorization a step, and its sensitivities |
//! | [`formulated`] | it in the formulation of a model |
//! | [`radau5`] | Radau IIA of order 5: one real and one complex block factorization a step |
//! | `implicit` | the equation that a step with one unknown displacement comes to |
//! | [`centred`] | steps that are symmetric about their middle: [`midpoint`], and [`avf`], which keeps the energy |
//! | [`dirk`] | diagonally implicit Runge–Kutta methods by their tableau: TR-BDF2, SDIRK4 |
//! | [`generalized_alpha`] | generalized-α with a chosen damping of fast motions, and Newmark's rule |
//! | [`rk45`] | Dormand–Prince on bodies: explicit |
//!
//! For both: [`tableau`] has the coefficients of implicit methods, and `pace` says how long the next step is.
//!
//! In joint coordinates, or on any flat slices:
//!
//! | file | what it holds |
//! |---|---|
//! | [`dormand_prince`] | an explicit Runge–Kutta pair for any formulation that tells its accelerations |
//! | [`joint_rodas4`] | Rodas4 with loops closed by springs: one factorization a step, and its sensitivities |
//! | [`joint_motion`] | motion in joint coordinates, loops closed after each step |
//! | [`joint_loads`] | what acts on a system there |
//! | [`joint_stage`] | the stages of implicit methods |
//! | `anderson` | acceleration of an iteration that contracts slowly |
//! | [`joint_dirk`] | implicit methods |
//! | [`joint_adaptive`] | drives them: error control, or equal steps |

pub mod adaptive;
mod anderson;
pub mod avf;
pub mod centred;
pub mod dirk;
pub mod dormand_prince;
pub mod doubling;
pub mod event;
pub mod formulated;
pub mod generalized_alpha;
pub mod gyration;
mod implicit;
pub mod interpolation;
pub mod joint_adaptive;
pub mod joint_dirk;
pub mod joint_loads;
pub mod joint_motion;
pub mod joint_rodas4;
pub mod joint_stage;
pub mod method;
pub mod midpoint;
mod pace;
pub mod radau5;
pub mod rk45;
pub mod rodas4;
pub mod side_by_side;
pub mod tableau;
