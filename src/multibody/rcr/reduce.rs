//! Recursive coordinate reduction: accelerations in O(n + m).
//!
//! 1. outward: poses, rates and velocity parts (`motion`), rows of the closures (`closure`);
//! 2. inward, leaf → root: each body's joint coordinates leave its front (`front`), loops on the way;
//! 3. outward, root → leaf: accelerations.
//!
//! No matrix is assembled: a body's front is its articulated inertia, its couplings to the few bodies that a loop ties it
//! to, and the constraint rows passing through. All storage is laid out in elimination order by [`Reduction::new`].
//!
//! Reference: K. S. Anderson, J. H. Critchley, "Improved 'order-N' performance algorithm for the simulation of constrained
//! multi-rigid-body dynamic systems", Multibody System Dynamics 9 (2003) 185–212.

use super::closure::ClosureData;
use super::front::Front;
use super::linkage::{Linkage, Parent};
use super::motion::{LinkData, Placed, place_all};
use super::real::Real;
use super::schedule::{Kind, NONE, Schedule, Turn};

/// What the right-hand side of a reduction is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Accelerations under the forces, with velocity parts.
    Accelerations,
    /// The smallest change of the rates, in the mass norm, that makes them fulfil the loops.
    Rates,
    /// The same for the positions (one Gauss–Newton step).
    Positions,
}

/// What gathers at a body on the way in, and what a pin keeps for the way out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node<T> {
    /// Inertia that outer bodies hand on: xx, xy, yy, xθ, yθ, θθ.
    pub(super) inertia: [T; 6],
    /// Wrench that they hand on.
    pub(super) momentum: [T; 3],
    /// A pin body's angular acceleration per acceleration of the pin.
    pub(super) slope: [T; 2],
    /// A pin body's angular acceleration when the pin rests.
    pub(super) base: T,
}

impl<T: Real> Node<T> {
    const CLEAN: Self = Self { inertia: [T::ZERO; 6], momentum: [T::ZERO; 3], slope: [T::ZERO; 2], base: T::ZERO };
}

/// The recursion with its storage, over one model or over lanes of variants.
#[derive(Debug, Clone)]
pub struct Reduction<T> {
    pub(super) schedule: Schedule,
    pub(super) links: Vec<LinkData<T>>,
    pub(super) closures: Vec<ClosureData<T>>,
    pub(super) units: Vec<T>,
    pub(super) placed: Vec<Placed<T>>,
    pub(super) axes: Vec<[T; 3]>,
    /// Wrench on each body: forces along x and y and moment about the centre of mass [N, N·m]. Set before reducing.
    pub force: Vec<[T; 3]>,
    /// Force on each coordinate [N or N·m]. Set before reducing.
    pub torque: Vec<T>,
    pub(super) nodes: Vec<Node<T>>,
    pub(super) coupling: Vec<[T; 9]>,
    pub(super) rows: Vec<T>,
    pub(super) coefficients: Vec<T>,
    pub(super) base: Vec<T>,
    turned: Vec<[[T; 3]; 3]>,
    /// Acceleration of each body.
    pub accelerations: Vec<[T; 3]>,
    front: Scratch<T>,
    /// Worst of lever/pivot over the dependent coordinates of the last reduction: 1 in a well-conditioned loop, infinite in
    /// a singular configuration. The squares of it multiply rounding errors.
    pub nearness: T,
}

#[derive(Debug, Clone)]
struct Scratch<T> {
    m: Vec<T>,
    g: Vec<T>,
    r: Vec<T>,
}

