//! The theoretical values that results are compared with, by name.

use asobench_identification::names::named_enum;

named_enum! {
    /// The theoretical value with which the results of an output are compared.
    TheoryReference, "reference of theory" {
        /// The theory of the output itself.
        Own = "theory",
        /// The Cramer-Rao bound if plant and noise share A.
        Shared = "bound:shared",
        /// The Cramer-Rao bound if the noise model has its own poles.
        Separate = "bound:separate",
    }
}

impl TheoryReference {
    /// Parses the name of a reference; `None` for the name of an output.
    pub fn named(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Returns its name in sentences.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Own => "its theory",
            Self::Shared => "the Cramer-Rao bound (shared)",
            Self::Separate => "the Cramer-Rao bound (separate)",
        }
    }
}
