//! The starts of searches: F, C and D from linear methods and from random stable models. A and B follow by least
//! squares.

use super::draws::{draw, draw_slow, move_zeros};
use super::instrumental::{Instrumental, Kind};
use super::kernels::{Triangle, divide, filter};
use crate::estimator::SetupError;
use crate::estimator::known_model::KnownModel;
use crate::estimator::lag_sums::{System, TINY, lagged_products};
use crate::estimator::null_space::NullSpaceFit;
use crate::estimator::reflection::reflect_zeros;
use crate::estimator::reflection::stable;
use crate::model::polynomial::extent;
use crate::model::{LinearModel, Orders};
use crate::signal::{Purpose, stream};

/// Seed of the random starts, which are the same for every record.
const SEED: u64 = 0x7065_6d00;

/// The moduli of random zeros of C that are near those of D, as shares of these.
const NEARLY: f64 = 0.9;

/// Lags of the long autoregression in the method of Hannan and Rissanen.
const LONG: usize = 20;

/// A model with a zero of F outside the circle of this radius is one of a plant that may be sampled fast.
const SLOW: f64 = 0.98;

/// Starts with random zeros of F near 1. One in three finds what other starts miss.
const SLOW_DRAWS: usize = 8;

/// Independent starts that agree are enough for at least so many samples times the cube of the order. In shorter
/// records they agree on minima that are not the lowest: of 366 hard records on three, of orders 4 and 6 with up to 500
/// samples.
const ENOUGH: usize = 12;

/// Up to this order and from so many samples on they are enough without another method's model too: it leads no lower
/// there (`no_subspace_model_leads_lower_at_order_2`). At higher orders, and in shorter records, it sometimes does.
const ENOUGH_ALONE: (usize, usize) = (2, 300);

/// Weighted solutions of null-space fitting.
const REFINEMENTS: usize = 3;

/// How a start is made.
#[derive(Clone, Copy, Debug)]
enum Recipe {
    /// The true plant, with the noise model of its residuals.
    Truth,
    /// A denominator by instruments or least squares, with a noise model.
    Denominator(Kind, Noise),
    /// Weighted null-space fitting from the high-order model of this number.
    NullSpace(usize),
    /// F = 1 and white noise.
    White,
    /// Random zeros of F near 1, where the best model so far has one near the unit circle.
    DrawnSlow(usize),
    /// Random F, C and D.
    Drawn(usize),
}

/// The noise model beside a denominator.
#[derive(Clone, Copy, Debug)]
enum Noise {
    /// C = D = 1.
    White,
    /// C and D of the residuals by the method of Hannan and Rissanen.
    Residuals,
    /// C is the denominator: the noise is white at the output.
    Output,
}

/// Returns the starts of a structure, the most promising first.
fn recipes(orders: Orders) -> Vec<Recipe> {
    use Recipe::{Denominator, DrawnSlow, NullSpace, White};
    let Orders { na, nc, nd, nf, .. } = orders;
    let mut all = Vec::new();
    let noise = nc + nd > 0;
    if na + nf == 0 {
        if noise {
            all.push(NullSpace(0));
        }
    } else if na * nf > 0 {
        for kind in [Kind::Refined, Kind::SteiglitzMcBride, Kind::LeastSquares] {
            all.push(Denominator(kind, Noise::Residuals));
        }
    } else if na > 0 && noise {
        all.extend([
            NullSpace(0),
            Denominator(Kind::Refined, Noise::Output),
            NullSpace(1),
            NullSpace(2),
            Denominator(Kind::LeastSquares, Noise::Residuals),
            Denominator(Kind::Refined, Noise::Residuals),
        ]);
    } else if nf > 0 {
        let white = if noise { Noise::Residuals } else { Noise::White };
        all.extend([
            Denominator(Kind::Refined, white),
            NullSpace(0),
            NullSpace(1),
            NullSpace(2),
            Denominator(Kind::SteiglitzMcBride, white),
            Denominator(Kind::LeastSquares, white),
            Denominator(Kind::Slow, white),
        ]);
        all.extend((0..SLOW_DRAWS).map(DrawnSlow));
        if noise {
            all.push(Denominator(Kind::Refined, Noise::White));
        }
    }
    all.push(White);
    all
}

impl Recipe {
    /// Whether it is one of the linear methods that cost little.
    fn is_independent(self) -> bool {
        match self {
            Self::Denominator(kind, _) => kind != Kind::Slow,
            _ => matches!(self, Self::White),
        }
    }
}

