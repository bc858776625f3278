//! Stages 2 and 9 in lock step: the blocks of [`asobench_identification::estimator::information::Information`] by the
//! same shift recurrence, with lag sums over k in order.

use super::{Square, order};
use asobench_identification::real::Real;

/// `G = Z'Phi` and `r = Z'y` in blocks; the first n rows and columns of each are used.
pub(crate) struct PackedInformation<R, const N: usize> {
    n: usize,
    /// G11, G12, G21, G22.
    pub(crate) g: [Square<R, N>; 4],
    /// r1, r2.
    pub(crate) r: [[R; N]; 2],
}

/// Fills `block[1.., 1..]`: `S(i+1, j+1) = S(i, j) + z(n-2-i) w(n-2-j) - z(N-2-i) w(N-2-j)`.
#[inline(always)]
fn extend<R: Real, const N: usize>(n: usize, block: &mut Square<R, N>, z: &[R], w: &[R]) {
    let last = z.len() - 1;
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let entering = z[n - 2 - i].mul_add(w[n - 2 - j], block[i][j]);
            block[i + 1][j + 1] = z[last - 1 - i].neg_mul_add(w[last - 1 - j], entering);
        }
    }
}

/// Returns `S(i+1, 0)` given `S(i, -1)`, a sum against w(k).
#[inline(always)]
fn from_rhs<R: Real>(n: usize, rhs: R, z: &[R], w: &[R], i: usize) -> R {
    let last = z.len() - 1;
    let entering = z[n - 2 - i].mul_add(w[n - 1], rhs);
    z[last - 1 - i].neg_mul_add(w[last], entering)
}

#[inline(always)]
fn negate<R: Real, const N: usize>(n: usize, block: &mut Square<R, N>) {
    for i in 0..n {
        for j in 0..n {
            block[i][j] = -block[i][j];
        }
    }
}

impl<R: Real, const N: usize> PackedInformation<R, N> {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            n,
            g: [[[R::zero(); N]; N]; 4],
            r: [[R::zero(); N]; 2],
        }
    }

    /// Returns the order n.
    #[inline(always)]
    pub(crate) fn order(&self) -> usize {
        order::<N>(self.n)
    }

    /// Computes stage 2: `G = Phi'Phi`, `r = Phi'y`.
    #[inline(always)]
    pub(crate) fn least_squares(&mut self, u: &[R], y: &[R]) {
        let n = self.order();
        let samples = u.len();
        let y = &y[..samples];
        let zero = [R::zero(); N];
        // Sums against y(k), y(k-1) and u(k-1).
        let (mut yy, mut uy, mut u1y, mut u1u) = (zero, zero, zero, zero);
        let mut y1y1 = R::zero();
        for k in n..samples {
            let (y_window, u_window) = (&y[k - n..=k], &u[k - n..k]);
            let (y0, y1, u1) = (y_window[n], y_window[n - 1], u_window[n - 1]);
            y1y1 = y1.mul_add(y1, y1y1);
            for i in 0..n {
                yy[i] = y0.mul_add(y_window[n - 1 - i], yy[i]);
                uy[i] = y0.mul_add(u_window[n - 1 - i], uy[i]);
                u1y[i] = u1.mul_add(y_window[n - 1 - i], u1y[i]);
                u1u[i] = u1.mul_add(u_window[n - 1 - i], u1u[i]);
            }
        }
        let [g11, g12, g21, g22] = &mut self.g;
        g11[0][0] = y1y1;
        for i in 1..n {
            g11[i][0] = from_rhs(n, yy[i - 1], y, y, i - 1);
            g11[0][i] = g11[i][0];
        }
        extend(n, g11, y, y);
        g21[0] = u1y;
        for i in 1..n {
            g21[i][0] = from_rhs(n, uy[i - 1], u, y, i - 1);
        }
        extend(n, g21, u, y);
        negate(n, g21);
        for i in 0..n {
            for j in 0..n {
                g12[i][j] = g21[j][i];
            }
            g22[0][i] = u1u[i];
            g22[i][0] = u1u[i];
        }
        extend(n, g22, u, u);
        for i in 0..n {
            self.r[0][i] = -yy[i];
        }
        self.r[1] = uy;
    }

    /// Computes stage 9: G11, G12 and r1 with `z` instead of y in the instruments.
    #[inline(always)]
    pub(crate) fn instruments(&mut self, u: &[R], y: &[R], z: &[R]) {
        let n = self.order();
        let samples = u.len();
        let (y, z) = (&y[..samples], &z[..samples]);
        let zero = [R::zero(); N];
        let (mut zy, mut z1y, mut z1u, mut zu1) = (zero, zero, zero, zero);
        for k in n..samples {
            let (y_window, u_window) = (&y[k - n..=k], &u[k - n..k]);
            let z_window = &z[k - n..k];
            let (y0, z1, u1) = (y_window[n], z_window[n - 1], u_window[n - 1]);
            for i in 0..n {
                zy[i] = y0.mul_add(z_window[n - 1 - i], zy[i]);
                z1y[i] = z1.mul_add(y_window[n - 1 - i], z1y[i]);
                z1u[i] = z1.mul_add(u_window[n - 1 - i], z1u[i]);
            }
            for i in 1..n {
                zu1[i] = u1.mul_add(z_window[n - 1 - i], zu1[i]);
            }
        }
        let [g11, g12, ..] = &mut self.g;
        g11[0] = z1y;
        g12[0] = z1u;
        for i in 1..n {
            g11[i][0] = from_rhs(n, zy[i - 1], z, y, i - 1);
            g12[i][0] = zu1[i];
        }
        extend(n, g11, z, y);
        extend(n, g12, z, u);
        negate(n, g12);
        for i in 0..n {
            self.r[0][i] = -zy[i];
        }
    }

    /// Returns the blocks of a single lane.
    pub(crate) fn lane(&self, lane: usize) -> PackedInformation<f64, N> {
        let mut single = PackedInformation::new(self.n);
        for (to, from) in single.g.iter_mut().zip(&self.g) {
            for i in 0..self.n {
                to[i] = super::lane(&from[i], lane);
            }
        }
        for (to, from) in single.r.iter_mut().zip(&self.r) {
            *to = super::lane(from, lane);
        }
        single
    }
}
