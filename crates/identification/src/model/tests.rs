//! The model against its difference equation, its realisation and the paper's form.

use super::*;
use crate::signal::{Purpose, stream};
use rand::Rng as _;

/// Returns samples that are uniform in [-1, 1).
fn signal(trial: u64, length: usize) -> Vec<f64> {
    let mut random = stream(16, trial, Purpose::Input);
    let mut draw = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
    (0..length).map(|_| draw()).collect()
}

/// Returns models with orders 0 to 3 of every polynomial and delays 0 to 3; the coefficients are small enough for
/// stability.
fn models() -> Vec<LinearModel> {
    let mut models = Vec::new();
    for trial in 0..256_u64 {
        let part = |shift: u64| (trial >> (2 * shift)) as usize % 4;
        let orders = Orders {
            na: part(0),
            nb: part(1) + 1,
            nc: part(2),
            nd: part(3),
            nf: part(0) ^ part(2),
            nk: part(1) ^ part(3),
        };
        let mut model = LinearModel::zero(orders);
        let theta = signal(trial, orders.parameters());
        let theta: Vec<f64> = theta.iter().map(|x| x / 3.5).collect();
        model.set_parameters(&theta);
        assert_eq!(model.orders(), orders);
        assert!(model.parameters().eq(theta));
        models.push(model);
    }
    models
}

fn close(found: &[f64], expected: &[f64]) {
    let largest = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-12 * largest, "{k}: {found} {expected}");
    }
}

/// From the realisation's output for u and e, the model's prediction errors recover e.
#[test]
fn a_realisation_and_its_model_undo_each_other() {
    const N: usize = 60;
    for (trial, model) in models().iter().enumerate() {
        let (u, e) = (signal(1000 + trial as u64, N), signal(2000 + trial as u64, N));
        let realisation = Realisation::new(model);
        let (mut y, mut found, mut scratch) = ([0.0; N], [0.0; N], [0.0; N]);
        realisation.simulate(&u, &e, &mut y);
        model.residuals(&u, &y, &mut found, &mut scratch);
        close(&found, &e);
        let mut simulated = [0.0; N];
        realisation.simulate(&u, &[0.0; N], &mut y);
        model.simulate(&u, &mut simulated);
        close(&simulated, &y);
    }
}

/// By hand: `y(k) = 0.5 y(k-1) + 2 u(k-2) + u(k-3)`.
#[test]
fn a_delay_is_a_delay() {
    let mut model = LinearModel::zero(Orders::arx(1, 2, 2));
    model.set_parameters(&[-0.5, 2.0, 1.0]);
    assert_eq!(model.b, [0.0, 0.0, 2.0, 1.0]);
    let mut y = [0.0; 5];
    model.simulate(&[1.0, 0.0, 0.0, 0.0, 0.0], &mut y);
    assert_eq!(y, [0.0, 0.0, 2.0, 2.0, 1.0]);
    assert_eq!(model.static_gain(), 6.0);
    assert_eq!(model.equation(None), "y(k) = 0.5 y(k-1) + 2 u(k-2) + u(k-3)");
    let plant = model.plant().unwrap();
    let (mut x, mut states, mut same) = ([0.0; 3], [0.0; 15], [0.0; 5]);
    plant.simulate(&mut x, &[1.0, 0.0, 0.0, 0.0, 0.0], &mut same, &mut states);
    assert_eq!(same, y);
}

/// The paper's form and back, to the bit; a model with a direct term has no such form.
#[test]
fn the_papers_form_and_back() {
    for model in models() {
        let Orders { na, nb, nk, .. } = model.orders();
        let plain = Orders::arx(na, nb, nk);
        let mut arx = LinearModel::zero(plain);
        let theta: Vec<f64> = model.parameters().take(na + nb).collect();
        arx.set_parameters(&theta);
        let Some(plant) = arx.plant() else {
            assert_eq!(nk, 0);
            continue;
        };
        let back = LinearModel::from(&plant);
        let padded = |polynomial: &[f64], length: usize| {
            let mut polynomial = polynomial.to_vec();
            polynomial.resize(length, 0.0);
            polynomial
        };
        assert_eq!(back.a, padded(&arx.a, back.a.len()));
        close(&back.b, &padded(&arx.b, back.b.len()));
        let realisation = Realisation::new(&arx);
        close(plant.b(), &realisation.b);
        assert_eq!(plant.a(), realisation.a);
    }
}

#[test]
fn equations_name_what_is_there() {
    let orders = "nb=1,nf=1,nc=1,nk=1".parse().unwrap();
    let mut model = LinearModel::zero(orders);
    model.set_parameters(&[2.0, -0.3, -0.123_456_789]);
    assert_eq!(
        model.equation(Some(6)),
        "y = B/F u + C e\nB = 2 q^-1\nC = 1 - 0.3 q^-1\nF = 1 - 0.123457 q^-1"
    );
}
