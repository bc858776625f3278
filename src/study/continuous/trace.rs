//! The course of the first trial, for figures.

use serde::{Deserialize, Serialize};

/// x(t), xhat(t) and theta_hat(t) of one trial at some times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traces {
    /// Seconds, ascending.
    pub times: Vec<f64>,
    /// For every state x_i its course.
    pub x: Vec<Vec<f64>>,
    /// theta = x(0) - xi(0), which GPEBO estimates.
    pub theta: Vec<f64>,
    /// Every observer.
    pub outputs: Vec<OutputTrace>,
}

/// What one observer makes of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OutputTrace {
    /// For every state xhat_i its course.
    pub x_hat: Vec<Vec<f64>>,
    /// For every component of theta its estimate's course; empty where the observer estimates none.
    pub theta_hat: Vec<Vec<f64>>,
}

impl Traces {
    /// An empty course of `observers` observers, each with a theta where `estimates` says so.
    pub(super) fn new(theta: Vec<f64>, estimates: &[bool]) -> Self {
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

/// Appends one number to each course.
pub(super) fn append(to: &mut [Vec<f64>], values: &[f64]) {
    to.iter_mut()
        .zip(values)
        .for_each(|(to, value)| to.push(*value));
}
