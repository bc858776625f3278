# Short names for the commands of the project; nothing needs `just` itself.

# List the recipes.
default:
    @just --list

# The paper's experiment: table, figures, trials under results/reproduce.
reproduce *ARGS:
    cargo run --release -- reproduce {{ARGS}}

# A study: just study window
study NAME *ARGS:
    cargo run --release -- run experiments/{{NAME}}.toml {{ARGS}}

# All tests.
test *ARGS:
    cargo test --release {{ARGS}}

# What CI runs.
ci:
    .ci/run

# Formatting and lints, warnings denied.
lint:
    cargo fmt --all --check
    cargo clippy --release --workspace --all-targets -- -D warnings

# All benchmarks.
bench *ARGS:
    cargo bench {{ARGS}}

# Keep the times of the lanes, the faer kernels and the trial under a name.
bench-save NAME FILTER="":
    cargo bench --bench lanes --bench kernels --bench trial -- --save-baseline {{NAME}} "{{FILTER}}"

# The same benches again, as ratios to a name.
bench-compare BASELINE="base" FILTER="":
    cargo bench --bench lanes --bench kernels --bench trial -- --baseline-lenient {{BASELINE}} "{{FILTER}}"
    cargo run --release --example bench_table {{BASELINE}}

# Where a trial's time goes in the lanes, stage by stage.
lane-stages *ISA:
    cargo run --release --example lane_stages {{ISA}}

# How fast W98 is beside NumPy, Numba, JAX and Octave; `just peers --setup` installs the Python ones.
peers *ARGS:
    cargo build --release
    benches/peers/compare.py {{ARGS}}

# The table of solvers in docs/methods.md, from fresh benchmarks.
solver-table:
    cargo bench --bench kernels
    cargo run --release --example solver_table

# The table of times of every estimator in docs/performance.md, from fresh benchmarks.
method-table:
    cargo bench --bench methods
    cargo run --release --example method_table

# Rebuild the committed reference results and the report of them.
results:
    results/rebuild

# The documentation, in a browser.
doc:
    cargo doc --no-deps --open
