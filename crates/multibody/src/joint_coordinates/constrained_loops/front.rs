//! Elimination of one body's joint coordinates from its front: the step of the recursion.
//!
//! The front's unknowns are x = (joint coordinates, accelerations of the bodies in the front). They minimize
//! ½·xᵀMx − gᵀx (Gauss' principle) under constraint rows R·x = γ. A **dependent** coordinate is taken out by a row, an
//! **independent** one by its own mass:
//! ```text
//! dependent     x_e = γ − ρ·x          M += −c·ρᵀ − ρ·cᵀ + M_ee·ρ·ρᵀ,   g −= ρ·(g_e − M_ee·γ) + c·γ     (c = column e of M)
//! independent   x_e = (g_e − c·x)/D    M −= c·cᵀ/D,                     g −= c·g_e/D                     (D = M_ee)
//! ```
//! The first is the loop reduction of the paper, done where the loop passes the joint, and hands the rest an ordinary
//! inertia; the second is the articulated-body step. Both leave x_e = base − coefficients·x for the outward pass.
//!
//! Rows are turned by a Householder reflection first, so that one of them meets the coordinate at full size and the others
//! not at all. The smallest pivot against the joint's lever is the caller's measure of how near a loop is to a singular
//! configuration.

use crate::scalar::StoredReal;

/// One front, in row-major order: M is k × k (lower triangle), rows are h × (k + 1) with γ last.
#[derive(Debug)]
pub(super) struct Front<'a, T> {
    pub freedom: usize,
    pub size: usize,
    pub rows: usize,
    pub m: &'a mut [T],
    pub g: &'a mut [T],
    pub r: &'a mut [T],
    /// Unit of each coordinate, which makes it a length.
    pub unit: &'a [T],
}

