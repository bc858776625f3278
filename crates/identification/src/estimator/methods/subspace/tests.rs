//! Subspace methods on records without noise, and what they refuse.

use super::*;
use crate::estimator::{Progress, Shape};
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
    let poles: Vec<_> = (0..order)
        .map(|i| faer::c64::new(0.8 - 0.25 * i as f64, 0.0))
        .collect();
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
            assert_eq!(
                (pass.failure, pass.progress),
                (None, Progress::InitialState)
            );
            for (found, expected) in pass.model.parameters().zip(truth.parameters()) {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{order} {nk}: {found} {expected}"
                );
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
    let shape = Shape {
        order: 2,
        window: N,
    };
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
