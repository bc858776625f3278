//! The course of the first trial, for figures.

use serde::{Deserialize, Serialize};

/// x(t), xhat(t) and theta_hat(t) of one trial at several times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traces {
    /// Seconds, ascending.
    pub times: Vec<f64>,
    /// The course of every state x_i; NaN (null in files) if it is not finite.
    #[serde(with = "nan_is_null")]
    pub x: Vec<Vec<f64>>,
    /// theta = x(0) - xi(0), which GPEBO estimates.
    pub theta: Vec<f64>,
    /// Every observer.
    pub outputs: Vec<OutputTrace>,
}

/// The course of one observer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OutputTrace {
    /// The course of every state xhat_i.
    #[serde(with = "nan_is_null")]
    pub x_hat: Vec<Vec<f64>>,
    /// The course of the estimate of every component of theta; empty if the observer estimates none.
    #[serde(with = "nan_is_null")]
    pub theta_hat: Vec<Vec<f64>>,
}

impl Traces {
    /// Makes an empty course with one observer per entry of `estimates`, which says whether it estimates theta.
    pub(crate) fn new(theta: Vec<f64>, estimates: &[bool]) -> Self {
        let n = theta.len();
        let output = |estimates: &bool| OutputTrace {
            x_hat: vec![Vec::new(); n],
            theta_hat: vec![Vec::new(); if *estimates { n } else { 0 }],
        };
        Self {
            times: Vec::new(),
            x: vec![Vec::new(); n],
            theta,
            outputs: estimates.iter().map(output).collect(),
        }
    }
}

impl Traces {
    /// Whether the courses of n states and of all observers have the same length.
    pub(crate) fn are_of(&self, n: usize, observers: usize) -> bool {
        let full =
            |courses: &[Vec<f64>]| courses.len() == n && courses.iter().all(|course| course.len() == self.times.len());
        self.theta.len() == n
            && full(&self.x)
            && self.outputs.len() == observers
            && self
                .outputs
                .iter()
                .all(|of| full(&of.x_hat) && (of.theta_hat.is_empty() || full(&of.theta_hat)))
    }
}

/// Appends one number to each course.
pub(crate) fn append(to: &mut [Vec<f64>], values: &[f64]) {
    to.iter_mut().zip(values).for_each(|(to, value)| to.push(*value));
}

/// Serializes courses with gaps, because JSON has neither NaN nor infinities.
mod nan_is_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(courses: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        let gaps =
            |course: &Vec<f64>| -> Vec<Option<f64>> { course.iter().map(|x| x.is_finite().then_some(*x)).collect() };
        courses.iter().map(gaps).collect::<Vec<_>>().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
        let courses = Vec::<Vec<Option<f64>>>::deserialize(deserializer)?;
        let filled = |course: Vec<Option<f64>>| course.into_iter().map(|x| x.unwrap_or(f64::NAN));
        Ok(courses.into_iter().map(|course| filled(course).collect()).collect())
    }
}
