//! The recursion with its storage: loads in, accelerations out; and the traversal that a scalar type selects.

use super::data::{Offsets, ReductionInput, ReductionTask, Workspace};
use super::mechanism::MechanismConstants;
use super::poses::{BodyKinematics, MechanismKinematics};
use super::schedule::Plan;
use super::singular::RowPool;
use super::tree::Linkage;
use crate::scalar::StoredReal;
use std::fmt::Debug;
use std::sync::Arc;

/// The recursion with its storage, over one mechanism or over lanes of variants. Copies share what does not move.
#[derive(Debug, Clone)]
pub struct Reduction<T: Traversed> {
    pub(super) mechanism: Arc<MechanismConstants<T>>,
    /// Wrench on each body: forces along x and y and moment about the centre of mass (N, N·m). Set before reducing.
    pub force: Vec<[T; 3]>,
    /// Force on each coordinate (N or N·m). Set before reducing.
    pub torque: Vec<T>,
    /// Acceleration of each body.
    pub accelerations: Vec<[T; 3]>,
    /// Worst of lever/pivot over the dependent coordinates of the last reduction: 1 in a well-conditioned loop, infinite in
    /// a singular configuration. The squares of it multiply rounding errors.
    pub nearness: T,
    pub(super) offsets: Offsets<T>,
    pub(super) placement: MechanismKinematics<T>,
    pub(super) work: Workspace<T>,
    pub(super) room: RowPool,
    /// Alternative traversal of the bodies; `None`: one by one.
    pub(super) traversal: Option<Box<T::Traversal>>,
}

/// Scalar type that selects the traversal (serial or packed).
pub trait Traversed: StoredReal {
    /// One body after the other, or a faster way.
    type Traversal: Traversal<Self>;

    /// Places all bodies in the instructions that are fastest for it. Functions of a scalar type are compiled once, not
    /// with every reduction.
    fn place(reduction: &mut Reduction<Self>, q: &[Self], v: &[Self]);

    /// Reduces for `task` likewise.
    fn reduce(reduction: &mut Reduction<Self>, task: ReductionTask, out: &mut [Self]);
}

/// The passes over all bodies. All traversals give bit-identical results.
pub trait Traversal<T: Traversed>: Sized + Clone + Debug + Send + Sync + 'static {
    /// Builds the traversal; `None` where one after the other is as good.
    fn new(linkage: &Linkage, reduction: &Reduction<T>) -> Option<Box<Self>>;

    /// Places all bodies.
    fn place(reduction: &mut Reduction<T>, q: &[T], v: &[T]);

    /// Writes the rows of all closures for `task`. Returns the largest residual.
    fn rows(reduction: &mut Reduction<T>, task: ReductionTask) -> T;

    /// Reduces for `task`.
    fn reduce(reduction: &mut Reduction<T>, task: ReductionTask, out: &mut [T]);

    /// Where a body is and how it moves, that went another way.
    fn placed(&self, body: usize) -> Option<BodyKinematics<T>>;

    /// Places all those bodies where one after the other would have.
    fn spread(&self, placement: &mut MechanismKinematics<T>);

    /// Takes the offsets of locked directions over.
    fn prescribe(&mut self, offsets: &Offsets<T>);

    /// Number of bodies that go another way.
    fn packed_bodies(&self) -> usize;
}

impl<T: Traversed> Reduction<T> {
    /// Storage for one variant per lane; all must have the same tree and loops (fewer variants are repeated). Over one
    /// `f64`, structurally equal subtrees are reduced together in vector instructions.
    #[inline]
    pub fn new(variants: &[&Linkage]) -> Self {
        let mut reduction = Self::without_packs(variants);
        reduction.traversal = T::Traversal::new(variants[0], &reduction);
        reduction
    }

    /// [`Reduction::new`] with every body on its own: slower where subtrees are equal, and the same bits.
    #[inline]
    pub fn without_packs(variants: &[&Linkage]) -> Self {
        Self::planned(variants, Plan { coupled: false, fast: true })
    }

    /// [`Reduction::new`] without anything that is there for speed alone: the same bits.
    #[inline]
    pub fn plain(variants: &[&Linkage]) -> Self {
        Self::planned(variants, Plan { coupled: false, fast: false })
    }

    pub(super) fn planned(variants: &[&Linkage], plan: Plan) -> Self {
        let coordinates = variants[0].coordinates;
        let mechanism = MechanismConstants::new(variants, plan);
        Self {
            force: vec![[T::ZERO; 3]; mechanism.bodies()],
            torque: vec![T::ZERO; coordinates],
            accelerations: vec![[T::ZERO; 3]; mechanism.bodies()],
            nearness: T::ZERO,
            offsets: Offsets::new(variants),
            placement: MechanismKinematics::new(&mechanism, coordinates),
            work: Workspace::new(&mechanism, coordinates),
            room: RowPool::new(&mechanism.schedule),
            traversal: None,
            mechanism: Arc::new(mechanism),
        }
    }

    /// Multiplications of one reduction: the count that grows linearly with n + m.
    #[inline]
    pub fn multiplications(&self) -> u64 {
        self.mechanism.schedule.multiplications
    }

    /// Number of bodies that are reduced in packs of equal subtrees.
    #[inline]
    pub fn packed_bodies(&self) -> usize {
        self.traversal.as_ref().map_or(0, |t| t.packed_bodies())
    }

    /// Displacement and rotation of a body from its drawn place (m, m, rad).
    #[inline]
    pub fn pose(&self, body: usize) -> [T; 3] {
        self.placed(body).pose
    }

    /// Rate of a body's pose.
    #[inline]
    pub fn rate(&self, body: usize) -> [T; 3] {
        self.placed(body).rate
    }

    /// Where a body is and how it moves.
    pub(super) fn placed(&self, body: usize) -> BodyKinematics<T> {
        self.traversal.as_ref().and_then(|t| t.placed(body)).unwrap_or(self.placement.placed[body])
    }

    /// Input, workspace and output of a reduction.
    #[inline(always)]
    pub(super) fn parts(&mut self, task: ReductionTask) -> (ReductionInput<'_, T>, &mut Workspace<T>, &mut [[T; 3]]) {
        let Self { mechanism, force, torque, offsets, placement, work, accelerations, .. } = self;
        (ReductionInput { task, mechanism, offsets, placement, force, torque }, work, accelerations)
    }
}
