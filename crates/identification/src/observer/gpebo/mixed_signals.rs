//! The first mixing at the nodes of a step.

use super::linear::{LinearState, LinearSystem};
use super::mixing::Mixer;
use super::operators::{DelayLine, Nodes, no_signal, whole_steps};
use crate::real::{Mask, Real};

/// The first mixing's result and Eq. (9) at the nodes of a step.
#[derive(Clone, Debug)]
pub struct MixedNodes<R> {
    /// Delta.
    pub delta: Nodes<R>,
    /// mbar, n of them.
    pub mbar: Vec<Nodes<R>>,
    /// phi = C'Phi, n of them.
    pub phi: Vec<Nodes<R>>,
    /// z.
    pub z: Nodes<R>,
}

/// The first mixing at the nodes of a step, with its buffers.
#[derive(Clone, Debug)]
pub struct Mixing<R> {
    mixer: Mixer<R>,
    /// z and phi for each row of M that a delay makes.
    delays: Vec<(usize, DelayLine<R>)>,
    m: Vec<R>,
    zbar: Vec<R>,
    pub nodes: MixedNodes<R>,
    /// mbar at the last node observed.
    pub mbar: Vec<R>,
    pub dbar: Vec<R>,
    pub largest_dbar: Vec<R>,
    theta: Vec<R>,
}

impl<R: Real> Mixing<R> {
    /// Starts with steps of length h, which matters to delays only.
    pub fn new(theta: &[f64], delays: &[(usize, f64)], h: f64) -> Self {
        let n = theta.len();
        let line = |&(row, delay): &(usize, f64)| Some((row, DelayLine::new(n + 1, whole_steps(delay, h)?)));
        let zeros = |count: usize| vec![R::zero(); count];
        Self {
            mixer: Mixer::new(n),
            delays: delays.iter().filter_map(line).collect(),
            m: zeros(n * n),
            zbar: zeros(n),
            nodes: MixedNodes {
                delta: no_signal(),
                mbar: vec![no_signal(); n],
                phi: vec![no_signal(); n],
                z: no_signal(),
            },
            mbar: zeros(n),
            dbar: zeros(n),
            largest_dbar: zeros(n),
            theta: theta.iter().map(|theta| R::splat(*theta)).collect(),
        }
    }

    /// Computes node `k` from the linear state, Eqs. (9), (10), in some lanes.
    #[inline(always)]
    pub fn observe(&mut self, system: &LinearSystem, linear: &LinearState<R>, k: usize, lanes: R::Mask) {
        let n = self.theta.len();
        system.observe(linear, &mut self.m, &mut self.zbar);
        for (row, line) in &self.delays {
            let delayed = line.delayed();
            self.zbar[*row] = delayed[0][k];
            for j in 0..n {
                self.m[row * n + j] = delayed[1 + j][k];
            }
        }
        let delta = self.mixer.mix(&self.m, &self.zbar, &mut self.mbar);
        let nodes = &mut self.nodes;
        nodes.delta[k] = R::select(lanes, delta, nodes.delta[k]);
        nodes.z[k] = R::select(lanes, self.zbar[0], nodes.z[k]);
        for i in 0..n {
            nodes.phi[i][k] = R::select(lanes, self.m[i], nodes.phi[i][k]);
            nodes.mbar[i][k] = R::select(lanes, self.mbar[i], nodes.mbar[i][k]);
            let dbar = self.mbar[i] - delta * self.theta[i];
            self.dbar[i] = dbar;
            let larger = lanes & self.largest_dbar[i].less(dbar.abs());
            self.largest_dbar[i] = R::select(larger, dbar.abs(), self.largest_dbar[i]);
        }
    }

    /// Lets the delays have the step that ends.
    #[inline(always)]
    pub fn delay(&mut self) {
        let nodes = &self.nodes;
        for (_, line) in &mut self.delays {
            let signals = std::iter::once(&nodes.z).chain(&nodes.phi);
            for (to, from) in line.delayed_mut().iter_mut().zip(signals) {
                *to = *from;
            }
            line.advance();
        }
    }

    /// Makes the end of a step the start of the next. The start is computed anew in the lanes in which the signals may
    /// jump there; of delayed ones, in all. Returns whether there are any.
    #[inline(always)]
    pub fn shift(&mut self, system: &LinearSystem, linear: &LinearState<R>, mut jump: R::Mask) -> bool {
        let nodes = &mut self.nodes;
        nodes.delta[0] = nodes.delta[2];
        nodes.z[0] = nodes.z[2];
        for i in 0..self.theta.len() {
            nodes.mbar[i][0] = nodes.mbar[i][2];
            nodes.phi[i][0] = nodes.phi[i][2];
        }
        if !self.delays.is_empty() {
            jump = R::Mask::from_bits(u8::MAX);
        }
        let any = jump.any();
        if any {
            self.observe(system, linear, 0, jump);
        }
        any
    }
}