/// Whether independent starts that agree are enough: for `oe` and `armax`, whose minima are few in long records.
fn may_agree(orders: Orders, window: usize) -> bool {
    let Orders { na, nc, nd, nf, .. } = orders;
    let is_one_of_them = nd == 0 && (na == 0) == (nc == 0) && (na == 0) != (nf == 0);
    is_one_of_them && window >= ENOUGH * na.max(nf).pow(3)
}

/// Starts for records of one length.
pub(super) struct Starts {
    orders: Orders,
    recipes: Vec<Recipe>,
    /// How many of them are enough if all lead to one minimum.
    enough: Option<usize>,
    /// How many come before the model of another method: those that may be enough without it, or none.
    before_other: usize,
    /// The true model if it is the only start.
    truth: Option<LinearModel>,
    /// The unit of B in the record.
    gain: f64,
    instrumental: Instrumental,
    null_space: NullSpaceFit,
    /// The orders of the high-order models of the record, once they are known.
    high_orders: Option<[usize; 3]>,
    /// The next start.
    turn: usize,
    model: LinearModel,
    theta: Vec<f64>,
    /// The regression for A and B given F, C and D.
    linear: Triangle,
    system: System,
    u: Vec<f64>,
    y: Vec<f64>,
    e: Vec<f64>,
    scratch: Vec<f64>,
}

impl Starts {
    pub(super) fn new(orders: Orders, random: usize, window: usize) -> Self {
        let signal = || vec![0.0; window];
        let mut recipes = recipes(orders);
        let enough = may_agree(orders, window).then(|| {
            recipes.sort_by_key(|recipe| !recipe.is_independent());
            recipes.iter().filter(|recipe| recipe.is_independent()).count()
        });
        recipes.extend((0..random).map(Recipe::Drawn));
        let alone = orders.na.max(orders.nf) <= ENOUGH_ALONE.0 && window >= ENOUGH_ALONE.1;
        Self {
            recipes,
            enough,
            before_other: enough.filter(|_| alone).unwrap_or(0),
            truth: None,
            gain: 1.0,
            instrumental: Instrumental::new(orders, window),
            null_space: NullSpaceFit::new(orders, None, window),
            high_orders: None,
            turn: 0,
            model: LinearModel::zero(orders),
            theta: vec![0.0; orders.parameters()],
            linear: Triangle::new(orders.na + orders.nb),
            system: System::default(),
            orders,
            u: signal(),
            y: signal(),
            e: signal(),
            scratch: Vec::new(),
        }
    }

    /// Changes the starts to the true plant alone.
    pub(super) fn with_truth(mut self, truth: &KnownModel) -> Result<Self, SetupError> {
        let orders = self.orders;
        let truth = &truth.pass().model;
        let mut model = LinearModel::zero(orders);
        let denominator = if orders.na > 0 { &mut model.a } else { &mut model.f };
        let needed = truth.a.iter().rposition(|a| *a != 0.0).map_or(0, |last| last + 1);
        if needed > denominator.len() {
            return Err(SetupError::TruthOfOtherOrders { orders });
        }
        denominator[..needed].copy_from_slice(&truth.a[..needed]);
        // Rounding errors of the way from the state space are no coefficients.
        if let Some((first, last)) = extent(&truth.b) {
            if first < orders.nk || last >= model.b.len() {
                return Err(SetupError::TruthOfOtherOrders { orders });
            }
            model.b[first..=last].copy_from_slice(&truth.b[first..=last]);
        }
        self.truth = Some(model);
        self.recipes = vec![Recipe::Truth];
        self.enough = None;
        Ok(self)
    }

    /// Makes all of the starts, whether some agree or not.
    #[cfg(test)]
    pub(super) fn all(mut self) -> Self {
        self.enough = None;
        self
    }

    /// Prepares for a record in which B is in units of `gain`.
    pub(super) fn begin(&mut self, gain: f64) {
        self.turn = 0;
        self.gain = gain;
        self.high_orders = None;
        self.instrumental.begin();
    }

    /// Returns whether the last start was random in all of F, C and D.
    pub(super) fn was_drawn(&self) -> bool {
        let kinds = kinds_of_draws(self.orders);
        matches!(self.recipes[self.turn - 1], Recipe::Drawn(number) if number % kinds == 0)
    }

    /// Returns whether it is the turn of another method's model.
    pub(super) fn is_turn_of_other(&self) -> bool {
        self.turn >= self.before_other
    }

