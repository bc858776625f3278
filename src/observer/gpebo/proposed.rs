//! The estimator of Eqs. (11) to (17).

use super::expansion::{Factor, HIGHEST_ORDER, Regression, regression};
use super::filter::{Filter, Nodes};
use super::mixing::Mixer;
use super::scalar::ScalarEstimator;

/// A regression at the nodes of a step, or its filtered version.
type RegressionNodes = [Nodes; HIGHEST_ORDER + 2];

/// The states of one component.
#[derive(Clone, Debug)]
struct Component {
    m: f64,
    filtered: [Regression; HIGHEST_ORDER],
    scalar: ScalarEstimator,
}

/// Estimates theta from Eq. (17), each component on its own. All filters start from zero.
#[derive(Clone, Debug)]
pub struct Proposed {
    k: f64,
    order: usize,
    factor: Factor,
    smoothing: Filter,
    filters: Vec<Filter>,
    phi: f64,
    components: Vec<Component>,
    mixer: Mixer,
}

impl Proposed {
    /// Makes the estimator from checked settings.
    pub fn new(k: f64, order: usize, filters: &[f64], gains: &[f64], factor: Factor) -> Self {
        let component = |gain: &f64| Component {
            m: 0.0,
            filtered: [[0.0; HIGHEST_ORDER + 2]; HIGHEST_ORDER],
            scalar: ScalarEstimator::new(*gain),
        };
        Self {
            k,
            order,
            factor,
            smoothing: Filter::new(k),
            filters: filters.iter().map(|pole| Filter::new(*pole)).collect(),
            phi: 0.0,
            components: gains.iter().map(component).collect(),
            mixer: Mixer::new(order + 1),
        }
    }

    /// Advances one step of length h, given the nodes of Delta and of each mbar_i, Eq. (10).
    pub fn step(&mut self, h: f64, delta: &Nodes, mbar: &[Nodes]) {
        self.smoothing.set_step(h);
        self.filters
            .iter_mut()
            .for_each(|filter| filter.set_step(h));
        let phi = self.smoothing.step(self.phi, delta);
        self.phi = phi[2];
        for (component, mbar) in self.components.iter_mut().zip(mbar) {
            let m = self.smoothing.step(component.m, mbar);
            component.m = m[2];
            let mut own: RegressionNodes = Default::default();
            for node in 0..3 {
                let dm = self.k * (mbar[node] - m[node]);
                let dphi = self.k * (delta[node] - phi[node]);
                let r = regression(self.order, m[node], dm, phi[node], dphi, self.factor);
                for (own, r) in own.iter_mut().zip(r) {
                    own[node] = r;
                }
            }
            let filtered = extend(&self.filters, &mut component.filtered, &own, self.order);
            let (delta, mixed) = mix(&mut self.mixer, self.order, &own, &filtered);
            component.scalar.step(h, &delta, &mixed);
        }
    }

    /// Returns the scalar estimators, in the order of theta.
    pub fn scalars(&self) -> impl Iterator<Item = &ScalarEstimator> {
        self.components.iter().map(|component| &component.scalar)
    }

    /// Returns the scalar estimators mutably, to record what they have learnt.
    pub fn scalars_mut(&mut self) -> impl Iterator<Item = &mut ScalarEstimator> {
        self.components
            .iter_mut()
            .map(|component| &mut component.scalar)
    }
}

/// Returns the regression and its versions through the q filters, whose states are updated.
#[inline]
fn extend(
    filters: &[Filter],
    states: &mut [Regression; HIGHEST_ORDER],
    own: &RegressionNodes,
    order: usize,
) -> [RegressionNodes; HIGHEST_ORDER] {
    let mut out: [RegressionNodes; HIGHEST_ORDER] = Default::default();
    for ((filter, states), out) in filters.iter().zip(states).zip(&mut out) {
        for ((state, own), out) in states.iter_mut().zip(own).zip(out).take(order + 2) {
            *out = filter.step(*state, own);
            *state = out[2];
        }
    }
    out
}

/// Returns the second mixing at each node: the determinant and the mixed value of the first unknown.
#[inline]
fn mix(
    mixer: &mut Mixer,
    order: usize,
    own: &RegressionNodes,
    filtered: &[RegressionNodes; HIGHEST_ORDER],
) -> (Nodes, Nodes) {
    let unknowns = order + 1;
    let (mut delta, mut mixed) = ([0.0; 3], [0.0; 3]);
    for node in 0..3 {
        let mut m = [0.0; (HIGHEST_ORDER + 1) * (HIGHEST_ORDER + 1)];
        let mut z = [0.0; HIGHEST_ORDER + 1];
        for (i, row) in std::iter::once(own)
            .chain(filtered)
            .take(unknowns)
            .enumerate()
        {
            z[i] = row[0][node];
            for j in 0..unknowns {
                m[i * unknowns + j] = row[j + 1][node];
            }
        }
        (delta[node], mixed[node]) = mixer.mix_first(&m, &z);
    }
    (delta, mixed)
}
