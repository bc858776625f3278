//! Progress on a terminal, and Ctrl-C.

use super::error::{Error, failed};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A bar on standard error; hidden where that is no terminal.
pub(super) fn bar(trials: u64) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr_with_hz(8)
    } else {
        ProgressDrawTarget::hidden()
    };
    let template = "[{bar:32}] {pos}/{len} trials, {rate}, ETA {eta}";
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key(
            "rate",
            |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                // A bar that cannot write has nowhere to say so.
                let _ = write!(to, "{:.0}/s", state.per_sec());
            },
        )
        .progress_chars("=> ");
    ProgressBar::with_draw_target(Some(trials), target).with_style(style)
}

/// A flag that Ctrl-C (or SIGTERM) raises.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)).map_err(failed)?;
    Ok(flag)
}
