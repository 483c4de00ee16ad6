//! Polynomials in the stages of an integrator: forces over z with inertia, their tangent, mass and damping.
//!
//! With the monomials m_k of z, every function of a configuration is a row C·m. Strains of closures bring the stress e, approaches of gaps the
//! forces of their laws, and mass-weighted displacements p of bodies the push p̈, so that
//! ```text
//! R = K_T·z + C_d·ż − t·T − t₀ + (∂m/∂z)ᵀ·b          b = C_eᵀ·(e − ρ·T − ρ₀) + C_pᵀ·p̈ + C_uᵀ·φ′(u) − C_Wᵀ·F
//! ```
//! The mass matrix is (∂p/∂z)ᵀ·(∂p/∂z) at each state, and forces quadratic in rates are in p̈. No body is placed.

pub mod lanes;
mod point_state;

use super::chain::{MonomialChain, MonomialValues};
use super::rows::{LaneColumns, PolynomialRows, add_gram};
use super::shapes::MemberPoints;
use super::{PolynomialModel, monomials::Polynomials};
use bimorph_domains::capacitor::Capacitor;
use bimorph_domains::{Domain, Drive, Law, PointLaw, System};
use bimorph_multibody::batch::{Kernel, LANES, Lane8, SimdReal, everywhere};
use nalgebra::DMatrix;
use point_state::PointState;

/// The polynomials of a space whose directions are turned as theirs are: z = A·x.
#[derive(Debug, Clone)]
pub struct PolynomialMotion {
    chain: MonomialChain,
    /// Φᵀ·K_T·Φ (1).
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
    /// [K_T, C_d, −t, −t₀]: the linear forces of coordinates, rates, free strains and built-in strains.
    linear: LaneColumns,
    strains: PolynomialRows,
    /// [−ρ, −ρ₀]: stresses of free strains and built-in strains.
    rests: LaneColumns,
    inertia: PolynomialRows,
    shapes: PolynomialRows,
    members: Vec<MemberPoints>,
    /// Shapes × points.
    mix: DMatrix<f64>,
    /// First points of combs, which depend on the next one, too.
    combs: Vec<usize>,
    /// Whether laws of points resist rates.
    resists: bool,
    works: PolynomialRows,
    /// Whether there are loads.
    loaded: bool,
}

/// Storage of an evaluation. Nothing is allocated after [`PolynomialForces::new`].
#[derive(Debug, Clone)]
pub struct PolynomialForces {
    at: MonomialValues,
    /// Coordinates, rates, free strains and the factor of built-in strains.
    given: Vec<f64>,
    force: Vec<f64>,
    /// b, and the same with its gradient taken.
    combined: Vec<f64>,
    reversed: Vec<f64>,
    stress: Vec<f64>,
    push: Vec<f64>,
    shape: Vec<f64>,
    shape_rate: Vec<f64>,
    work: Vec<f64>,
    points: Vec<PointState>,
    strain_slopes: Vec<Lane8>,
    inertia_slopes: Vec<Lane8>,
    shape_slopes: Vec<Lane8>,
    /// Shapes × shapes: stiffness and damping of the points.
    of_shapes: [DMatrix<f64>; 2],
    /// Changes of the values, of what is given and of b.
    change: MonomialValues,
    point_change: Vec<f64>,
    given_change: Vec<f64>,
    combined_change: Vec<f64>,
}

/// Whether all that acts on a system has a law of points; of those that lose energy, contacts between plates and of combs alone. Floating conductors join the laws of
/// several gaps.
pub fn has_polynomials(system: &System) -> bool {
    let with_contact =
        |law: &PointLaw| matches!(law.law, Some(Law::Field(Capacitor::Plates { .. }, Some(_)) | Law::Comb(_)));
    let joined = !system.electrics.floating.is_empty();
    !joined
        && system.members.iter().all(|member| {
            let laws = member.point_laws();
            let has_none = laws.is_empty() && (member.is_gas() || member.is_active(1.0));
            !(member.slides() || has_none) && laws.iter().all(|law| law.loss == 0.0 || with_contact(law))
        })
}

