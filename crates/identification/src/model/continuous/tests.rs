use super::*;

/// B and A, the step, the hold, and B and F of the sampled model.
type Case<'a> = ([&'a [f64]; 2], f64, Hold, [&'a [f64]; 2]);

/// The sampled model of plants of the literature, by scipy 1.15, `signal.cont2discrete`, to ten digits.
#[test]
fn sampled_as_scipy_does() {
    let cases: [Case; 4] = [
        // Rao and Garnier.
        (
            [&[-6400.0, 1600.0], &[1.0, 5.0, 408.0, 416.0, 1600.0]],
            0.01,
            Hold::Zero,
            [
                &[0.0, -0.001050664697, -0.003086271238, 0.003126493338, 0.001025996194],
                &[1.0, -3.911361243, 5.774371922, -3.81422455, 0.9512294245],
            ],
        ),
        // Five poles, one pair at the border of stability (Ninness, Wills and Mills).
        (
            [
                &[0.00200005],
                &[1.0, 1.602, 0.693201, 0.1153016, 0.02610065, 0.00200005],
            ],
            1.0,
            Hold::Zero,
            [
                &[
                    0.0,
                    1.287119873e-05,
                    0.0002608035156,
                    0.0005112948364,
                    0.0001532856877,
                    4.42735642e-06,
                ],
                &[1.0, -3.837421521, 5.782708514, -4.240805157, 1.497953975, -0.2014931285],
            ],
        ),
        // Two time constants, 200 s and 10 s.
        (
            [&[0.1, 0.001], &[1.0, 0.105, 0.0005]],
            2.0,
            Hold::Zero,
            [&[0.0, 0.1822026195, -0.1785953012], &[1.0, -1.808780587, 0.810584246]],
        ),
        // A double pole, straight lines (Thil, Garnier and Gilson).
        (
            [&[1.0, -1.0], &[1.0, 2.0, 1.0]],
            0.1,
            Hold::First,
            [
                &[0.04520262285, -0.009052899445, -0.04520564041],
                &[1.0, -1.809674836, 0.8187307531],
            ],
        ),
    ];
    for ([numerator, denominator], step, hold, [b, f]) in cases {
        let model = ContinuousModel {
            numerator: numerator.to_vec(),
            denominator: denominator.to_vec(),
            step,
            hold,
            ..ContinuousModel::default()
        };
        let n = denominator.len() - 1;
        let orders = ContinuousModel::sampled_orders(numerator.len(), n, hold, 0.0);
        let mut sampled = LinearModel::zero(orders);
        model.sample(&mut sampled);
        for (found, expected) in [(&sampled.b, b), (&sampled.f, f)] {
            assert_eq!(found.len(), expected.len());
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 6e-10 * largest, "{found} {expected}");
            }
        }
    }
}

/// The derivatives against differences, with a dead time, a direct term and both holds.
#[test]
fn derivatives_against_differences() {
    let numerators = [&[1.5, -0.4][..], &[0.7, 2.0, -3.0, 1.0]];
    let cases = numerators.into_iter().flat_map(|numerator| {
        let holds = [Hold::Zero, Hold::First].into_iter();
        holds.flat_map(move |hold| [2.0, 2.3].map(|dead_time| (numerator, hold, dead_time)))
    });
    for (numerator, hold, dead_time) in cases {
        let model = ContinuousModel {
            numerator: numerator.to_vec(),
            denominator: vec![1.0, 2.2, 3.1, 1.4],
            step: 0.3,
            hold,
            dead_time,
            ..ContinuousModel::default()
        };
        let orders = ContinuousModel::sampled_orders(numerator.len(), 3, hold, dead_time);
        let mut sampled = LinearModel::zero(orders);
        let jacobian = model.sample(&mut sampled);
        let count = numerator.len() + 3 + usize::from(dead_time != 2.0);
        assert_eq!(jacobian.len(), count * orders.parameters());
        for i in 0..count {
            let beside = |h: f64| {
                let mut model = model.clone();
                let own = model.numerator.len();
                match i.checked_sub(own) {
                    None => model.numerator[i] += h,
                    Some(3) => model.dead_time += h / model.step,
                    Some(i) => model.denominator[1 + i] += h,
                }
                let mut sampled = LinearModel::zero(orders);
                model.sample(&mut sampled);
                sampled.parameters().collect::<Vec<f64>>()
            };
            let (low, high) = (beside(-1e-5), beside(1e-5));
            for (row, (low, high)) in low.iter().zip(&high).enumerate() {
                let difference = (high - low) / 2e-5;
                let derivative = jacobian[row * count + i];
                assert!(
                    (derivative - difference).abs() < 1e-9 * (1.0 + derivative.abs()),
                    "{derivative} {difference}"
                );
            }
        }
    }
}
