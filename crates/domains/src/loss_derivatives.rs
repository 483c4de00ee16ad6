//! Derivatives of the forces that depend on rates (of contact that loses energy, [`super::contact_loss`], and of gas) over the bodies of a system.

use super::domain::{Domain, SkewCoupling};
use super::system::{ApartMembers, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix};
use nalgebra::Matrix3;

/// Derivatives with displacements and with rates.
#[derive(Debug, Clone)]
pub struct LossDerivatives {
    stiffness: BodyMatrix,
    damping: BodyMatrix,
    /// The skew part of the derivatives with displacements; `stiffness` is the symmetric one.
    skew: Vec<SkewCoupling>,
    /// Bodies that such forces act on, ascending, and of each the blocks below its diagonal with their rows: all other blocks are zero.
    columns: Vec<(usize, Vec<(usize, usize)>)>,
    /// They are not zero.
    acts: bool,
}

impl LossDerivatives {
    /// Storage, all zero.
    #[inline]
    pub fn new(system: &System) -> Self {
        let zeros = BodyMatrix::new(&system.model.pattern);
        Self { stiffness: zeros.clone(), damping: zeros, skew: Vec::new(), columns: columns(system), acts: false }
    }

    /// Storage; none for a system without such forces.
    #[inline]
    pub fn of(system: &System) -> Option<Self> {
        system.loses().then(|| Self::new(system))
    }

    /// Takes them at displacements `q` and the rate of each body.
    #[inline]
    pub fn at(&mut self, system: &System, q: &[Pose], rate: impl Fn(usize) -> Pose) {
        self.near(system, (q, ApartMembers::default()), rate);
    }

    /// The same without members that are known to be `apart` at `q`.
    #[inline]
    pub fn near(&mut self, system: &System, (q, apart): (&[Pose], ApartMembers), rate: impl Fn(usize) -> Pose) {
        if self.acts {
            for matrix in [&mut self.stiffness, &mut self.damping] {
                for (body, below) in &self.columns {
                    matrix.diagonal[*body] = Matrix3::zeros();
                    below.iter().for_each(|(block, _)| matrix.below[*block] = Matrix3::zeros());
                }
            }
        }
        self.acts = system.add_loss_tangent((q, apart), &rate, &mut self.stiffness, &mut self.damping);
        self.skew.clear();
        system.skew_couplings(q, &rate, |coupling| self.skew.push(coupling));
    }

    /// True where they are not zero.
    #[inline]
    pub fn is_nonzero(&self) -> bool {
        self.acts
    }

    /// Derivatives with rates.
    #[inline]
    pub fn damping(&self) -> Option<&BodyMatrix> {
        self.acts.then_some(&self.damping)
    }

    /// The skew part of the derivatives with displacements.
    #[inline]
    pub fn skew(&self) -> &[SkewCoupling] {
        &self.skew
    }

    /// `to +=` the derivatives with displacements times `beta` and those with rates times `gamma`, but for the skew part.
    #[inline]
    pub fn add_to(&self, [beta, gamma]: [f64; 2], to: &mut BodyMatrix) {
        self.add_stiffness(beta, to);
        self.add_blocks(&self.damping, gamma, to);
    }

    /// `to +=` the derivatives with displacements times `beta`, but for the skew part.
    #[inline]
    pub fn add_stiffness(&self, beta: f64, to: &mut BodyMatrix) {
        self.add_blocks(&self.stiffness, beta, to);
    }

    fn add_blocks(&self, from: &BodyMatrix, factor: f64, to: &mut BodyMatrix) {
        if !self.acts {
            return;
        }
        for (body, below) in &self.columns {
            to.diagonal[*body] += from.diagonal[*body] * factor;
            below.iter().for_each(|(block, _)| to.below[*block] += from.below[*block] * factor);
        }
    }

    /// `force +=` the damping at the rate of each body.
    #[inline]
    pub fn add_damping(&self, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if !self.acts {
            return;
        }
        let BodyMatrix { diagonal, below: blocks, .. } = &self.damping;
        for (body, below) in &self.columns {
            let own = rate(*body);
            let mut sum = diagonal[*body] * own;
            for (block, row) in below {
                sum += blocks[*block].tr_mul(&rate(*row));
                force[*row] += blocks[*block] * own;
            }
            force[*body] += sum;
        }
    }

    /// `force +=` the skew part at displacements `dq`.
    #[inline]
    pub fn add_skew(&self, dq: &[Pose], force: &mut [Pose]) {
        for SkewCoupling { state: (k, i), bodies, half } in &self.skew {
            for (side, body) in bodies.iter().enumerate() {
                if let BodyId::Free(b) = *body {
                    let part = half.fixed_rows::<3>(3 * side);
                    force[*k][*i] += part.dot(&dq[b]);
                    force[b] -= part * dq[*k][*i];
                }
            }
        }
    }
}

/// The blocks of the pattern that members touch which may have such forces, column by column.
fn columns(system: &System) -> Vec<(usize, Vec<(usize, usize)>)> {
    let pattern = &system.model.pattern;
    let mut entries = Vec::new();
    // those of another variant may lose energy where these contacts do not
    for member in system.members.iter().filter(|member| member.damps() || member.touching().is_some()) {
        member.bodies(|body| {
            if let BodyId::Free(k) = body {
                entries.push((k, None));
            }
        });
        member.pairs(|a, b| {
            if let (BodyId::Free(a), BodyId::Free(b)) = (a, b)
                && let Some(block) = pattern.block(a.max(b), a.min(b)).filter(|_| a != b)
            {
                entries.push((a.min(b), Some((block, a.max(b)))));
            }
        });
    }
    entries.sort_unstable();
    entries.dedup();
    let mut columns: Vec<(usize, Vec<(usize, usize)>)> = Vec::new();
    for (body, below) in entries {
        if columns.last().is_none_or(|(last, _)| *last != body) {
            columns.push((body, Vec::new()));
        }
        if let (Some((_, blocks)), Some(below)) = (columns.last_mut(), below) {
            blocks.push(below);
        }
    }
    columns
}