impl PolynomialMotion {
    /// Of a model with rows of inertia.
    pub(super) fn new(model: &PolynomialModel) -> Self {
        let a = model.scale;
        let chain = MonomialChain::new(&model.monomials);
        // coefficients over z: a monomial of x of the degree d is one of z over A^d
        let rows = |of: &Polynomials, unit: f64| {
            let mut c = of.coefficients.clone();
            for (k, factors) in model.monomials.factors.iter().enumerate() {
                let degree = i32::try_from(factors.len()).unwrap_or(i32::MAX);
                c.column_mut(k).scale_mut(unit * a.powi(-degree));
            }
            PolynomialRows::new(&c, &chain)
        };
        let closures = &model.closures;
        let laws = || model.approaches.members.iter().flat_map(|points| &points.laws);
        let m = model.size();
        let beside = |parts: &[DMatrix<f64>]| {
            let columns: Vec<_> = parts.iter().flat_map(|part| part.column_iter().map(|c| c.into_owned())).collect();
            DMatrix::from_columns(&columns)
        };
        let rest = |by_heat: &DMatrix<f64>, built_in: &nalgebra::DVector<f64>| {
            [by_heat * -a, DMatrix::from_columns(&[built_in * -a])]
        };
        let [by_heat, built_in] = rest(&model.thermal, &model.built_in);
        let strains = rows(&closures.strains, a);
        Self {
            linear: LaneColumns::new(
                &beside(&[model.stiffness.clone(), model.damping.clone(), by_heat, built_in]),
                m.div_ceil(LANES),
            ),
            stiffness: model.stiffness.clone(),
            damping: model.damping.clone(),
            rests: LaneColumns::new(&beside(&rest(&closures.thermal, &closures.built_in)), strains.groups()),
            strains,
            inertia: rows(&model.inertia, a),
            shapes: rows(&model.approaches.shapes, 1.0),
            members: model.approaches.members.clone(),
            mix: model.approaches.mix.transpose(),
            combs: (model.approaches.members.iter())
                .flat_map(|points| (points.first..).zip(&points.laws))
                .filter_map(|(point, law)| law.comb().map(|_| point))
                .collect(),
            resists: laws().any(|law| law.film.is_some() || law.loss > 0.0),
            works: rows(&model.work, 1.0),
            loaded: model.work.coefficients.amax() > 0.0,
            chain,
        }
    }
}

impl PolynomialForces {
    /// Storage.
    pub fn new(of: &PolynomialMotion) -> Self {
        let heaters = of.rests.columns() - 1;
        let (m, shapes) = (of.stiffness.nrows(), of.shapes.count);
        let at = of.chain.storage();
        let combined = vec![0.0; at.values.len()];
        Self {
            change: at.clone(),
            point_change: vec![0.0; of.mix.ncols()],
            given_change: vec![0.0; 2 * m + heaters + 1],
            combined_change: combined.clone(),
            given: vec![0.0; 2 * m + heaters + 1],
            force: vec![0.0; m.div_ceil(LANES) * LANES],
            reversed: combined.clone(),
            combined,
            stress: of.strains.storage(),
            push: of.inertia.storage(),
            shape: of.shapes.storage(),
            shape_rate: of.shapes.storage(),
            work: of.works.storage(),
            points: vec![PointState::default(); of.mix.ncols()],
            strain_slopes: of.strains.slope_storage(m),
            inertia_slopes: of.inertia.slope_storage(m),
            shape_slopes: of.shapes.slope_storage(m),
            of_shapes: [DMatrix::zeros(shapes, shapes), DMatrix::zeros(shapes, shapes)],
            at,
        }
    }

    /// The force R at coordinates, rates and accelerations.
    pub fn residual(&mut self, of: &PolynomialMotion, motion: [&[f64]; 3], drive: &Drive, force: &mut [f64]) {
        everywhere(ResidualKernel { forces: self, of, motion, drive, force });
    }

