//! Which bodies have a front so small that their turn is written in closed form (`kernels`).

/// How small a front is: four times its bodies, and the constraint rows that reach it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::joint_coordinates::constrained_loops) struct SmallFront(pub u8);

impl SmallFront {
    /// Of a body with one coordinate, a front of one or two bodies and at most three rows; none of any other.
    pub(in crate::joint_coordinates::constrained_loops) fn of(
        freedom: usize,
        front: usize,
        rows: usize,
    ) -> Option<Self> {
        let small = freedom == 1 && (1..=2).contains(&front) && rows <= 3;
        small.then_some(Self((4 * front + rows) as u8))
    }
}
