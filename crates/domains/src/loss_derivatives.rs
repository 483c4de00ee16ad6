//! Derivatives of the forces that depend on rates (of contact that loses energy, [`super::contact_loss`], and of gas) over the bodies of a system.

use super::domain::SkewCoupling;
use super::system::System;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BlockMatrix, BodyId, Model};

/// Derivatives with displacements and with rates.
#[derive(Debug, Clone)]
pub struct LossDerivatives {
    stiffness: BlockMatrix<f64, 3>,
    damping: BlockMatrix<f64, 3>,
    /// The skew part of the derivatives with displacements; `stiffness` is the symmetric one.
    skew: Vec<SkewCoupling>,
    /// They are not zero.
    acts: bool,
}

impl LossDerivatives {
    /// Storage, all zero.
    #[inline]
    pub fn new(model: &Model) -> Self {
        let zeros = BlockMatrix::new(&model.pattern);
        Self { stiffness: zeros.clone(), damping: zeros, skew: Vec::new(), acts: false }
    }

    /// Storage; none for a system without such forces.
    #[inline]
    pub fn of(system: &System) -> Option<Self> {
        system.loses().then(|| Self::new(&system.model))
    }

    /// Takes them at displacements `q` and the rate of each body.
    #[inline]
    pub fn at(&mut self, system: &System, q: &[Pose], rate: impl Fn(usize) -> Pose) {
        if self.acts {
            self.stiffness.clear();
            self.damping.clear();
        }
        self.acts = system.add_loss_tangent(q, &rate, &mut self.stiffness, &mut self.damping);
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
    pub fn damping(&self) -> Option<&BlockMatrix<f64, 3>> {
        self.acts.then_some(&self.damping)
    }

    /// The skew part of the derivatives with displacements.
    #[inline]
    pub fn skew(&self) -> &[SkewCoupling] {
        &self.skew
    }

    /// `to +=` the derivatives with displacements times `beta` and those with rates times `gamma`, but for the skew part.
    #[inline]
    pub fn add_to(&self, [beta, gamma]: [f64; 2], to: &mut BlockMatrix<f64, 3>) {
        self.add_stiffness(beta, to);
        if self.acts {
            self.damping.add_to(gamma, to);
        }
    }

    /// `to +=` the derivatives with displacements times `beta`, but for the skew part.
    #[inline]
    pub fn add_stiffness(&self, beta: f64, to: &mut BlockMatrix<f64, 3>) {
        if self.acts {
            self.stiffness.add_to(beta, to);
        }
    }

    /// `force +=` the damping at the rate of each body.
    #[inline]
    pub fn add_damping(&self, model: &Model, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if self.acts {
            self.damping.multiply_add_of(&model.pattern, rate, force);
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
