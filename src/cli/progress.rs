//! Progress on a terminal, and Ctrl-C.

use super::error::{Error, failed};
use crate::study::Event;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A bar on standard error with trials, cells and failures; hidden where that is no terminal.
pub(super) struct Display {
    bar: ProgressBar,
    cells: usize,
    done: usize,
    failures: u64,
}

impl Display {
    pub(super) fn new(cells: usize) -> Self {
        let target = if std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(8)
        } else {
            ProgressDrawTarget::hidden()
        };
        let template = "[{bar:16}] {percent}% {rate}, ETA {eta}, {msg}";
        let style = ProgressStyle::with_template(template)
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key(
                "rate",
                |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                    // A bar that cannot write has nowhere to say so.
                    let _ = write!(to, "{:.0} trials/s", state.per_sec());
                },
            )
            .progress_chars("=> ");
        Self {
            bar: ProgressBar::with_draw_target(None, target).with_style(style),
            cells,
            done: 0,
            failures: 0,
        }
    }

    pub(super) fn show(&mut self, event: &Event) {
        match *event {
            Event::Planned { trials, done } => {
                self.done = 0;
                self.bar.set_length(trials);
                self.bar.set_position(done);
                self.bar.reset_eta();
            }
            Event::Block { trials, failures } => {
                self.failures += failures;
                self.bar.inc(trials);
            }
            Event::Cell => self.done += 1,
        }
        let (done, cells, failures) = (self.done, self.cells, self.failures);
        self.bar
            .set_message(format!("{done}/{cells} cells, {failures} failed"));
    }

    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// A flag that Ctrl-C (or SIGTERM) raises.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)).map_err(failed)?;
    Ok(flag)
}