    /// Returns whether the independent starts end here, each of which led to one of the `searches`, so that a minimum
    /// of all is enough: noise does not hide its plant from them, as it does one that is sampled fast.
    pub(super) fn are_enough(&mut self, searches: usize, minimum: &[f64]) -> bool {
        let end = self.theta.len();
        let (a, f) = (&minimum[..self.orders.na], &minimum[end - self.orders.nf..end]);
        self.enough == Some(self.turn) && searches == self.turn && ![a, f].into_iter().any(|of| self.is_slow(of))
    }

    /// Returns the next start; `None` after the last. Some random starts are near the best point so far.
    pub(super) fn next(&mut self, u: &[f64], y: &[f64], best: Option<&[f64]>) -> Option<&[f64]> {
        loop {
            let recipe = *self.recipes.get(self.turn)?;
            self.turn += 1;
            if self.make(recipe, u, y, best) {
                for (theta, parameter) in self.theta.iter_mut().zip(self.model.parameters()) {
                    *theta = parameter;
                }
                return Some(&self.theta);
            }
        }
    }

    /// Computes the model of a start; false if there is none.
    fn make(&mut self, recipe: Recipe, u: &[f64], y: &[f64], best: Option<&[f64]>) -> bool {
        let of_f = self.theta.len() - self.orders.nf..self.theta.len();
        let of_slow = matches!(recipe, Recipe::Denominator(Kind::Slow, _) | Recipe::DrawnSlow(_));
        if of_slow && !best.is_some_and(|best| self.is_slow(&best[of_f])) {
            return false;
        }
        let LinearModel { a, c, d, f, .. } = &mut self.model;
        for polynomial in [&mut *c, &mut *d, &mut *f] {
            polynomial[1..].fill(0.0);
        }
        match recipe {
            Recipe::Truth => {
                let Some(truth) = &self.truth else {
                    return false;
                };
                self.model.assign(truth);
                self.model.b.iter_mut().for_each(|b| *b /= self.gain);
                if !self.hannan_rissanen(u, y) {
                    self.model.c[1..].fill(0.0);
                    self.model.d[1..].fill(0.0);
                }
                true
            }
            Recipe::White => self.solve_linear(u, y),
            Recipe::Drawn(number) => {
                let mut random = stream(SEED, number as u64, Purpose::Plant);
                let turn = number % kinds_of_draws(self.orders);
                if let Some(best) = best.filter(|_| turn > 0) {
                    self.model.set_parameters(&best[..self.theta.len()]);
                }
                let LinearModel { c, d, f, .. } = &mut self.model;
                match turn {
                    0 => [f, c, d].into_iter().for_each(|of| draw(of, &mut random)),
                    1 => move_zeros(&mut [f, c, d], &mut random),
                    // Noise models have minima of their own.
                    2 => [c, d].into_iter().for_each(|of| draw(of, &mut random)),
                    // C and D that nearly cancel: a narrow peak or dip of the noise's spectrum.
                    _ => {
                        draw(d, &mut random);
                        let mut power = 1.0;
                        c[1..].fill(0.0);
                        for (c, d) in c.iter_mut().zip(&*d) {
                            *c = power * d;
                            power *= NEARLY;
                        }
                    }
                }
                self.solve_linear(u, y)
            }
            Recipe::DrawnSlow(number) => {
                draw_slow(f, &mut stream(SEED + 1, number as u64, Purpose::Plant));
                self.solve_linear(u, y)
            }
            Recipe::NullSpace(number) => {
                let fit = &mut self.null_space;
                let orders = *self.high_orders.get_or_insert_with(|| fit.begin(u, y));
                let order = orders[number];
                if orders[..number].contains(&order) || !fit.start(order) {
                    return false;
                }
                for _ in 0..REFINEMENTS {
                    if !fit.refine() {
                        return false;
                    }
                }
                if !fit.stabilise() {
                    return false;
                }
                self.model.assign(&fit.model);
                self.solve_linear(u, y)
            }
            Recipe::Denominator(kind, noise) => {
                let Some(found) = self.instrumental.find(kind, u, y) else {
                    return false;
                };
                if self.orders.nf > 0 {
                    f.copy_from_slice(found);
                } else {
                    a.copy_from_slice(found);
                }
                match noise {
                    Noise::White => self.solve_linear(u, y),
                    Noise::Output => {
                        for (c, found) in c.iter_mut().zip(found) {
                            *c = *found;
                        }
                        (stable(c, &mut self.scratch) || reflect_zeros(c)) && self.solve_linear(u, y)
                    }
                    Noise::Residuals => {
                        self.solve_linear(u, y) && self.hannan_rissanen(u, y) && self.solve_linear(u, y)
                    }
                }
            }
        }
    }