impl<T: Real> Reduction<T> {
    /// Storage for one variant per lane; all must have the same tree and loops (fewer variants are repeated).
    pub fn new(variants: &[&Linkage]) -> Self {
        let linkage = variants[0];
        let schedule = Schedule::new(linkage);
        let count = linkage.links.len();
        let links: Vec<LinkData<T>> =
            (0..count).map(|b| LinkData::new(&variants.iter().map(|v| &v.links[b]).collect::<Vec<_>>())).collect();
        let closures = (0..linkage.closures.len())
            .map(|c| {
                let of: Vec<_> =
                    variants.iter().map(|v| (&v.closures[c], v.links[v.closures[c].bodies().0].lever)).collect();
                ClosureData::new(&of)
            })
            .collect();
        let mut units = vec![T::ONE; linkage.coordinates];
        for (b, link) in linkage.links.iter().enumerate() {
            let mut next = link.first;
            for i in 0..3 {
                if link.moving[i] {
                    if i == 2 {
                        for lane in 0..T::LANES {
                            units[next].set_lane(lane, variants[lane % variants.len()].links[b].lever);
                        }
                    }
                    next += 1;
                }
            }
        }
        let turns = &schedule.turns;
        let most = |f: &dyn Fn(&Turn) -> usize| turns.iter().map(f).max().unwrap_or(0);
        let size = most(&|t| t.freedom + 3 * t.front);
        let scratch = Scratch {
            m: vec![T::ZERO; size * size],
            g: vec![T::ZERO; size],
            r: vec![T::ZERO; most(&|t| t.rows) * (size + 1)],
        };
        Self {
            links,
            closures,
            units,
            placed: vec![Placed::REST; count],
            axes: vec![[T::ZERO; 3]; linkage.coordinates],
            force: vec![[T::ZERO; 3]; count],
            torque: vec![T::ZERO; linkage.coordinates],
            nodes: vec![Node::CLEAN; count],
            coupling: vec![[T::ZERO; 9]; linkage.pattern.off_blocks()],
            rows: vec![T::ZERO; schedule.row_entries],
            coefficients: vec![T::ZERO; schedule.coefficient_entries],
            base: vec![T::ZERO; linkage.coordinates],
            turned: vec![[[T::ZERO; 3]; 3]; if turns.iter().any(|t| t.freedom > 1) { count } else { 0 }],
            accelerations: vec![[T::ZERO; 3]; count],
            front: scratch,
            nearness: T::ZERO,
            schedule,
        }
    }

    /// Multiplications of one reduction: the count that grows linearly with n + m.
    pub fn multiplications(&self) -> u64 {
        self.schedule.multiplications
    }

    /// Places all bodies for coordinates `q` and rates `v`.
    #[inline(always)]
    pub fn place(&mut self, linkage: &Linkage, q: &[T], v: &[T]) {
        place_all(linkage, &self.schedule.steps, &self.links, q, v, &mut self.placed, &mut self.axes);
    }

    /// Displacement and rotation of a body from its drawn place [m, m, rad].
    pub fn pose(&self, body: usize) -> [T; 3] {
        self.placed[body].pose
    }

    /// Rate of a body's pose.
    pub fn rate(&self, body: usize) -> [T; 3] {
        self.placed[body].rate
    }

    /// Writes the constraint rows of every closure for `task`. Returns the largest residual of a row.
    #[inline(always)]
    pub(super) fn write_rows(&mut self, linkage: &Linkage, task: Task) -> T {
        let mut largest = T::ZERO;
        if self.closures.is_empty() {
            return largest;
        }
        let rest = Placed::REST;
        for (c, closure) in linkage.closures.iter().enumerate() {
            let entry = self.schedule.entries[c];
            let turn = &self.schedule.turns[entry.body];
            let width = 3 + 3 * turn.front + 1;
            let (a, b, first_is_a) = match closure {
                super::Closure::Held { body, .. } => (&self.placed[*body], &rest, true),
                super::Closure::Joint(joint) => {
                    let at = |id| match id {
                        crate::multibody::BodyId::Free(k) => &self.placed[k],
                        crate::multibody::BodyId::Ground => &rest,
                    };
                    (at(joint.a), at(joint.b), joint.a == crate::multibody::BodyId::Free(entry.body))
                }
            };
            let constraints = self.closures[c].constraints(a, b);
            for (k, strain) in constraints.iter().enumerate().take(closure.constraints()) {
                let start = turn.row_start + (entry.row + k) * width;
                let row = &mut self.rows[start..start + width];
                row.fill(T::ZERO);
                let (own, other) = if first_is_a { (&strain.a, &strain.b) } else { (&strain.b, &strain.a) };
                row[..3].copy_from_slice(own);
                if entry.other != NONE {
                    let at = 3 + 3 * entry.other;
                    row[at..at + 3].copy_from_slice(other);
                }
                row[width - 1] = -match task {
                    Task::Accelerations => strain.bias,
                    Task::Rates => strain.rate,
                    Task::Positions => strain.value,
                };
                largest = largest.max(row[width - 1].abs());
            }
        }
        largest
    }

    /// Solves for `task` at the placed configuration; `out` receives q̈, or the change of the rates or coordinates.
    ///
    /// The result is right to rounding times the square of [`Reduction::nearness`].
    #[inline(always)]
    pub fn reduce(&mut self, linkage: &Linkage, task: Task, out: &mut [T]) {
        self.write_rows(linkage, task);
        self.inward(linkage, task);
        self.outward(linkage, task, out);
    }

