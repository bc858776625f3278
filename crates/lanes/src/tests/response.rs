//! Responses of models have the bits of one model alone, whatever its neighbours.

use super::tested;
use crate::passes::PassPack;
use crate::record::RecordSource;
use crate::response::Responses;
use crate::{Call, Isa};
use asobench_identification::data::Process;
use asobench_identification::metric::{Response, System};
use asobench_identification::plant::{Numerator, StateSpace, nikolov2023, random_stable};
use asobench_identification::real::{MOST_LANES, Mask, Real};
use asobench_identification::signal::{
    Input, InputLaw, LevelReading, NoiseFilter, Purpose, Sequence, normal::fill_standard_normal, stream,
};
use std::array::from_fn;

const SEED: u64 = 5;

/// A model in each lane, and the trial whose input it gets.
struct Models<'a> {
    source: &'a RecordSource<'a>,
    systems: &'a [[Vec<f64>; 2]; MOST_LANES],
    trials: &'a [u64; MOST_LANES],
    samples: usize,
}

impl Call for Models<'_> {
    /// e_g and FIT of each lane; the last one has no parameters.
    type Output = Vec<[f64; 2]>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        let mut pass = PassPack::<R, N>::unknown();
        pass.parameters = Mask::from_bits(u8::MAX >> 1);
        for lane in 0..R::LANES {
            let [a, b] = &self.systems[lane];
            for i in 0..a.len() {
                pass.a[i] = pass.a[i].with_lane(lane, a[i]);
                pass.b[i] = pass.b[i].with_lane(lane, b[i]);
            }
        }
        let mut responses = Responses::<R, N>::new(self.source, self.samples);
        // Draws other trials first, to check that nothing of them remains.
        responses.draw(self.source, &[7; MOST_LANES]);
        responses.draw(self.source, self.trials);
        let [e_g, fit] = [responses.impulse_response_error(&pass), responses.fresh_fit(&pass)];
        let of_lane = |lane| [e_g.lane(lane), fit.lane(lane)];
        (0..R::LANES).map(of_lane).collect()
    }
}

/// Computes the same for one model by the scalar code.
fn alone(plant: &StateSpace, input: &Input, trial: u64, [a, b]: &[Vec<f64>; 2], samples: usize) -> [f64; 2] {
    let (plant, model) = (
        System {
            a: plant.a(),
            b: plant.b(),
            d: 0.0,
        },
        System { a, b, d: 0.0 },
    );
    let (mut response, mut x) = (Response::new(samples), vec![0.0; a.len()]);
    let mut fresh = stream(SEED, trial, Purpose::FreshInput);
    input.fill(&mut fresh, response.input());
    response.set_impulse_response(plant, &mut x);
    response.set_fresh_output(plant, &mut x);
    [
        response.impulse_response_error(model, &mut x),
        response.fresh_fit(model, &mut x),
    ]
}

/// Returns the plant, models near it, one that overflows, one that is unstable, and such as are not finite. The first
/// four are in packs of every width.
fn models(plant: &StateSpace, seed: u64) -> [[Vec<f64>; 2]; MOST_LANES] {
    let mut numbers = vec![0.0; 2 * plant.order() * MOST_LANES];
    fill_standard_normal(&mut stream(SEED, seed, Purpose::NoiseDrive), &mut numbers);
    from_fn(|lane| {
        let scale = [0.0, 1e-9, 0.05, 0.3, 4.0, 0.1, 0.1, 0.1][lane];
        let near = |from: &[f64], number: usize| {
            let numbers = &numbers[from.len() * (2 * lane + number)..];
            let near = from.iter().zip(numbers).map(|(x, z)| x + scale * z);
            near.collect::<Vec<f64>>()
        };
        let [mut a, mut b] = [near(plant.a(), 0), near(plant.b(), 1)];
        match lane {
            3 => a[0] = 1e9,
            5 => a[0] = f64::NAN,
            6 => b[0] = f64::INFINITY,
            _ => {}
        }
        [a, b]
    })
}

/// The lanes' numbers have the bits of the scalar code's, for every order, input and width.
#[test]
fn a_lane_has_the_bits_of_its_model_alone() {
    let trials = from_fn(|lane| [0, 5, 1 << 40, 9, 1000, 2, 3, u64::MAX][lane]);
    let (mut finite, mut infinite) = (0, 0);
    let orders = (1..=12).chain([20, 24]);
    let random = orders.map(|order| random_stable(order, 0.95, &mut stream(2, order as u64, Purpose::Plant)));
    let paper = [Numerator::StateSpace, Numerator::default()].map(nikolov2023);
    for plant in random.chain(paper) {
        let order = plant.order();
        for (samples, input) in [
            Input::new(InputLaw::Signs, 10.0, Sequence::Independent),
            Input::new(InputLaw::Signs, 0.5, Sequence::Periodic127),
            Input::new(InputLaw::Gaussian, 3.0, Sequence::default()),
            Input::Samples([3.0, -1.0, 0.5, 0.0, 7.0].into()),
        ]
        .into_iter()
        .enumerate()
        .map(|(i, input)| (200 - 3 * i, input))
        {
            let level = LevelReading::default();
            let (noise, x0) = (NoiseFilter::white(), vec![1.0; order]);
            let process = Process::new(plant.clone(), x0, input.clone(), noise, level);
            let process = process.expect("a valid process");
            let (_, noise, variances) = process.open_loop().expect("an open loop");
            let source = RecordSource {
                settings: process.settings(),
                plant: &plant,
                noise,
                variances,
                seed: SEED,
                eta: 1.0,
                window: 3 * order,
            };
            let models = models(&plant, order as u64);
            for isa in tested() {
                let found = isa.dispatch(
                    order,
                    Models {
                        source: &source,
                        systems: &models,
                        trials: &trials,
                        samples,
                    },
                );
                for (lane, found) in found.iter().enumerate() {
                    let expected = alone(&plant, &input, trials[lane], &models[lane], samples);
                    let expected = if lane + 1 == MOST_LANES {
                        [f64::NAN; 2]
                    } else {
                        expected
                    };
                    let same = found.map(f64::to_bits) == expected.map(f64::to_bits);
                    let what = format!("{isa}, order {order}, lane {lane}");
                    assert!(same, "{what}: {found:?} for {expected:?}");
                    finite += usize::from(found[0].is_finite());
                    infinite += usize::from(found[0].is_infinite());
                    if (5..8).contains(&lane) {
                        assert!(found.iter().all(|x| x.is_nan()), "{what}");
                    }
                }
            }
        }
    }
    let packs = tested().iter().any(|isa| *isa != Isa::Portable);
    assert!(finite > 0 && (infinite > 0 || !packs));
}
