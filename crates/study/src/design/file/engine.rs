//! The engines that compute trials, by name.

use asobench_identification::names::named_enum;

named_enum! {
    /// The engine that computes the trials.
    Engine, "engine" {
        /// The lanes in every cell that they cover, faer in the others (the default).
        Auto = "auto",
        /// Trials in lock step, one per SIMD lane; the same bits on every machine.
        Lanes = "lanes",
        /// One trial after the other; the same bits on machines with the same vector instructions.
        Faer = "faer",
    }
}
