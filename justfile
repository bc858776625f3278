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
    cargo clippy --release --all-targets -- -D warnings

# All benchmarks.
bench *ARGS:
    cargo bench {{ARGS}}

# The README's table of solvers, from fresh benchmarks.
solver-table:
    cargo bench --bench kernels
    cargo run --release --example solver_table

# Rebuild the committed reference results and the report of them.
results:
    results/rebuild

# The documentation, in a browser.
doc:
    cargo doc --no-deps --open
