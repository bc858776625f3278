//! The predictor of a general linear model, run along sample by sample, and the gradient of its prediction.

use super::dot;
use super::lags::push;
use crate::model::Orders;

/// Past signals of `A y = B/F u + C/D e`, each with its newest sample first. The residual before k is that of the theta
/// of its own time.
///
/// ```text
///     w = B/F u,  v = A y - w,  eps = D/C v
///     phi = (-y(k-1) ..., u(k-nk) ..., eps(k-1) ..., -v(k-1) ..., -w(k-1) ...),  y(k) = phi' theta + eps(k)
///     psi = (-D/C y, D/(C F) u, 1/C eps, -1/C v, -D/(C F) w) at the same lags: the gradient of phi' theta
/// ```
#[derive(Clone, Debug)]
pub(super) struct Predictor {
    orders: Orders,
    y: Vec<f64>,
    u: Vec<f64>,
    w: Vec<f64>,
    v: Vec<f64>,
    eps: Vec<f64>,
    /// D/C y, D/C u, D/C w.
    y_c: Vec<f64>,
    u_c: Vec<f64>,
    w_c: Vec<f64>,
    /// D/(C F) u, D/(C F) w.
    u_f: Vec<f64>,
    w_f: Vec<f64>,
    /// eps/C, v/C.
    eps_c: Vec<f64>,
    v_c: Vec<f64>,
}

/// The free coefficients of A, B, C, D and F.
pub(super) fn polynomials(orders: Orders, theta: &[f64]) -> [&[f64]; 5] {
    let Orders { na, nb, nc, nd, .. } = orders;
    let (a, rest) = theta.split_at(na);
    let (b, rest) = rest.split_at(nb);
    let (c, rest) = rest.split_at(nc);
    let (d, f) = rest.split_at(nd);
    [a, b, c, d, f]
}

impl Predictor {
    pub(super) fn new(orders: Orders) -> Self {
        let Orders { na, nb, nc, nd, nf, nk } = orders;
        let of = |length: usize| vec![0.0; length];
        Self {
            orders,
            y: of(na.max(nd).max(nf)),
            u: of((nk + nb).max(nd + 1)),
            w: of(nf.max(nd)),
            v: of(nd),
            eps: of(nc),
            y_c: of(na.max(nc)),
            u_c: of(nc),
            w_c: of(nc),
            u_f: of((nk + nb).max(nf)),
            w_f: of(nf),
            eps_c: of(nc),
            v_c: of(nd.max(nc)),
        }
    }

    pub(super) fn restart(&mut self) {
        let Self {
            orders: _,
            y,
            u,
            w,
            v,
            eps,
            y_c,
            u_c,
            w_c,
            u_f,
            w_f,
            eps_c,
            v_c,
        } = self;
        for signal in [y, u, w, v, eps, y_c, u_c, w_c, u_f, w_f, eps_c, v_c] {
            signal.fill(0.0);
        }
    }

    /// Takes u(k), filtered with the theta of k - 1.
    pub(super) fn input(&mut self, u: f64, theta: &[f64]) {
        let [_, _, c, d, f] = polynomials(self.orders, theta);
        let in_c = u + dot(d, &self.u) - dot(c, &self.u_c);
        let in_f = in_c - dot(f, &self.u_f);
        push(&mut self.u, u);
        push(&mut self.u_c, in_c);
        push(&mut self.u_f, in_f);
    }

    /// Fills phi(k) and psi(k).
    pub(super) fn regressors(&self, phi: &mut [f64], psi: &mut [f64]) {
        let Orders { na, nb, nc, nd, nf, nk } = self.orders;
        let fill = |to: &mut [f64], [y, u, eps, v, w]: [&[f64]; 5]| {
            let parts = [
                (na, y, -1.0),
                (nb, &u[nk..], 1.0),
                (nc, eps, 1.0),
                (nd, v, -1.0),
                (nf, w, -1.0),
            ];
            let mut rest = to;
            for (count, lags, sign) in parts {
                let (part, after) = rest.split_at_mut(count);
                part.iter_mut().zip(lags).for_each(|(to, x)| *to = sign * x);
                rest = after;
            }
        };
        fill(phi, [&self.y, &self.u, &self.eps, &self.v, &self.w]);
        fill(psi, [&self.y_c, &self.u_f, &self.eps_c, &self.v_c, &self.w_f]);
    }

    /// Fills the regressors of `F y = B u + e`, or of `A y = B u + e` if there is an A, at their places among all.
    pub(super) fn linear_regressors(&self, phi: &mut [f64]) {
        let Orders { na, nb, nk, .. } = self.orders;
        phi.fill(0.0);
        let first = if na > 0 { 0 } else { phi.len() - self.orders.nf };
        let count = if na > 0 { na } else { self.orders.nf };
        for (to, y) in phi[first..first + count].iter_mut().zip(&self.y) {
            *to = -y;
        }
        phi[na..na + nb].copy_from_slice(&self.u[nk..nk + nb]);
    }

    /// Takes y(k), with the theta of k. Returns the residual eps(k).
    pub(super) fn output(&mut self, y: f64, theta: &[f64]) -> f64 {
        let [_, b, _, _, f] = polynomials(self.orders, theta);
        let w = dot(b, &self.u[self.orders.nk..]) - dot(f, &self.w);
        self.take(y, w, theta)
    }

    /// Takes y(k) of a model without A as `B/F u`, as if there were no noise. So the start of the plant is in w.
    pub(super) fn output_without_noise(&mut self, y: f64, theta: &[f64]) -> f64 {
        self.take(y, y, theta)
    }

    fn take(&mut self, y: f64, w: f64, theta: &[f64]) -> f64 {
        let [a, _, c, d, f] = polynomials(self.orders, theta);
        let v = y + dot(a, &self.y) - w;
        let eps = v + dot(d, &self.v) - dot(c, &self.eps);
        let y_c = y + dot(d, &self.y) - dot(c, &self.y_c);
        let w_c = w + dot(d, &self.w) - dot(c, &self.w_c);
        let w_f = w_c - dot(f, &self.w_f);
        let eps_c = eps - dot(c, &self.eps_c);
        let v_c = v - dot(c, &self.v_c);
        for (lags, newest) in [
            (&mut self.y, y),
            (&mut self.w, w),
            (&mut self.v, v),
            (&mut self.eps, eps),
            (&mut self.y_c, y_c),
            (&mut self.w_c, w_c),
            (&mut self.w_f, w_f),
            (&mut self.eps_c, eps_c),
            (&mut self.v_c, v_c),
        ] {
            push(lags, newest);
        }
        eps
    }
}
