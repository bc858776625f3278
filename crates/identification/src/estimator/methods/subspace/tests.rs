//! Subspace methods on records without noise, and what they refuse.

use super::*;
use crate::estimator::{Progress, Shape};
use crate::plant::polynomial_from_poles;
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

const N: usize = 400;

fn plant(order: usize, nk: usize) -> LinearModel {
    let orders = Orders {
        nb: order + 1 - nk,
        nf: order,
        nk,
        ..Orders::default()
    };
    let mut model = LinearModel::zero(orders);
    let poles: Vec<_> = (0..order).map(|i| faer::c64::new(0.8 - 0.25 * i as f64, 0.0)).collect();
    for (f, coefficient) in model.f[1..].iter_mut().zip(polynomial_from_poles(&poles)) {
        *f = coefficient.re;
    }
    for (i, b) in model.b[nk..].iter_mut().enumerate() {
        *b = 1.0 / (1.0 + i as f64);
    }
    model
}

/// Without noise every weighting finds the plant, with and without a direct term, for orders 1 to 4.
#[test]
fn a_record_without_noise_gives_its_model() {
    for (order, nk) in [(1, 1), (2, 0), (2, 1), (3, 1), (4, 0), (4, 1)] {
        let truth = plant(order, nk);
        let (mut u, mut y) = (vec![0.0; N], vec![0.0; N]);
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(21, order as u64, Purpose::Input), &mut u);
        truth.simulate(&u, &mut y);
        for weights in [Weights::N4sid, Weights::Moesp, Weights::Cva] {
            let options = N4sidOptions {
                orders: Some(Orders::arx(order, order, nk)),
                block_rows: Some(6),
                weights,
                ..N4sidOptions::default()
            };
            let shape = Shape { order, window: N };
            let mut method = options.prepare(&shape.into()).unwrap();
            let mut passes = [Pass::new(order)];
            method.estimate(Window::new(&u, &y, N), &mut passes);
            let [pass] = passes;
            assert_eq!((pass.failure, pass.progress), (None, Progress::InitialState));
            for (found, expected) in pass.model.parameters().zip(truth.parameters()) {
                assert!((found - expected).abs() < 1e-9, "{order} {nk}: {found} {expected}");
            }
            let values = &pass.singular_values;
            assert!(values[order] < 1e-10 * values[0], "{values:?}");
            assert!(pass.x0.iter().all(|x| x.abs() < 1e-9));
        }
    }
}

/// SIPPY's offset and units change nothing if the record's first samples are 0.
#[test]
fn units_of_a_reading_are_taken_back() {
    let truth = plant(2, 1);
    let (mut u, mut y) = (vec![0.0; N], vec![0.0; N]);
    let input = Input::new(InputLaw::Gaussian, 3.0, Sequence::Independent);
    input.fill(&mut stream(22, 1, Purpose::Input), &mut u);
    u[0] = 0.0;
    truth.simulate(&u, &mut y);
    let options = MoespOptions {
        block_rows: Some(6),
        reading: Some(SubspaceReading::Sippy),
        ..MoespOptions::default()
    };
    let shape = Shape { order: 2, window: N };
    let mut method = options.prepare(&shape.into()).unwrap();
    let mut passes = [Pass::new(2)];
    method.estimate(Window::new(&u, &y, N), &mut passes);
    let [pass] = passes;
    assert_eq!(pass.failure, None);
    for (found, expected) in pass.model.parameters().zip(truth.parameters()) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
    assert!(pass.loss < 1e-20);
}

#[test]
fn what_cannot_be_is_refused() {
    let orders = |n, nk| Some(Orders::arx(n, n, nk));
    for (orders, rows, part) in [
        (orders(2, 2), 15, "nk = 0 or 1"),
        (orders(4, 1), 4, "more than the order 4"),
        (orders(4, 1), 900, "expected 2 to 200"),
    ] {
        let error = check(orders, Some(rows)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let short = Subspace::new(plant(2, 1).orders(), Some(15), Weights::Moesp, 88);
    let error = short.err().unwrap().to_string();
    assert!(error.contains("at least 89 samples"), "{error}");
}

/// A slow input to a lightly damped plant: the weighting by default is as close to y as the best of the three, whose
/// own can be far off.
#[test]
fn the_weighting_follows_the_record() {
    let n = 1400;
    let draw = |purpose, deviation: f64| {
        let mut signal = vec![0.0; n];
        let input = Input::new(InputLaw::Gaussian, deviation, Sequence::Independent);
        input.fill(&mut stream(23, 1, purpose), &mut signal);
        signal
    };
    let mut u = draw(Purpose::Input, 0.3);
    crate::model::polynomial::divide(&[1.0, -0.95], &mut u);
    let mut truth = LinearModel::zero(model_orders(4, 1));
    let f = crate::model::polynomial::multiply(&[1.0, -1.9832, 0.9976], &[1.0, -1.8517, 0.9939]);
    truth.f.copy_from_slice(&f);
    truth.b[1..].copy_from_slice(&[0.008, -0.0076, -0.0074, 0.0078]);
    let mut y = vec![0.0; n];
    truth.simulate(&u, &mut y);
    let size = variance(&y).sqrt();
    y.iter_mut()
        .zip(draw(Purpose::NoiseDrive, 0.016 * size))
        .for_each(|(y, e)| *y += e);
    let loss = |weights| {
        let options = N4sidOptions {
            orders: Some(Orders::arx(4, 4, 1)),
            weights,
            ..N4sidOptions::default()
        };
        let pass = crate::estimator::test_setup::estimate(&options, 4, &u, &y);
        assert!(!pass.unstable, "{weights}");
        pass.loss
    };
    let own = [Weights::N4sid, Weights::Moesp, Weights::Cva].map(loss);
    let least = own.into_iter().fold(f64::INFINITY, f64::min);
    assert!(loss(Weights::Auto) <= least * (1.0 + 1e-12), "{own:?}");
    assert!(least < 1.05 * (0.016 * size).powi(2), "{own:?}");
}