    #[inline(always)]
    fn inward(&mut self, linkage: &Linkage, task: Task) {
        self.nearness = T::ZERO;
        let mut body = 0;
        while body < self.links.len() {
            let Kind::Pin = self.schedule.steps[body].kind else {
                self.front_inward(linkage, task, body);
                body += 1;
                continue;
            };
            body = if task == Task::Accelerations {
                self.pins_inward::<true>(body)
            } else {
                self.pins_inward::<false>(body)
            };
        }
    }

    #[inline(always)]
    fn front_inward(&mut self, linkage: &Linkage, task: Task, body: usize) {
        match self.schedule.steps[body].kind {
            Kind::Pin => {}
            Kind::One(0) => self.one_inward::<1, 0>(task, body),
            Kind::One(1) => self.one_inward::<1, 1>(task, body),
            Kind::One(2) => self.one_inward::<1, 2>(task, body),
            Kind::One(_) => self.one_inward::<1, 3>(task, body),
            Kind::Two(0) => self.one_inward::<2, 0>(task, body),
            Kind::Two(1) => self.one_inward::<2, 1>(task, body),
            Kind::Two(2) => self.one_inward::<2, 2>(task, body),
            Kind::Two(_) => self.one_inward::<2, 3>(task, body),
            Kind::Any => self.any_inward(linkage, task, body),
        }
    }

    /// What the outer bodies have left at this one, with its own mass; their place is clean for the next reduction.
    #[inline(always)]
    pub(super) fn take_inertia(&mut self, body: usize) -> [T; 6] {
        let mut inertia = std::mem::replace(&mut self.nodes[body].inertia, [T::ZERO; 6]);
        let link = &self.links[body];
        inertia[0] += link.mass;
        inertia[2] += link.mass;
        inertia[5] += link.inertia;
        inertia
    }

    /// The same for forces; accelerations add the body's own.
    #[inline(always)]
    pub(super) fn take_force(&mut self, task: Task, body: usize) -> [T; 3] {
        let mut force = std::mem::replace(&mut self.nodes[body].momentum, [T::ZERO; 3]);
        if task == Task::Accelerations {
            for (f, own) in force.iter_mut().zip(&self.force[body]) {
                *f += *own;
            }
        }
        force
    }

    #[inline(never)]
    fn any_inward(&mut self, linkage: &Linkage, task: Task, body: usize) {
        let mut scratch = Scratch {
            m: std::mem::take(&mut self.front.m),
            g: std::mem::take(&mut self.front.g),
            r: std::mem::take(&mut self.front.r),
        };
        self.take_turn(linkage, task, body, &mut scratch.m, &mut scratch.g, &mut scratch.r);
        self.front = scratch;
    }

