//! The cascade against independent integration, closed forms and invariances, through the public interface.

mod common;
mod delays;
mod example;
mod family;
mod invariance;
mod kalman_bucy;
mod linear;
mod measures;
mod outcomes;
mod packs;
mod rounding;
mod step_error;
mod units;
