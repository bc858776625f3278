//! Quantiles of the errors of an output over `[course]`.

use crate::design::{Cell, Experiment};
use crate::outcome::curves::CurveQuantiles;
use asobench_identification::metric::{Quantile, Sample, Worse};
use serde::{Deserialize, Serialize};

/// The errors of an output at the points of `[course]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CourseSummary {
    /// The numbers of samples k.
    pub k: Vec<usize>,
    /// e_a(k).
    pub e_a: CourseQuantiles,
    /// e_b(k).
    pub e_b: CourseQuantiles,
    /// e_x(k).
    pub e_x: CourseQuantiles,
}

/// Quantiles of one error at every point, trials without it ranked last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CourseQuantiles {
    /// The quantiles.
    #[serde(flatten)]
    pub quantiles: CurveQuantiles,
    /// The share of trials without it: no model yet, none any more, or one whose state overflows.
    pub without: Vec<f64>,
}

impl CourseSummary {
    /// Summarises the columns of an output; `None` if there are none.
    pub(crate) fn new(experiment: &Experiment, cell: &Cell, columns: &[Sample]) -> Option<Self> {
        let window = cell.discrete()?.window;
        let points = experiment.file.course.as_ref()?.points(window);
        let mut all = columns.chunks_exact(points.len().max(1)).map(of_error);
        Some(Self {
            k: points.to_vec(),
            e_a: all.next()?,
            e_b: all.next()?,
            e_x: all.next()?,
        })
    }
}

fn of_error(columns: &[Sample]) -> CourseQuantiles {
    let (mut q05, mut q50, mut q95) = (Vec::new(), Vec::new(), Vec::new());
    let mut without = Vec::new();
    for column in columns {
        let statistics = column.statistics(Worse::Larger);
        let value = |quantile: Quantile| Some(quantile.value).filter(|value| value.is_finite());
        q05.push(value(statistics.q05));
        q50.push(value(statistics.q50));
        q95.push(value(statistics.q95));
        let trials = statistics.count + statistics.undefined;
        without.push(statistics.undefined as f64 / trials.max(1) as f64);
    }
    CourseQuantiles {
        quantiles: CurveQuantiles { q05, q50, q95 },
        without,
    }
}
