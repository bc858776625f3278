//! From what this was built.

/// The git revision that this was built from, if it was built in a checkout.
pub const GIT_REVISION: Option<&str> = option_env!("ASOBENCH_GIT_REVISION");