    #[inline(always)]
    fn fill_residual<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        of: &PolynomialMotion,
        (motion, drive): ([&[f64]; 3], &Drive),
        force: &mut [f64],
    ) {
        let m = force.len();
        let [z, v, _] = motion;
        self.given[..m].copy_from_slice(z);
        self.given[m..2 * m].copy_from_slice(v);
        give(m, drive, &mut self.given);
        of.chain.place(motion, &mut self.at);
        of.strains.values::<W>(simd, &self.at.values, &mut self.stress);
        of.rests.add_product::<W>(simd, &self.given[2 * m..], &mut self.stress);
        of.inertia.values::<W>(simd, &self.at.pushes, &mut self.push);
        self.combined.fill(0.0);
        of.strains.add_combined::<W>(simd, &self.stress, &mut self.combined);
        of.inertia.add_combined::<W>(simd, &self.push, &mut self.combined);
        if !self.points.is_empty() {
            self.press::<W>(simd, of, drive);
        }
        if of.loaded {
            self.load(drive);
            of.works.add_combined::<W>(simd, &self.work, &mut self.combined);
        }
        self.force.fill(0.0);
        of.linear.add_product::<W>(simd, &self.given, &mut self.force);
        self.reversed.copy_from_slice(&self.combined);
        of.chain.add_gradient(z, &self.at, &mut self.reversed, &mut self.force);
        force.copy_from_slice(&self.force[..m]);
    }

    /// Loads of a drive, or their rates.
    fn load(&mut self, drive: &Drive) {
        self.work[0] = -drive.load;
        self.work[1..].iter_mut().zip(&drive.inputs).for_each(|(work, size)| *work = -size);
    }

    /// The laws of all points, and what they bring to the monomials.
    #[inline(always)]
    fn press<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion, drive: &Drive) {
        of.shapes.values::<W>(simd, &self.at.values, &mut self.shape);
        if of.resists {
            of.shapes.values::<W>(simd, &self.at.rates, &mut self.shape_rate);
        }
        let sum = |point: usize, of_shapes: &[f64]| -> f64 {
            of.mix.column(point).iter().zip(of_shapes).map(|(share, y)| share * y).sum()
        };
        for points in &of.members {
            let volts = drive.volts[points.member];
            for (k, law) in points.laws.iter().enumerate() {
                let point = points.first + k;
                let motion = |point: usize| {
                    let rate = if of.resists { sum(point, &self.shape_rate) } else { 0.0 };
                    (sum(point, &self.shape), rate)
                };
                if let Some(comb) = law.comb() {
                    let both = PointState::of_comb((comb, law.loss), [motion(point), motion(point + 1)], volts);
                    self.points[point..point + 2].copy_from_slice(&both);
                } else if law.law != Some(Law::Across) {
                    self.points[point] = PointState::of(law, motion(point), volts);
                }
            }
        }
        // the values of shapes are not needed any more: what acts on shapes stands in their place
        self.shape.fill(0.0);
        for (point, state) in self.points.iter().enumerate() {
            self.shape.iter_mut().zip(of.mix.column(point).iter()).for_each(|(to, share)| *to += share * state.force);
        }
        of.shapes.add_combined::<W>(simd, &self.shape, &mut self.combined);
    }

    /// Mass, damping and stiffness where the residual was taken last.
    pub fn matrices(
        &mut self,
        of: &PolynomialMotion,
        mass: &mut DMatrix<f64>,
        damping: &mut DMatrix<f64>,
        stiffness: &mut DMatrix<f64>,
    ) {
        everywhere(MatricesKernel { forces: self, of, to: [mass, damping, stiffness] });
    }

    #[inline(always)]
    fn fill_matrices<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        of: &PolynomialMotion,
        [mass, damping, stiffness]: [&mut DMatrix<f64>; 3],
    ) {
        let m = mass.nrows();
        of.chain.differentiate(&self.given[..m], &mut self.at);
        stiffness.copy_from(&of.stiffness);
        of.strains.slopes::<W>(simd, &of.chain, &self.at, m, &mut self.strain_slopes);
        add_gram::<W>(simd, &self.strain_slopes, stiffness);
        of.inertia.slopes::<W>(simd, &of.chain, &self.at, m, &mut self.inertia_slopes);
        mass.fill(0.0);
        add_gram::<W>(simd, &self.inertia_slopes, mass);
        damping.copy_from(&of.damping);
        if !self.points.is_empty() {
            self.add_point_matrices::<W>(simd, of, damping, stiffness);
        }
        of.chain.add_curvature(&self.at, &self.combined, stiffness);
    }

    #[inline(always)]
    fn add_point_matrices<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        of: &PolynomialMotion,
        damping: &mut DMatrix<f64>,
        stiffness: &mut DMatrix<f64>,
    ) {
        let (m, shapes) = (stiffness.nrows(), of.shapes.count);
        of.shapes.slopes::<W>(simd, &of.chain, &self.at, m, &mut self.shape_slopes);
        let [by_approach, by_rate] = &mut self.of_shapes;
        by_approach.fill(0.0);
        by_rate.fill(0.0);
        for (point, state) in self.points.iter().enumerate() {
            let shares = of.mix.column(point);
            for (a, first) in shares.iter().enumerate() {
                for (b, second) in shares.iter().enumerate().take(a + 1) {
                    by_approach[(a, b)] += state.stiffness * first * second;
                    by_rate[(a, b)] += state.damping * first * second;
                }
            }
            if of.combs.contains(&point) {
                // as in the full model, the tangent has the mean of both
                let (mixed, next) = (0.5 * (state.mixed[0] + state.mixed[1]), of.mix.column(point + 1));
                for a in 0..shapes {
                    for b in 0..=a {
                        by_approach[(a, b)] += mixed * (shares[a] * next[b] + next[a] * shares[b]);
                    }
                }
            }
        }
        let slopes = &self.shape_slopes;
        let slope = |shape: usize, i: usize| slopes[shape / LANES * m + i].0[shape % LANES];
        let add = |of_shapes: &DMatrix<f64>, to: &mut DMatrix<f64>| {
            for a in 0..shapes {
                for b in 0..=a {
                    let both = of_shapes[(a, b)];
                    for i in 0..m {
                        for j in 0..m {
                            let one = slope(a, i) * slope(b, j);
                            let two = if a == b { 0.0 } else { slope(b, i) * slope(a, j) };
                            to[(i, j)] += both * (one + two);
                        }
                    }
                }
            }
        };
        add(by_approach, stiffness);
        if of.resists {
            add(by_rate, damping);
        }
    }

    /// ∂R/∂t where the residual and the matrices were taken last, as the drive changes at this rate.
    pub fn forcing(&mut self, of: &PolynomialMotion, drive: &Drive, rate: &Drive, out: &mut [f64]) {
        self.forcing_beside(of, [drive, rate], None, out);
    }

    /// The same where forces are those of the products of voltages of `beside`, too.
    pub fn forcing_beside(
        &mut self,
        of: &PolynomialMotion,
        [drive, rate]: [&Drive; 2],
        beside: Option<[&Drive; 2]>,
        out: &mut [f64],
    ) {
        everywhere(ForcingKernel { forces: self, of, drives: [drive, rate], beside, out });
    }

    #[inline(always)]
    fn fill_forcing<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        of: &PolynomialMotion,
        ([drive, rate], beside): ([&Drive; 2], Option<[&Drive; 2]>),
        out: &mut [f64],
    ) {
        let m = out.len();
        self.reversed.fill(0.0);
        self.force.fill(0.0);
        let warms = rate.expansion.iter().any(|x| *x != 0.0) || rate.load != 0.0;
        let charges = rate.volts.iter().any(|v| *v != 0.0) || beside.is_some();
        let loads = of.loaded && (rate.load != 0.0 || rate.inputs.iter().any(|x| *x != 0.0));
        if warms {
            self.given_change[..2 * m].fill(0.0);
            give(m, rate, &mut self.given_change);
            self.stress.fill(0.0);
            of.rests.add_product::<W>(simd, &self.given_change[2 * m..], &mut self.stress);
            of.strains.add_combined::<W>(simd, &self.stress, &mut self.reversed);
        }
        if charges {
            self.shape.fill(0.0);
            self.charge(of, drive, rate);
            if let Some([drive, rate]) = beside {
                self.charge(of, drive, rate);
            }
            of.shapes.add_combined::<W>(simd, &self.shape, &mut self.reversed);
        }
        if loads {
            self.load(rate);
            of.works.add_combined::<W>(simd, &self.work, &mut self.reversed);
        }
        if warms || charges || loads {
            of.chain.add_gradient(&self.given[..m], &self.at, &mut self.reversed, &mut self.force);
        }
        if warms {
            // coordinates and rates have their shares in the tangent
            of.linear.add_product::<W>(simd, &self.given_change, &mut self.force);
        }
        out.copy_from_slice(&self.force[..m]);
    }

    /// `shape +=` the change of the forces of fields, as voltages change.
    fn charge(&mut self, of: &PolynomialMotion, drive: &Drive, change: &Drive) {
        for points in &of.members {
            let both = drive.volts[points.member] * change.volts[points.member];
            for (k, law) in points.laws.iter().enumerate().filter(|_| both != 0.0) {
                let point = points.first + k;
                let approach = |k: usize| self.points[point + k].approach;
                let slopes = match &law.law {
                    Some(Law::Field(capacitor, _)) => [capacitor.at(approach(0)).slope, 0.0],
                    Some(Law::Comb(comb)) => comb.field([approach(0), approach(1)]).first,
                    _ => continue,
                };
                for (point, slope) in (point..).zip(slopes).filter(|(_, slope)| *slope != 0.0) {
                    let shares = of.mix.column(point);
                    self.shape.iter_mut().zip(shares.iter()).for_each(|(to, share)| *to += share * (-both * slope));
                }
            }
        }
    }

    /// The exact change of the force R where the residual was taken last, at `motion`, as that and the drive change.
    pub fn change(
        &mut self,
        of: &PolynomialMotion,
        (motion, moved): ([&[f64]; 3], [&[f64]; 3]),
        (drive, change): (&Drive, &Drive),
        out: &mut [f64],
    ) {
        everywhere(ChangeKernel { forces: self, of, motions: [motion, moved], drives: [drive, change], out });
    }

    #[inline(always)]
    fn fill_change<W: SimdReal>(
        &mut self,
        simd: W::Simd,
        of: &PolynomialMotion,
        [motion, moved]: [[&[f64]; 3]; 2],
        [drive, change]: [&Drive; 2],
        out: &mut [f64],
    ) {
        let m = out.len();
        self.given_change[..m].copy_from_slice(moved[0]);
        self.given_change[m..2 * m].copy_from_slice(moved[1]);
        give(m, change, &mut self.given_change);
        of.chain.place_change(motion, moved, &self.at, &mut self.change);
        of.strains.values::<W>(simd, &self.change.values, &mut self.stress);
        of.rests.add_product::<W>(simd, &self.given_change[2 * m..], &mut self.stress);
        of.inertia.values::<W>(simd, &self.change.pushes, &mut self.push);
        self.combined_change.fill(0.0);
        of.strains.add_combined::<W>(simd, &self.stress, &mut self.combined_change);
        of.inertia.add_combined::<W>(simd, &self.push, &mut self.combined_change);
        if !self.points.is_empty() {
            self.press_change::<W>(simd, of, drive, change);
        }
        if of.loaded {
            self.load(change);
            of.works.add_combined::<W>(simd, &self.work, &mut self.combined_change);
        }
        self.force.fill(0.0);
        of.linear.add_product::<W>(simd, &self.given_change, &mut self.force);
        self.reversed.copy_from_slice(&self.combined);
        let coefficients = [&mut self.reversed[..], &mut self.combined_change[..]];
        of.chain.add_gradient_change([motion[0], moved[0]], [&self.at, &self.change], coefficients, &mut self.force);
        out.copy_from_slice(&self.force[..m]);
    }

    /// Changes of the forces of all points, over the monomials.
    #[inline(always)]
    fn press_change<W: SimdReal>(&mut self, simd: W::Simd, of: &PolynomialMotion, drive: &Drive, change: &Drive) {
        // changes of the shapes and of their rates, point by point; then what acts on the shapes
        of.shapes.values::<W>(simd, &self.change.values, &mut self.shape_rate);
        let mut force = std::mem::take(&mut self.point_change);
        let sum = |point: usize, of_shapes: &[f64]| -> f64 {
            of.mix.column(point).iter().zip(of_shapes).map(|(share, y)| share * y).sum()
        };
        for (point, state) in self.points.iter().enumerate() {
            force[point] = state.stiffness * sum(point, &self.shape_rate);
        }
        for &point in &of.combs {
            for (k, mixed) in self.points[point].mixed.into_iter().enumerate() {
                force[point + k] += mixed * sum(point + 1 - k, &self.shape_rate);
            }
        }
        if of.resists {
            of.shapes.values::<W>(simd, &self.change.rates, &mut self.shape_rate);
            for (point, state) in self.points.iter().enumerate() {
                force[point] += state.damping * sum(point, &self.shape_rate);
            }
        }
        self.shape.fill(0.0);
        for (point, force) in force.iter().enumerate() {
            self.shape.iter_mut().zip(of.mix.column(point).iter()).for_each(|(to, share)| *to += share * force);
        }
        self.point_change = force;
        self.charge(of, drive, change);
        of.shapes.add_combined::<W>(simd, &self.shape, &mut self.combined_change);
    }
}

