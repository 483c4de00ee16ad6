//! The recursion with its storage: loads in, accelerations out.

use super::data::{Given, Offsets, Task, Workspace};
use super::fast;
use super::mechanism::Mechanism;
use super::placed::{Placed, Placement};
use super::scalar::Real;
use super::schedule::Plan;
use super::singular::Room;
use super::traversal::Traversal;
use super::tree::Linkage;
use std::sync::Arc;

/// The recursion with its storage, over one mechanism or over lanes of variants. Copies share what does not move.
#[derive(Debug, Clone)]
pub struct Reduction<T: Real> {
    pub(super) mechanism: Arc<Mechanism<T>>,
    /// Wrench on each body: forces along x and y and moment about the centre of mass [N, N·m]. Set before reducing.
    pub force: Vec<[T; 3]>,
    /// Force on each coordinate [N or N·m]. Set before reducing.
    pub torque: Vec<T>,
    /// Acceleration of each body.
    pub accelerations: Vec<[T; 3]>,
    /// Worst of lever/pivot over the dependent coordinates of the last reduction: 1 in a well-conditioned loop, infinite in
    /// a singular configuration. The squares of it multiply rounding errors.
    pub nearness: T,
    pub(super) offsets: Offsets<T>,
    pub(super) placement: Placement<T>,
    pub(super) work: Workspace<T>,
    pub(super) room: Room,
    /// How the bodies are gone through, where not one after the other.
    pub(super) traversal: Option<Box<T::Traversal>>,
}

impl<T: Real> Reduction<T> {
    /// Storage for one variant per lane; all must have the same tree and loops (fewer variants are repeated). Over one
    /// `f64`, subtrees that are equal in structure go side by side through vector instructions.
    pub fn new(variants: &[&Linkage]) -> Self {
        let mut reduction = Self::without_packs(variants);
        reduction.traversal = T::Traversal::new(variants[0], &reduction);
        reduction
    }

    /// [`Reduction::new`] with every body on its own: slower where subtrees are equal, and the same bits.
    pub fn without_packs(variants: &[&Linkage]) -> Self {
        Self::planned(variants, Plan { coupled: false, fast: true })
    }

    /// [`Reduction::new`] without anything that is there for speed alone: the same bits.
    pub fn plain(variants: &[&Linkage]) -> Self {
        Self::planned(variants, Plan { coupled: false, fast: false })
    }

    pub(super) fn planned(variants: &[&Linkage], plan: Plan) -> Self {
        let coordinates = variants[0].coordinates;
        let mechanism = Mechanism::new(variants, plan);
        Self {
            force: vec![[T::ZERO; 3]; mechanism.bodies()],
            torque: vec![T::ZERO; coordinates],
            accelerations: vec![[T::ZERO; 3]; mechanism.bodies()],
            nearness: T::ZERO,
            offsets: Offsets::new(variants),
            placement: Placement::new(&mechanism, coordinates),
            work: Workspace::new(&mechanism, coordinates),
            room: Room::new(&mechanism.schedule),
            traversal: None,
            mechanism: Arc::new(mechanism),
        }
    }

    /// Multiplications of one reduction: the count that grows linearly with n + m.
    pub fn multiplications(&self) -> u64 {
        self.mechanism.schedule.multiplications
    }

    /// Number of bodies that are reduced side by side with those of equal subtrees.
    pub fn side_by_side(&self) -> usize {
        self.traversal.as_ref().map_or(0, |t| t.side_by_side())
    }

    /// Places all bodies for coordinates `q` and rates `v`.
    pub fn place(&mut self, q: &[T], v: &[T]) {
        fast::place(self, q, v);
    }

    /// Solves for `task` at the placed configuration; `out` receives q̈, or the change of the rates or coordinates.
    ///
    /// The result is right to rounding times the square of [`Reduction::nearness`].
    pub fn reduce(&mut self, task: Task, out: &mut [T]) {
        fast::reduce(self, task, out);
    }

    /// Places the bodies at `q`, `v` and finds q̈ in `out`, with the forces that [`Reduction::force`] and
    /// [`Reduction::torque`] hold: [`Reduction::place`] and [`Reduction::reduce`] at one go.
    pub fn accelerate(&mut self, q: &[T], v: &[T], out: &mut [T]) {
        fast::accelerate(self, q, v, out);
    }

    /// Displacement and rotation of a body from its drawn place [m, m, rad].
    pub fn pose(&self, body: usize) -> [T; 3] {
        self.placed(body).pose
    }

    /// Rate of a body's pose.
    pub fn rate(&self, body: usize) -> [T; 3] {
        self.placed(body).rate
    }

    /// Where a body is and how it moves.
    pub(super) fn placed(&self, body: usize) -> Placed<T> {
        self.traversal.as_ref().and_then(|t| t.placed(body)).unwrap_or(self.placement.placed[body])
    }

    /// What a reduction reads, what it works in, and where accelerations go.
    #[inline(always)]
    pub(super) fn parts(&mut self, task: Task) -> (Given<'_, T>, &mut Workspace<T>, &mut [[T; 3]]) {
        let Self { mechanism, force, torque, offsets, placement, work, accelerations, .. } = self;
        (Given { task, mechanism, offsets, placement, force, torque }, work, accelerations)
    }
}