impl<T: StoredReal> Front<'_, T> {
    /// Takes out the coordinates. `coefficients` is freedom × k, `base` and (for several coordinates) `combined`, the
    /// orthogonal combination of them that was taken out, belong to the outward pass. Returns the worst of unit/pivot.
    #[inline(always)]
    pub(super) fn eliminate(&mut self, coefficients: &mut [T], base: &mut [T], combined: &mut [[T; 3]; 3]) -> T {
        let (nd, k, h) = (self.freedom, self.size, self.rows);
        let width = k + 1;
        let dependent = if nd < h { nd } else { h };
        let mut worst = T::ZERO;
        for e in 0..dependent {
            if nd == 1 {
                self.reflect_rows(e);
            } else {
                self.reflect_coordinates(e, combined);
            }
            let pivot = self.r[e * width + e];
            let inverse = T::ONE / pivot;
            worst = worst.max((self.unit[e] * inverse).abs());
            for j in e + 1..width {
                let x = self.r[e * width + j];
                self.r[e * width + j] = x * inverse;
            }
            if nd > 1 {
                for l in e + 1..h {
                    let f = self.r[l * width + e];
                    for j in e + 1..width {
                        let x = self.r[e * width + j];
                        self.r[l * width + j] -= f * x;
                    }
                }
            }
            let mass = self.m[e * k + e];
            let half = T::splat(0.5) * mass;
            let gamma = self.r[e * width + k];
            let rest = self.g[e] - mass * gamma;
            for j in e + 1..k {
                let (rho, c) = (self.r[e * width + j], self.m[j * k + e]);
                self.g[j] -= rho * rest + c * gamma;
                // c becomes c − M_ee·ρ/2, which makes the update a symmetric product
                self.m[j * k + e] = c - half * rho;
                coefficients[e * k + j] = rho;
            }
            for j in e + 1..k {
                let (rho_j, t_j) = (self.r[e * width + j], self.m[j * k + e]);
                for l in e + 1..=j {
                    let (rho_l, t_l) = (self.r[e * width + l], self.m[l * k + e]);
                    self.m[j * k + l] -= t_j * rho_l + rho_j * t_l;
                }
            }
            base[e] = gamma;
        }
        for e in dependent..nd {
            let inverse = T::ONE / self.m[e * k + e];
            let force = self.g[e];
            base[e] = force * inverse;
            for j in e + 1..k {
                let c = self.m[j * k + e];
                let scaled = c * inverse;
                coefficients[e * k + j] = scaled;
                self.g[j] -= scaled * force;
                for l in e + 1..=j {
                    let c_l = self.m[l * k + e];
                    self.m[j * k + l] -= scaled * c_l;
                }
            }
        }
        worst
    }

    /// Reflects rows e.. so that only row e meets coordinate e.
    #[inline(always)]
    fn reflect_rows(&mut self, e: usize) {
        let width = self.size + 1;
        if self.rows - e < 2 {
            return;
        }
        let mut norm2 = T::ZERO;
        for l in e..self.rows {
            let x = self.r[l * width + e];
            norm2 += x * x;
        }
        let first = self.r[e * width + e];
        let alpha = -norm2.sqrt().copysign(first);
        // v = column − α·e₁; the reflection is 1 − β·v·vᵀ with β = 2/vᵀv = 1/(α² − α·x₁)
        let v0 = first - alpha;
        let beta = T::ONE / (norm2 - alpha * first);
        for j in e + 1..width {
            let mut sum = v0 * self.r[e * width + j];
            for l in e + 1..self.rows {
                sum += self.r[l * width + e] * self.r[l * width + j];
            }
            let sum = sum * beta;
            self.r[e * width + j] -= v0 * sum;
            for l in e + 1..self.rows {
                let v = self.r[l * width + e];
                self.r[l * width + j] -= v * sum;
            }
        }
        self.r[e * width + e] = alpha;
    }

    /// Combines coordinates e.. so that row e meets only the first of them.
    #[inline(always)]
    fn reflect_coordinates(&mut self, e: usize, combined: &mut [[T; 3]; 3]) {
        let (nd, k, width) = (self.freedom, self.size, self.size + 1);
        if nd - e < 2 {
            return;
        }
        let mut v = [T::ZERO; 3];
        let mut norm2 = T::ZERO;
        for i in e..nd {
            // in units of length, so that a rotation and a displacement can be combined
            v[i] = self.r[e * width + i];
            norm2 += v[i] * v[i];
        }
        let first = v[e];
        let alpha = -norm2.sqrt().copysign(first);
        v[e] = first - alpha;
        let beta = T::ONE / (norm2 - alpha * first);
        for l in e..self.rows {
            let mut sum = T::ZERO;
            for i in e..nd {
                sum += v[i] * self.r[l * width + i];
            }
            let sum = sum * beta;
            for i in e..nd {
                self.r[l * width + i] -= v[i] * sum;
            }
        }
        // M and g turn with the coordinates, and the combination is kept for the outward pass
        for j in nd..k {
            let mut sum = T::ZERO;
            for i in e..nd {
                sum += v[i] * self.m[j * k + i];
            }
            let sum = sum * beta;
            for i in e..nd {
                self.m[j * k + i] -= v[i] * sum;
            }
        }
        let mut sum = T::ZERO;
        for i in e..nd {
            sum += v[i] * self.g[i];
        }
        let sum = sum * beta;
        for i in e..nd {
            self.g[i] -= v[i] * sum;
        }
        let mut full = [[T::ZERO; 3]; 3];
        for i in 0..nd {
            for j in 0..nd {
                full[i][j] = if j <= i { self.m[i * k + j] } else { self.m[j * k + i] };
            }
        }
        reflect(&mut full, &v, beta, nd);
        transpose(&mut full);
        reflect(&mut full, &v, beta, nd);
        for i in 0..nd {
            for j in 0..=i {
                self.m[i * k + j] = full[i][j];
            }
        }
        reflect(combined, &v, beta, nd);
    }
}

/// Multiplies the rows of `a` by 1 − β·v·vᵀ from the right.
#[inline(always)]
fn reflect<T: StoredReal>(a: &mut [[T; 3]; 3], v: &[T; 3], beta: T, nd: usize) {
    for row in a.iter_mut().take(nd) {
        let mut sum = T::ZERO;
        for i in 0..nd {
            sum += row[i] * v[i];
        }
        let sum = sum * beta;
        for i in 0..nd {
            row[i] -= sum * v[i];
        }
    }
}

#[inline(always)]
fn transpose<T: StoredReal>(a: &mut [[T; 3]; 3]) {
    for i in 0..3 {
        for j in 0..i {
            let x = a[i][j];
            a[i][j] = a[j][i];
            a[j][i] = x;
        }
    }
}
