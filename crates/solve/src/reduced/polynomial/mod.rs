//! A trained space as polynomials of its coordinates, for simulators that know no bodies.
//!
//! With coordinates x, energies in units of E = A² and A the amplitude of the training,
//! ```text
//! Π/E = ½·xᵀ·K_T·x − (t·T + t₀)ᵀ·x + ½·Σ_c (e_c(x) − ρ_c·T − ρ_c0)² + (Σ_k φ_k(u_k(x)) − Σ_i W_i(x)·F_i)/E
//! ```
//! The first term is exact. The strains e_c of the joints that close loops, the approaches u_k of gaps and the works W_i of loads are
//! polynomials of degree 2 or 3. The energy of closures is a sum of squares and never negative, unlike a truncated one. The laws φ_k of gaps are
//! those of the full model. Masses are those at rest, in a file with their slopes, and the coordinates are chosen such that they and the tangent at rest are diagonal.
//!
//! | file | what it holds |
//! |---|---|
//! | `chain` | values and derivatives of monomials, one factor at a time |
//! | `cubature` | fewer points of gaps |
//! | `fast_coordinates` | coordinates without inertia in a file |
//! | [`monomials`] | monomials and sums of them |
//! | [`motion`] | the polynomials in the stages of an integrator |
//! | `moving` | the polynomials for a motion, with their error against exact kinematics |
//! | `rows` | many polynomials of common monomials in vector instructions |
//! | `samples` | equilibria of the full model |
//! | [`shapes`] | the functions of a configuration that become polynomials |
//! | [`fit`] | least squares at states that the space was trained for, and compression |
//! | [`statics`] | equilibria, and their error against the full model |
//! | `varying_mass` | masses of a file that vary with the coordinates |

mod chain;
mod cubature;
pub mod fast_coordinates;
pub mod fit;
pub mod monomials;
pub mod motion;
pub mod moving;
mod rows;
mod samples;
pub mod shapes;
pub mod statics;
mod varying_mass;

use bimorph_domains::{Drive, Law};
use monomials::{Monomials, Polynomials};
use nalgebra::{DMatrix, DVector};
use shapes::MemberPoints;
use std::sync::Arc;

/// The strains of the joints that close loops, compressed.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosureStrains {
    /// Strains; the sum of their squares is twice an energy (√E).
    pub strains: Polynomials,
    /// Rest value per unit of the free strain of each heater, strains × heaters.
    pub thermal: DMatrix<f64>,
    /// Rest value by built-in strains.
    pub built_in: DVector<f64>,
}

/// Approaches of the points of gaps: sums of few shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct Approaches {
    /// Members with their points.
    pub members: Vec<MemberPoints>,
    /// Shapes (m).
    pub shapes: Polynomials,
    /// Share of each shape in each approach, points × shapes.
    pub mix: DMatrix<f64>,
}

/// The model.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialModel {
    /// All monomials.
    pub monomials: Arc<Monomials>,
    /// A: z of the space per x, in a frame turned by `rotation` (√(N·m)).
    pub scale: f64,
    /// R, with z = A·R·x.
    pub rotation: DMatrix<f64>,
    /// Largest |x_k| of the states that it was made for.
    pub reach: Vec<f64>,
    /// K_T.
    pub stiffness: DMatrix<f64>,
    /// t: force per unit of the free strain of each heater, coordinates × heaters.
    pub thermal: DMatrix<f64>,
    /// t₀: force of built-in strains.
    pub built_in: DVector<f64>,
    /// Closures.
    pub closures: ClosureStrains,
    /// Gaps and films.
    pub approaches: Approaches,
    /// Work of the dead loads (J), then that of a unit of each input of the electrical side (m, rad, kg·m).
    pub work: Polynomials,
    /// Readings.
    pub probes: Polynomials,
    /// Displacements times the roots of masses, in which twice the kinetic energy is the sum of the squares of their rates (√E·s); none where only
    /// equilibria are wanted.
    pub inertia: Polynomials,
    /// Diagonal of the mass matrix (s²).
    pub mass: Vec<f64>,
    /// Damping matrix of dampers and drag (s).
    pub damping: DMatrix<f64>,
    /// Change of each diagonal entry with each coordinate, coordinates × coordinates; zero where only motions in the product are wanted (s²).
    pub mass_slopes: DMatrix<f64>,
    /// Relative change of the root of each diagonal entry of the damping with each coordinate, coordinates × coordinates; as for masses (1).
    pub damping_slopes: DMatrix<f64>,
    /// Largest relative change of the mass of the slowest coordinate over the equilibria, beyond that of its slopes (1).
    pub mass_change: f64,
    /// Largest error of a polynomial at states that did not make it, relative to its largest value (1).
    pub fit_error: f64,
}

