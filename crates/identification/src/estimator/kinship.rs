//! The results that a method can take over from another on the same window: methods of a study often differ in a
//! last step alone. Nothing is computed in another way, so no bit depends on it.

use super::iv_options::{Auxiliary, IvOptions};
use super::methods::MethodOptions;
use super::{Covariance, Pass, Solver};

/// The results that a method has in common with an earlier one on the same window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinship {
    /// All: they have the same options.
    Same,
    /// All but standard errors, which assume this: [`super::Estimator::estimate_again`] of the earlier method.
    Covariance(Covariance),
    /// The parameters of some passes: [`super::Estimator::estimate_from`].
    Passes {
        /// How many at most, from the first on.
        most: usize,
        /// Whether the first unstable pass is the last of them.
        until_unstable: bool,
    },
}

impl Kinship {
    /// Returns the passes of the earlier method that the other has too.
    pub fn of(self, passes: &[Pass]) -> &[Pass] {
        let Self::Passes { most, until_unstable } = self else {
            return passes;
        };
        let passes = &passes[..most.min(passes.len())];
        let unstable = passes.iter().position(|pass| pass.unstable);
        match unstable.filter(|_| until_unstable) {
            None => passes,
            Some(last) => &passes[..=last],
        }
    }

    /// The results that methods of these options share, if that saves work. `errors`: whether standard errors are
    /// wanted from methods that can do without them.
    pub(super) fn between(earlier: &MethodOptions, later: &MethodOptions, errors: bool) -> Option<Self> {
        use MethodOptions as M;
        if earlier == later {
            return Some(Self::Same);
        }
        match (earlier, later) {
            (M::Oe(earlier), M::Oe(later)) => {
                let mut same = earlier.clone();
                same.covariance = later.covariance;
                (same == *later && later.choose.is_none())
                    .then(|| Self::Covariance(later.covariance.unwrap_or_default()))
            }
            (M::InstrumentalVariables(earlier), M::InstrumentalVariables(later)) => {
                let mut same = earlier.clone();
                same.covariance = later.covariance;
                if !errors {
                    passes_in_common(earlier, later)
                } else if same == *later && is_of_the_paper(later) {
                    Some(Self::Covariance(later.covariance.unwrap_or_default()))
                } else {
                    None
                }
            }
            // Iteration 0 is least squares.
            (M::LeastSquares(ls), M::InstrumentalVariables(iv))
            | (M::InstrumentalVariables(iv), M::LeastSquares(ls)) => {
                let same = ls.solver == iv.solver && ls.initial_state == iv.initial_state;
                let found = same && iv.solver == Solver::Partitioned && is_of_the_paper(iv);
                (found && !errors).then_some(Self::Passes {
                    most: 1,
                    until_unstable: false,
                })
            }
            _ => None,
        }
    }
}

/// Whether no option of the general form is given.
fn is_of_the_paper(of: &IvOptions) -> bool {
    of.orders.is_none() && of.rows.is_none() && of.reading.is_none() && of.fixed_model.is_none()
}

