//! asobench
pub mod cli;
pub mod data;
pub mod estimator;
pub mod metric;
mod names;

pub mod observer;
pub mod plant;
pub mod report;
pub mod signal;
pub mod study;