/// [`PolynomialForces::residual`] in the instructions at hand.
struct ResidualKernel<'a> {
    forces: &'a mut PolynomialForces,
    of: &'a PolynomialMotion,
    motion: [&'a [f64]; 3],
    drive: &'a Drive,
    force: &'a mut [f64],
}

impl Kernel for ResidualKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        self.forces.fill_residual::<W>(simd, self.of, (self.motion, self.drive), self.force);
    }
}

/// [`PolynomialForces::matrices`] in the instructions at hand.
struct MatricesKernel<'a> {
    forces: &'a mut PolynomialForces,
    of: &'a PolynomialMotion,
    to: [&'a mut DMatrix<f64>; 3],
}

impl Kernel for MatricesKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        self.forces.fill_matrices::<W>(simd, self.of, self.to);
    }
}

/// [`PolynomialForces::forcing_beside`] in the instructions at hand.
struct ForcingKernel<'a> {
    forces: &'a mut PolynomialForces,
    of: &'a PolynomialMotion,
    drives: [&'a Drive; 2],
    beside: Option<[&'a Drive; 2]>,
    out: &'a mut [f64],
}

impl Kernel for ForcingKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        self.forces.fill_forcing::<W>(simd, self.of, (self.drives, self.beside), self.out);
    }
}

/// [`PolynomialForces::change`] in the instructions at hand.
struct ChangeKernel<'a> {
    forces: &'a mut PolynomialForces,
    of: &'a PolynomialMotion,
    motions: [[&'a [f64]; 3]; 2],
    drives: [&'a Drive; 2],
    out: &'a mut [f64],
}

impl Kernel for ChangeKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        self.forces.fill_change::<W>(simd, self.of, self.motions, self.drives, self.out);
    }
}

/// Puts the free strains and the factor of built-in strains of a drive, or their rates, behind coordinates and rates.
fn give(m: usize, drive: &Drive, given: &mut [f64]) {
    let (strains, built_in) = given[2 * m..].split_at_mut(drive.expansion.len());
    strains.copy_from_slice(&drive.expansion);
    built_in[0] = drive.load;
}
