//! The kernels against faer's solvers and against exact solutions.

mod initial_state;
mod radius;
mod response;
mod solve;

use super::Isa;
use asobench_identification::estimator::Window;
use asobench_identification::plant::random_stable;
use asobench_identification::real::{MOST_LANES, Real};
use asobench_identification::signal::{Purpose, normal::fill_standard_normal, stream};

/// Half an ulp of 1, the bound on a rounding.
const UNIT: f64 = f64::EPSILON / 2.0;

/// Returns this machine's widths among those that `ASOBENCH_LANES` lists (all if it is not set). Valgrind has no
/// AVX-512.
pub(super) fn tested() -> Vec<Isa> {
    let asked = std::env::var("ASOBENCH_LANES").ok();
    let asked = |isa: &Isa| match &asked {
        None => true,
        Some(list) => list.split(',').any(|name| name == isa.name()),
    };
    let all = Isa::ALL.iter().copied();
    let tested: Vec<Isa> = all.filter(|isa| isa.is_here() && asked(isa)).collect();
    assert!(!tested.is_empty());
    tested
}

/// A record of a random plant: u, y with noise, and instruments yhat without.
struct Record {
    u: Vec<f64>,
    y: Vec<f64>,
    yhat: Vec<f64>,
}

impl Record {
    fn new(order: usize, trial: u64, samples: usize, noise: f64) -> Self {
        let plant = random_stable(order, 0.8, &mut stream(4, trial, Purpose::Plant));
        let mut u = vec![0.0; samples];
        fill_standard_normal(&mut stream(4, trial, Purpose::Input), &mut u);
        let (mut yhat, mut states) = (vec![0.0; samples], vec![0.0; samples * order]);
        plant.simulate(&mut vec![1.0; order], &u, &mut yhat, &mut states);
        let mut f = vec![0.0; samples];
        fill_standard_normal(&mut stream(4, trial, Purpose::NoiseDrive), &mut f);
        let y = yhat.iter().zip(&f).map(|(y, f)| y + noise * f).collect();
        Self { u, y, yhat }
    }

    fn window(&self) -> Window<'_> {
        Window::new(&self.u, &self.y, self.u.len())
    }
}

/// Returns the records' samples as packs, one record per lane.
fn packed<R: Real>(records: &[Record], part: impl Fn(&Record) -> &[f64]) -> Vec<R> {
    let sample = |k: usize| R::load(&std::array::from_fn::<f64, MOST_LANES, _>(|l| part(&records[l])[k]));
    (0..part(&records[0]).len()).map(sample).collect()
}
