//! The workload for timing and counting instructions: one cell, the same in every version.

/// W98: order 6, N = 98, K = 400, signs of amplitude 10, noise 1/A at eta = 10.018 %, least squares and four IV passes,
/// dead-beat observer; three measures.
pub const W98: &str = r#"
seed = 1
measures = ["e_a", "e_b", "e_x_max"]
[settings]
eta = 10.018
window = 98
horizon = 400
[[methods]]
estimator = "iv"
iterations = 4
report = [4]
"#;
