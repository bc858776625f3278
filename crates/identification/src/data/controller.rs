//! User-defined controllers, such as an adaptive state feedback.

use super::{DrawFailure, Truth};
use std::sync::Arc;

/// The samples that a controller knows when it must return u(k), from the trial's first one on, including the open-loop
/// part.
#[derive(Clone, Copy, Debug)]
pub struct History<'a> {
    /// The reference r(0) ... r(k).
    pub r: &'a [f64],
    /// The measured input u(0) ... u(k-1).
    pub u: &'a [f64],
    /// The measured output y(0) ... y(k).
    pub y: &'a [f64],
}

impl History<'_> {
    /// Returns the present k.
    pub const fn k(&self) -> usize {
        self.u.len()
    }
}

/// A controller in the loop. It owns its buffers; each worker has its own controller.
pub trait Controller: Send {
    /// Forgets the previous trial. An ideal controller may use the truth of the next one, whose x0 is the state at the
    /// trial's first sample.
    fn reset(&mut self, truth: &Truth);

    /// Returns the input u(k) that will drive the plant. Called once for every k from [`ControlLaw::pilot`] on, in
    /// order.
    ///
    /// # Errors
    /// [`DrawFailure`] if there is no input; the trial then has no record.
    fn control(&mut self, history: History<'_>) -> Result<f64, DrawFailure>;

    /// Returns the estimate of the state, n numbers, from which the last input was made; empty if there is none.
    fn estimate(&self) -> &[f64] {
        &[]
    }
}

/// Makes controllers.
type Factory = dyn Fn() -> Box<dyn Controller> + Send + Sync;

/// How workers make their own controller, when it starts and how it is described.
#[derive(Clone)]
pub struct ControlLaw {
    pilot: usize,
    silent: bool,
    description: String,
    factory: Arc<Factory>,
}

impl ControlLaw {
    /// Makes a law. The loop is open (u = r) for the first `pilot` samples, which precede the record. `description`
    /// goes into the manifest.
    pub fn new(
        pilot: usize,
        description: impl std::fmt::Display,
        factory: impl Fn() -> Box<dyn Controller> + Send + Sync + 'static,
    ) -> Self {
        Self {
            pilot,
            silent: false,
            description: description.to_string(),
            factory: Arc::new(factory),
        }
    }

    /// Sets r = 0 once the loop is closed.
    #[must_use]
    pub fn without_reference(mut self) -> Self {
        self.silent = true;
        self
    }

    /// Returns whether r = 0 once the loop is closed.
    pub const fn is_silent(&self) -> bool {
        self.silent
    }

    /// Returns the number of samples in open loop, N1.
    pub const fn pilot(&self) -> usize {
        self.pilot
    }

    /// Returns every setting, for a manifest: what JSON the description is, or its text.
    #[cfg(feature = "json")]
    pub fn description(&self) -> serde_json::Value {
        serde_json::from_str(&self.description).unwrap_or_else(|_| self.description.as_str().into())
    }
}

impl std::fmt::Debug for ControlLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ControlLaw")
            .field("pilot", &self.pilot)
            .field("silent", &self.silent)
            .field("description", &self.description)
            .finish_non_exhaustive()
    }
}

/// A controller kept from trial to trial, with the law that made it. A copy starts without one.
#[derive(Default)]
pub(super) struct Kept(Option<(Arc<Factory>, Box<dyn Controller>)>);

impl Kept {
    /// Returns the law's controller, reset. It is made anew if the kept one belongs to another law.
    pub(super) fn for_law(&mut self, law: &ControlLaw, truth: &Truth) -> &mut dyn Controller {
        if !matches!(&self.0, Some((factory, _)) if Arc::ptr_eq(factory, &law.factory)) {
            self.0 = None;
        }
        let made = || (Arc::clone(&law.factory), (law.factory)());
        let (_, controller) = self.0.get_or_insert_with(made);
        controller.reset(truth);
        &mut **controller
    }
}

impl Clone for Kept {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.0.is_some() { "Kept(..)" } else { "None" })
    }
}