/// The passes of which a is the same, and b and x0 but for what `auxiliary` makes of them.
fn passes_in_common(earlier: &IvOptions, later: &IvOptions) -> Option<Kinship> {
    // A new option does not compile until someone decides what it changes.
    let IvOptions {
        solver,
        iterations,
        stage10,
        auxiliary,
        drive,
        gain,
        instruments,
        stabilise,
        initial_state,
        orders: _,
        rows: _,
        reading: _,
        fixed_model: _,
        // Without standard errors it is not used.
        covariance: _,
    } = later;
    let begins = earlier.solver == *solver && earlier.stage10 == *stage10 && earlier.initial_state == *initial_state;
    if !(begins && is_of_the_paper(earlier) && is_of_the_paper(later)) {
        return None;
    }
    let instruments = earlier.drive == *drive && earlier.gain == *gain && earlier.instruments == *instruments;
    let all = earlier.iterations.min(*iterations) + 1;
    let most = match (earlier.auxiliary, *auxiliary) {
        _ if !instruments => 1,
        (earlier, later) if earlier == later => all,
        // The passes of `literal` are those of `frozen` with another b, and the first is that of `refresh`.
        (Auxiliary::Frozen, Auxiliary::Literal) => all,
        (Auxiliary::Refresh, Auxiliary::Frozen | Auxiliary::Literal) => 2,
        _ => 1,
    };
    Some(Kinship::Passes {
        most,
        until_unstable: earlier.stabilise != *stabilise,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{
        Drive, Estimator, LsOptions, Method, OeOptions, Problem, SearchStarts, Shape, Stabilise, Window,
    };
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    const N: usize = 40;

    /// Short noisy records, of which some passes are unstable or fail.
    fn record(trial: u64) -> [Vec<f64>; 2] {
        let signal = |purpose| {
            let mut to = vec![0.0; N];
            let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
            input.fill(&mut stream(3, trial, purpose), &mut to);
            to
        };
        let (u, e, mut y) = (signal(Purpose::Input), signal(Purpose::Plant), vec![0.0; N]);
        for k in 2..N {
            y[k] = 1.7 * y[k - 1] - 0.9 * y[k - 2] + u[k - 1] + 0.5 * u[k - 2];
        }
        y.iter_mut().zip(&e).for_each(|(y, e)| *y += 2.0 * e);
        [u, y]
    }

    /// All that a pass holds, with the bits of its numbers.
    fn content(pass: &Pass) -> String {
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let of_model: Vec<f64> = pass.model.parameters().collect();
        let numbers = [&pass.a, &pass.b, &pass.h, &pass.x0, &of_model, &pass.model.covariance];
        let single = [pass.loss, pass.condition, pass.direct, pass.model.noise_variance];
        format!(
            "{:?} {:?} {:?} {:?} {:?} {} {:?} {:?}",
            numbers.map(|of| bits(of)),
            bits(&single),
            pass.iterations,
            pass.minima,
            pass.progress,
            pass.unstable,
            pass.failure,
            pass.singular_values.len(),
        )
    }

    /// Whoever takes passes over has those of an estimate of its own, bit by bit. Returns how many were taken over, and
    /// how many there were.
    fn check(earlier: &Method, later: &Method, errors: bool) -> [usize; 2] {
        let problem = Problem {
            covariance: errors,
            ..Shape { order: 2, window: N }.into()
        };
        let Some(kinship) = later.kinship(earlier, errors) else {
            return [0; 2];
        };
        let prepare = |method: &Method| -> (Box<dyn Estimator>, Vec<Pass>) {
            let passes = vec![Pass::new(2); method.passes()];
            (method.prepare(problem).unwrap(), passes)
        };
        let (mut first, mut known) = prepare(earlier);
        let (mut alone, mut expected) = prepare(later);
        let (mut helped, mut found) = prepare(later);
        let [mut taken, mut all] = [0; 2];
        for trial in 0..60 {
            let [u, y] = record(trial);
            let window = Window::new(&u, &y, N);
            for passes in [&mut known, &mut expected, &mut found] {
                passes.iter_mut().for_each(Pass::clear);
            }
            first.estimate(window, &mut known);
            alone.estimate(window, &mut expected);
            match kinship {
                Kinship::Same => found.iter_mut().zip(&known).for_each(|(to, of)| to.assign(of)),
                Kinship::Covariance(kind) => {
                    assert!(first.estimate_again(kind, window, &known, &mut found));
                }
                Kinship::Passes { .. } => {
                    let common = kinship.of(&known);
                    helped.estimate_from(common, window, &mut found);
                    taken += common.len().min(found.len());
                    all += found.len();
                }
            }
            for (number, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert_eq!(content(found), content(expected), "{kinship:?} {trial} {number}");
            }
        }
        [taken, all]
    }

    #[test]
    fn passes_taken_over_are_those_of_an_own_estimate() {
        let mut methods = vec![Method::least_squares(LsOptions::default())];
        for auxiliary in [Auxiliary::Refresh, Auxiliary::Frozen, Auxiliary::Literal] {
            for drive in [Drive::Model, Drive::Observer] {
                for (stabilise, iterations) in [(Stabilise::None, 5), (Stabilise::Reflect, 5), (Stabilise::None, 3)] {
                    methods.push(Method::instrumental_variables(IvOptions {
                        iterations,
                        auxiliary,
                        drive,
                        stabilise,
                        ..IvOptions::default()
                    }));
                }
            }
        }
        let mut sum = [0; 2];
        for earlier in &methods {
            for later in &methods {
                let found = check(earlier, later, false);
                sum = [sum[0] + found[0], sum[1] + found[1]];
            }
        }
        assert!(sum[0] > sum[1] / 6 && sum[0] < sum[1], "{sum:?}");
    }

    #[test]
    fn other_standard_errors_of_the_same_estimate() {
        use Covariance::{Coloured, Robust, White};
        let all = [None, Some(White), Some(Coloured), Some(Robust)];
        for (earlier, later) in all.into_iter().flat_map(|a| all.map(|b| (a, b))) {
            let oe = |covariance| {
                let options = OeOptions {
                    starts: SearchStarts::Random(2),
                    covariance,
                    ..OeOptions::default()
                };
                Method::named("oe", options)
            };
            let iv = |covariance| {
                let options = IvOptions {
                    iterations: 2,
                    covariance,
                    ..IvOptions::default()
                };
                Method::instrumental_variables(options).reporting(&[2]).unwrap()
            };
            for errors in [false, true] {
                assert!(oe(later).kinship(&oe(earlier), errors).is_some());
                check(&oe(earlier), &oe(later), errors);
                assert!(iv(later).kinship(&iv(earlier), errors).is_some());
                check(&iv(earlier), &iv(later), errors);
            }
        }
        // Standard errors of another pass.
        let all = Method::instrumental_variables(IvOptions::default());
        let last = Method::instrumental_variables(IvOptions::default());
        let last = last.reporting(&[4]).unwrap();
        assert_eq!(last.kinship(&all, true), None);
    }
}