impl PolynomialModel {
    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.monomials.size
    }

    /// Energy E of a unit (J).
    pub fn energy_unit(&self) -> f64 {
        self.scale * self.scale
    }

    /// Approaches of all points where the monomials have these values (m).
    pub fn approaches(&self, values: &DVector<f64>) -> DVector<f64> {
        &self.approaches.mix * self.approaches.shapes.values(values)
    }

    /// The force ∂Π/∂x over E at rest at `x`, and the tangent where one is wanted.
    pub fn force(&self, x: &[f64], drive: &Drive, tangent: Option<&mut DMatrix<f64>>) -> DVector<f64> {
        let at = DVector::from_column_slice(x);
        let (values, slopes) = (self.monomials.values(x), self.monomials.derivatives(x));
        let expansion = DVector::from_column_slice(&drive.expansion);
        let mut force = &self.stiffness * &at - &self.thermal * &expansion - &self.built_in * drive.load;
        let closures = &self.closures;
        let stress =
            closures.strains.values(&values) - &closures.thermal * &expansion - &closures.built_in * drive.load;
        let unit = 1.0 / self.energy_unit();
        let approach = self.approaches(&values);
        let (mut first, mut second) = (DVector::zeros(approach.len()), DVector::zeros(approach.len()));
        // of combs: first of two approaches, and the derivative with both
        let mut mixed = Vec::new();
        for points in &self.approaches.members {
            let volts = drive.volts[points.member];
            for (k, law) in points.laws.iter().enumerate() {
                let at = points.first + k;
                if let Some(comb) = law.comb() {
                    let potential = comb.potential([approach[at], approach[at + 1]], volts) * unit;
                    first.rows_mut(at, 2).copy_from_slice(&potential.first);
                    (second[at], second[at + 1]) = (potential.second[0], potential.second[2]);
                    mixed.push((at, potential.second[1]));
                } else if law.law != Some(Law::Across) {
                    let point = law.at(approach[at], volts);
                    (first[at], second[at]) = (point.force * unit, point.stiffness * unit);
                }
            }
        }
        let given = DVector::from_iterator(
            self.work.coefficients.nrows(),
            std::iter::once(drive.load).chain(drive.inputs.iter().copied()).map(|size| -size * unit),
        );
        // what each monomial adds to the energy, to first order
        let by_shape = self.approaches.mix.tr_mul(&first);
        let by_monomial = closures.strains.coefficients.tr_mul(&stress)
            + self.approaches.shapes.coefficients.tr_mul(&by_shape)
            + self.work.coefficients.tr_mul(&given);
        force += slopes.tr_mul(&by_monomial);
        if let Some(tangent) = tangent {
            let strains = closures.strains.derivatives(&slopes);
            let moved = &self.approaches.mix * self.approaches.shapes.derivatives(&slopes);
            let mut weighted = moved.clone();
            weighted.row_iter_mut().zip(second.iter()).for_each(|(mut row, k)| row *= *k);
            for (at, k) in mixed {
                for [to, from] in [[at, at + 1], [at + 1, at]] {
                    let added = moved.row(from) * k;
                    let mut row = weighted.row_mut(to);
                    row += added;
                }
            }
            *tangent = &self.stiffness + strains.tr_mul(&strains) + moved.tr_mul(&weighted);
            self.monomials.add_curvature(&by_monomial, x, tangent);
        }
        force
    }
}
