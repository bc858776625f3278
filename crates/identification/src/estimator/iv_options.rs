//! The options of instrumental variables in the paper's form and in the general one.

use super::covariance::Covariance;
use super::fixed_model::FixedModel;
use super::initial_state_choice::StartState;
use super::method_kind::options;
use super::other_tools::Reading;
use super::reflection::Stabilise;
use super::regression::Rows;
use super::{Solver, Stage10};
use crate::model::Orders;
use crate::names::named_enum;
use crate::observer::Gain;

named_enum! {
    /// The parts of the auxiliary model that each pass renews: reading E4.
    Auxiliary, "reading of the auxiliary model" {
        /// b and x0 follow each pass: stages 5 and 6 after every stage 10 (the default).
        Refresh = "refresh",
        /// Only A-hat is renewed. b and x0 of iteration 0 drive every simulation, and that x0 starts the observer. The
        /// reported b comes from each pass's h.
        Frozen = "frozen",
        /// As frozen, but the reported b is that of iteration 0.
        Literal = "literal",
    }
}

named_enum! {
    /// The auxiliary model: reading E12.
    Drive, "reading of stage 7" {
        /// The simulation of (A-hat, b-hat) from x0-hat (the default).
        Model = "model",
        /// The observer, driven by y: `F-hat = A-hat - g c'`.
        Observer = "observer",
    }
}

named_enum! {
    /// The signal from which the instruments are formed: claim C7.
    InstrumentSource, "source of the instruments" {
        /// The input u, both to drive the auxiliary model and in Z (the default).
        Input = "u",
        /// The reference r in both places, free of noise that came through the loop.
        Reference = "r",
    }
}

/// The largest number of IV passes.
pub const MOST_ITERATIONS: usize = 1000;

options! {
    /// The readings of the IV passes.
    pub struct IvOptions {
        /// Solver for the parameters: partitioned, lu, cholesky (ls only), qr, svd, dual, augmented.
        pub solver: Solver,
        /// Number of IV passes (reading E11: 4 or 5).
        pub iterations: usize = 4,
        /// Formula of stage 10, reading E2: corrected, as-printed, as-printed-2024.
        pub stage10: Stage10,
        /// The quantities that each IV pass renews, reading E4: refresh, frozen, literal.
        pub auxiliary: Auxiliary,
        /// The auxiliary model, reading E12: model (simulation of the estimate), observer.
        pub drive: Drive,
        /// The observer's gain, if the observer is the auxiliary model.
        pub gain: Gain,
        /// The signal from which the instruments are formed: u or r.
        pub instruments: InstrumentSource,
        /// The treatment of unstable poles of the auxiliary model: none, reflect (into the unit circle).
        pub stabilise: Stabilise,
        /// Initial state, in every pass: estimate (stage 6), or zero.
        pub initial_state: StartState,
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The equations that are used: complete (the default), prewindow (zeros before the record), padded (zeros
        /// before and after).
        pub rows: Option<Rows>,
        /// The conventions of another tool: r-sysid.
        pub reading: Option<Reading>,
        /// A fixed model x = B/F u for the instruments, such as B=0,1;F=1,-0.5: one pass.
        pub fixed_model: Option<FixedModel>,
        /// The equation errors that standard errors assume: white (the default), coloured (and independent of the
        /// instruments), robust.
        pub covariance: Option<Covariance>,
    }
}