    /// Assembles a body's front, takes its coordinates out, and hands the rest on.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn take_turn(&mut self, linkage: &Linkage, task: Task, body: usize, m: &mut [T], g: &mut [T], r: &mut [T]) {
        let turn = self.schedule.turns[body];
        let (nd, w, h) = (turn.freedom, turn.front, turn.rows);
        let k = nd + 3 * w;
        // several coordinates are combined, so they get one unit first
        let (mut s, mut torque, mut unit) = ([[T::ZERO; 3]; 3], [T::ZERO; 3], [T::ONE; 3]);
        for q in 0..nd {
            let (axis, lever) = (self.axes[turn.first + q], self.units[turn.first + q]);
            (s[q], torque[q], unit[q]) = (axis, self.torque[turn.first + q], lever);
            if nd > 1 {
                let inverse = T::ONE / lever;
                (s[q], torque[q], unit[q]) = (axis.map(|x| x * inverse), torque[q] * inverse, T::ONE);
            }
        }
        self.assemble(linkage, task, body, turn, &s, &torque, m, g);
        let [dx, dy] = self.placed[body].shift;
        let bias = if task == Task::Accelerations { self.placed[body].bias } else { [T::ZERO; 2] };
        let source = 3 + 3 * w + 1;
        for l in 0..h {
            let row = &self.rows[turn.row_start + l * source..turn.row_start + (l + 1) * source];
            let own = [row[0], row[1], row[2]];
            for q in 0..nd {
                r[l * (k + 1) + q] = own[0] * s[q][0] + own[1] * s[q][1] + own[2] * s[q][2];
            }
            r[l * (k + 1) + nd..l * (k + 1) + k].copy_from_slice(&row[3..3 + 3 * w]);
            if turn.parent != NONE {
                let p = l * (k + 1) + nd + 3 * turn.parent;
                r[p] += own[0];
                r[p + 1] += own[1];
                r[p + 2] += own[2] + (own[1] * dx - own[0] * dy);
            }
            r[l * (k + 1) + k] = row[source - 1] - (own[0] * bias[0] + own[1] * bias[1]);
        }
        let mut turned = [[T::ONE, T::ZERO, T::ZERO], [T::ZERO, T::ONE, T::ZERO], [T::ZERO, T::ZERO, T::ONE]];
        let mut front = Front { freedom: nd, size: k, rows: h, m, g, r, unit: &unit };
        let near = front.eliminate(
            &mut self.coefficients[turn.coefficient_start..turn.coefficient_start + nd * k],
            &mut self.base[turn.first..turn.first + nd],
            &mut turned,
        );
        self.nearness = self.nearness.max(near);
        if nd > 1 {
            self.turned[body] = turned;
        }
        self.hand_on(linkage, body, turn, m, g);
        if turn.next != NONE {
            let next = self.schedule.turns[turn.next];
            let width = 3 + 3 * next.front + 1;
            for (l, from) in (nd.min(h)..h).enumerate() {
                let to = next.row_start + (turn.next_row + l) * width;
                self.rows[to..to + width].fill(T::ZERO);
                for slot in 0..w {
                    let place = self.schedule.maps[turn.map_start + slot];
                    if place != NONE {
                        for i in 0..3 {
                            self.rows[to + 3 * place + i] = r[from * (k + 1) + nd + 3 * slot + i];
                        }
                    }
                }
                self.rows[to + width - 1] = r[from * (k + 1) + k];
            }
        }
    }

    /// Fills M (lower triangle) and g of a body's front from its inertia, its couplings and its momentum. `s` are the joint
    /// axes and `torque` the forces along them.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub(super) fn assemble(
        &mut self,
        linkage: &Linkage,
        task: Task,
        body: usize,
        turn: Turn,
        s: &[[T; 3]],
        torque: &[T],
        m: &mut [T],
        g: &mut [T],
    ) {
        let (nd, w) = (turn.freedom, turn.front);
        let (k, start) = (nd + 3 * w, linkage.pattern.column(body).start);
        let [a, b, c, d, e, f] = self.take_inertia(body);
        let own = [[a, b, d], [b, c, e], [d, e, f]];
        let mut force = self.take_force(task, body);
        let placed = &self.placed[body];
        let bias = if task == Task::Accelerations { placed.bias } else { [T::ZERO; 2] };
        for i in 0..3 {
            force[i] -= own[i][0] * bias[0] + own[i][1] * bias[1];
        }
        m[..k * k].fill(T::ZERO);
        g[..k].fill(T::ZERO);
        let mut hs = [[T::ZERO; 3]; 3];
        for q in 0..nd {
            for i in 0..3 {
                hs[q][i] = own[i][0] * s[q][0] + own[i][1] * s[q][1] + own[i][2] * s[q][2];
            }
            let along = if task == Task::Accelerations { torque[q] } else { T::ZERO };
            g[q] = along + (s[q][0] * force[0] + s[q][1] * force[1] + s[q][2] * force[2]);
            for p in 0..=q {
                m[q * k + p] = s[p][0] * hs[q][0] + s[p][1] * hs[q][1] + s[p][2] * hs[q][2];
            }
        }
        let [dx, dy] = placed.shift;
        for slot in 0..w {
            let block = std::mem::replace(&mut self.coupling[start + slot], [T::ZERO; 9]);
            for i in 0..3 {
                let row = [block[3 * i], block[3 * i + 1], block[3 * i + 2]];
                let at = nd + 3 * slot + i;
                for q in 0..nd {
                    m[at * k + q] += row[0] * s[q][0] + row[1] * s[q][1] + row[2] * s[q][2];
                }
                g[at] -= row[0] * bias[0] + row[1] * bias[1];
                if turn.parent != NONE {
                    // row·X, at the parent's columns
                    let shifted = [row[0], row[1], row[2] + (row[1] * dx - row[0] * dy)];
                    for (j, &x) in shifted.iter().enumerate() {
                        let to = nd + 3 * turn.parent + j;
                        if slot == turn.parent {
                            // B·X + (B·X)ᵀ, lower triangle
                            if j < i {
                                m[at * k + to] += x;
                            } else if j > i {
                                m[to * k + at] += x;
                            } else {
                                m[at * k + at] += x + x;
                            }
                        } else if slot > turn.parent {
                            m[at * k + to] += x;
                        } else {
                            m[to * k + at] += x;
                        }
                    }
                }
            }
        }
        if turn.parent != NONE {
            let p = nd + 3 * turn.parent;
            for q in 0..nd {
                let x = hs[q];
                m[p * k + q] += x[0];
                m[(p + 1) * k + q] += x[1];
                m[(p + 2) * k + q] += x[2] + (x[1] * dx - x[0] * dy);
            }
            // XᵀHX
            let (ux, uy) = (d + (b * dx - a * dy), e + (c * dx - b * dy));
            m[p * k + p] += a;
            m[(p + 1) * k + p] += b;
            m[(p + 1) * k + p + 1] += c;
            m[(p + 2) * k + p] += ux;
            m[(p + 2) * k + p + 1] += uy;
            m[(p + 2) * k + p + 2] += f + (e * dx - d * dy) + (uy * dx - ux * dy);
            g[p] += force[0];
            g[p + 1] += force[1];
            g[p + 2] += force[2] + (force[1] * dx - force[0] * dy);
        }
    }

    /// Adds what is left of a front to the bodies in it.
    #[inline(always)]
    pub(super) fn hand_on(&mut self, linkage: &Linkage, body: usize, turn: Turn, m: &[T], g: &[T]) {
        let (nd, w) = (turn.freedom, turn.front);
        let (k, start) = (nd + 3 * w, linkage.pattern.column(body).start);
        let mut target = linkage.pattern.targets(body).iter();
        for row in 0..w {
            let at = nd + 3 * row;
            let to = linkage.pattern.row(start + row);
            for column in 0..row {
                let from = nd + 3 * column;
                if let Some(&block) = target.next() {
                    for i in 0..3 {
                        for j in 0..3 {
                            self.coupling[block as usize][3 * i + j] += m[(at + i) * k + from + j];
                        }
                    }
                }
            }
            let inertia = &mut self.nodes[to].inertia;
            inertia[0] += m[at * k + at];
            inertia[1] += m[(at + 1) * k + at];
            inertia[2] += m[(at + 1) * k + at + 1];
            inertia[3] += m[(at + 2) * k + at];
            inertia[4] += m[(at + 2) * k + at + 1];
            inertia[5] += m[(at + 2) * k + at + 2];
            let momentum = &mut self.nodes[to].momentum;
            for i in 0..3 {
                momentum[i] += g[at + i];
            }
        }
    }

    #[inline(always)]
    fn outward(&mut self, linkage: &Linkage, task: Task, out: &mut [T]) {
        let mut end = self.links.len();
        while end > 0 {
            let body = end - 1;
            match self.schedule.steps[body].kind {
                Kind::Pin if task == Task::Accelerations => end = self.pins_outward::<true>(end, out),
                Kind::Pin => end = self.pins_outward::<false>(end, out),
                Kind::One(_) => self.one_outward::<1>(task, body, out),
                Kind::Two(_) => self.one_outward::<2>(task, body, out),
                Kind::Any => self.any_outward(linkage, task, body, out),
            }
            end = end.min(body);
        }
    }

    #[inline(never)]
    fn any_outward(&mut self, linkage: &Linkage, task: Task, body: usize, out: &mut [T]) {
        {
            let turn = self.schedule.turns[body];
            let placed = &self.placed[body];
            let (nd, k) = (turn.freedom, turn.freedom + 3 * turn.front);
            let start = linkage.pattern.column(body).start;
            let mut x = [T::ZERO; 3];
            for e in (0..nd).rev() {
                let coefficients =
                    &self.coefficients[turn.coefficient_start + e * k..turn.coefficient_start + (e + 1) * k];
                let mut value = self.base[turn.first + e];
                for later in e + 1..nd {
                    value -= coefficients[later] * x[later];
                }
                for slot in 0..turn.front {
                    let other = &self.accelerations[linkage.pattern.row(start + slot)];
                    let c = &coefficients[nd + 3 * slot..nd + 3 * slot + 3];
                    value -= c[0] * other[0] + c[1] * other[1] + c[2] * other[2];
                }
                x[e] = value;
            }
            if nd > 1 {
                let turned = &self.turned[body];
                let mut y = [T::ZERO; 3];
                for (i, y) in y.iter_mut().enumerate().take(nd) {
                    for (j, &x) in x.iter().enumerate().take(nd) {
                        *y += turned[i][j] * x;
                    }
                    *y = *y / self.units[turn.first + i];
                }
                x = y;
            }
            let mut a = [T::ZERO; 3];
            if let Parent::Body(p) = linkage.links[body].parent {
                let up = self.accelerations[p];
                a = [up[0] - placed.shift[1] * up[2], up[1] + placed.shift[0] * up[2], up[2]];
            }
            if task == Task::Accelerations {
                a[0] += placed.bias[0];
                a[1] += placed.bias[1];
            }
            for q in 0..nd {
                let axis = &self.axes[turn.first + q];
                for i in 0..3 {
                    a[i] += axis[i] * x[q];
                }
                out[turn.first + q] = x[q];
            }
            self.accelerations[body] = a;
        }
    }
}