    /// Whether 1 and these coefficients have a zero near the unit circle.
    fn is_slow(&mut self, coefficients: &[f64]) -> bool {
        // The zeros of F(z SLOW) are those of F over SLOW.
        let scaled = coefficients.iter().scan(1.0, |power, f| {
            *power /= SLOW;
            Some(f * *power)
        });
        let scaled: Vec<f64> = [1.0].into_iter().chain(scaled).collect();
        !stable(&scaled, &mut self.scratch)
    }

    /// Computes A and B that minimise the sum of squares given F, C and D: linear in `D/C y` and `D/(C F) u`.
    fn solve_linear(&mut self, u: &[f64], y: &[f64]) -> bool {
        let Orders { na, nb, nk, .. } = self.orders;
        let LinearModel { c, d, f, .. } = &self.model;
        for (to, from, with_f) in [(&mut self.u, u, true), (&mut self.y, y, false)] {
            filter(d, from, to);
            divide(c, to);
            if with_f {
                divide(f, to);
            }
        }
        let (u, y) = (&self.u, &self.y);
        let reduced = self.linear.run(y.len(), |j, first, to| {
            let (signal, lag, sign) = if j < na {
                (y, j + 1, -1.0)
            } else if j < na + nb {
                (u, j - na + nk, 1.0)
            } else {
                (y, 0, 1.0)
            };
            for (row, to) in to.iter_mut().enumerate() {
                *to = (first + row).checked_sub(lag).map_or(0.0, |k| sign * signal[k]);
            }
        });
        let mut solution = std::mem::take(&mut self.scratch);
        solution.clear();
        solution.extend_from_slice(self.linear.top());
        let solved = reduced.is_ok() && self.linear.solve(&mut solution);
        if solved {
            let (a, b) = solution.split_at(na);
            self.model.a[1..].copy_from_slice(a);
            self.model.b[nk..].copy_from_slice(b);
        }
        self.scratch = solution;
        solved
    }

    /// Computes C and D from the noise `w = A y - B/F u` of the present model: e by a long autoregression, then w on
    /// the past of both. The zeros of C are reflected. Returns false if there is no solution.
    fn hannan_rissanen(&mut self, u: &[f64], y: &[f64]) -> bool {
        let Orders { nc, nd, .. } = self.orders;
        let lags = LONG.min(y.len() / 4);
        if nc + nd == 0 || lags == 0 {
            return false;
        }
        let LinearModel { a, b, f, .. } = &self.model;
        filter(b, u, &mut self.u);
        divide(f, &mut self.u);
        filter(a, y, &mut self.y);
        for (w, x) in self.y.iter_mut().zip(&self.u) {
            *w -= x;
        }
        let (w, system) = (&self.y, &mut self.system);
        system.clear(lags);
        lagged_products(w, w, (1, lags), (1, lags), |i, j, value| {
            system.put(i, j, value);
        });
        lagged_products(w, w, (1, lags), (0, 1), |i, _, value| {
            system.put(i, lags, -value);
        });
        let reached = system.factorise(TINY);
        self.scratch.clear();
        self.scratch.resize(reached + 1, 1.0);
        system.back_substitute(&mut self.scratch[1..]);
        filter(&self.scratch, w, &mut self.e);
        // w(k) = -d_1 w(k-1) - ... + c_1 e(k-1) + ... + e(k).
        let (e, width) = (&self.e, nd + nc);
        system.clear(width);
        lagged_products(w, w, (1, nd), (0, nd + 1), |i, j, value| match j {
            0 => system.put(i, width, -value),
            _ => system.put(i, j - 1, value),
        });
        lagged_products(e, e, (1, nc), (1, nc), |i, j, value| {
            system.put(nd + i, nd + j, value);
        });
        lagged_products(e, w, (1, nc), (0, nd + 1), |i, j, value| {
            if j == 0 {
                system.put(nd + i, width, value);
            } else {
                system.put(nd + i, j - 1, -value);
                system.put(j - 1, nd + i, -value);
            }
        });
        if system.factorise(TINY) < width {
            return false;
        }
        self.scratch.resize(width, 0.0);
        system.back_substitute(&mut self.scratch);
        let (d, c) = self.scratch.split_at(nd);
        self.model.d[1..].copy_from_slice(d);
        self.model.c[1..].copy_from_slice(c);
        stable(&self.model.c, &mut self.scratch) || reflect_zeros(&mut self.model.c)
    }
}

/// Returns after how many random starts the next is random in all of F, C and D; those between are near the best point
/// so far.
fn kinds_of_draws(orders: Orders) -> usize {
    if orders.nc > 0 && orders.nd > 0 { 4 } else { 2 }
}
