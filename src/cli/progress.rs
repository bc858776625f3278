//! Progress, as a bar on a terminal or otherwise a line a minute, and Ctrl-C.

use super::error::{Error, failed};
use super::exit_code::INTERRUPTED;
use super::output::note;
use crate::study::{Event, Spent};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// The time between two lines if standard error is not a terminal. A shorter run prints none.
const BETWEEN_LINES: Duration = Duration::from_mins(1);

/// The time of the last line; `None` on a terminal, where a bar is shown instead.
struct Pace(Option<Instant>);

impl Pace {
    fn new() -> Self {
        Self((!std::io::stderr().is_terminal()).then(Instant::now))
    }

    /// Whether a line is to be printed now.
    fn is_due(&mut self, now: Instant) -> bool {
        let is_due = self.0.is_some_and(|last| now.duration_since(last) >= BETWEEN_LINES);
        if is_due {
            self.0 = Some(now);
        }
        is_due
    }
}

/// A bar on standard error with trials, cells and failures; a line a minute if that is not a terminal.
pub(super) struct Display {
    bar: ProgressBar,
    pace: Pace,
    cells: usize,
    done: usize,
    failures: u64,
    begin: Instant,
    /// Trials that were computed, and where the time went.
    trials: u64,
    spent: Spent,
}

impl Display {
    pub(super) fn new(cells: usize) -> Self {
        let pace = Pace::new();
        let target = match pace.0 {
            None => ProgressDrawTarget::stderr_with_hz(8),
            Some(_) => ProgressDrawTarget::hidden(),
        };
        let template = "[{bar:16}] {percent}% {rate}, ETA {eta}, {msg}";
        let style = ProgressStyle::with_template(template)
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key("rate", |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                // A bar that cannot write has no place to report it.
                let _ = write!(to, "{:.0} trials/s", state.per_sec());
            })
            .progress_chars("=> ");
        Self {
            bar: ProgressBar::with_draw_target(None, target).with_style(style),
            pace,
            cells,
            done: 0,
            failures: 0,
            begin: Instant::now(),
            trials: 0,
            spent: Spent::default(),
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
            Event::Block {
                trials,
                failures,
                spent,
            } => {
                self.failures += failures;
                self.spent += spent;
                self.trials += trials;
                self.bar.inc(trials);
            }
            Event::Cell => self.done += 1,
            Event::Concluded(spent) => self.spent += spent,
        }
        let (done, cells, failures) = (self.done, self.cells, self.failures);
        self.bar.set_message(format!("{done}/{cells} cells, {failures} failed"));
        if let Some(line) = self.line(Instant::now()) {
            note(&line);
        }
    }

    /// Returns the line that is due, if any.
    fn line(&mut self, now: Instant) -> Option<String> {
        if !self.pace.is_due(now) {
            return None;
        }
        let (done, total) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let percent = 100 * u128::from(done) / u128::from(total.max(1));
        Some(format!(
            "{percent}%, {done} of {total} trials, {}/{} cells, {} failed",
            self.done, self.cells, self.failures
        ))
    }

    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Returns trials per second until now, and where the time went; `None` if no trial was computed.
    pub(super) fn speed(&self) -> Option<String> {
        let seconds = self.begin.elapsed().as_secs_f64();
        let rate = self.trials as f64 / seconds;
        (self.trials > 0).then(|| format!("{} trials/s: {}", rounded(rate), shares(&self.spent)))
    }
}

/// Formats a rate with three digits.
pub(super) fn rounded(rate: f64) -> String {
    let unit = 10.0_f64.powf(rate.max(1.0).log10().floor() - 2.0);
    if unit >= 1.0 {
        format!("{:.0}", (rate / unit).round() * unit)
    } else {
        format!("{rate:.1}")
    }
}

/// Returns where the threads' time went, each part in per cent. Parts of zero are omitted.
pub(super) fn shares(spent: &Spent) -> String {
    let total = spent.total().as_secs_f64();
    let parts = spent.parts().into_iter();
    let parts = parts.filter(|(_, part)| !part.is_zero());
    let shares = parts.map(|(name, part)| format!("{name} {:.0} %", 100.0 * part.as_secs_f64() / total));
    shares.collect::<Vec<String>>().join(", ")
}

/// The steps of work without trials to count. On a terminal a line shows the current step and the elapsed time.
/// Otherwise a step prints a line if it begins at least a minute after the last line.
pub(super) struct Steps {
    bar: ProgressBar,
    pace: Pace,
}

impl Steps {
    pub(super) fn new() -> Self {
        let pace = Pace::new();
        let bar = match pace.0 {
            None => ProgressBar::new_spinner(),
            Some(_) => ProgressBar::hidden(),
        };
        let style = ProgressStyle::with_template("{spinner} {msg}, {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, pace }
    }

    pub(super) fn show(&mut self, step: &str) {
        self.bar.set_message(step.to_owned());
        if self.pace.is_due(Instant::now()) {
            note(step);
        }
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Shows a line while the bar is shown, which draws itself again below it.
pub(super) fn warn(line: &str) {
    if std::io::stderr().is_terminal() {
        eprint!("\r\x1b[2K");
    }
    note(line);
}

/// The time in which a step may come to its end after Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(800);

/// The exit code of a program that is ended in the middle of a step.
static EXIT: AtomicI32 = AtomicI32::new(INTERRUPTED as i32);

/// Sets the exit code of a program that is ended in the middle of a step.
pub(super) fn exit_with(code: u8) {
    EXIT.store(code.into(), Ordering::Relaxed);
}

/// Returns a flag that Ctrl-C (or SIGTERM) raises. A step that lasts a moment longer is ended, and a second signal
/// ends the program at once. Files are first written whole under other names, so no file is left half-written. All
/// studies of a program share the flag.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Error> {
    static SHARED: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    if let Some(flag) = SHARED.get() {
        return Ok(Arc::clone(flag));
    }
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    let handler = move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED.into());
        }
        // The step under way may be one long trial, or a large file.
        let waits = std::thread::Builder::new().spawn(|| {
            std::thread::sleep(PATIENCE);
            note("asobench: interrupted in the middle of a step; all that was finished before is stored");
            std::process::exit(EXIT.load(Ordering::Relaxed));
        });
        if waits.is_err() {
            std::process::exit(EXIT.load(Ordering::Relaxed));
        }
    };
    ctrlc::set_handler(handler).map_err(failed)?;
    Ok(Arc::clone(SHARED.get_or_init(|| flag)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_a_minute_and_none_in_the_first() {
        let mut display = Display::new(3);
        let begin = Instant::now();
        display.pace = Pace(Some(begin));
        let planned = Event::Planned { trials: 300, done: 100 };
        let block = Event::Block {
            trials: 20,
            failures: 2,
            spent: Spent::default(),
        };
        for event in [planned, Event::Cell, block] {
            display.show(&event);
        }
        let mut at = |seconds| display.line(begin + Duration::from_secs(seconds));
        assert_eq!(at(59), None);
        let line = "40%, 120 of 300 trials, 1/3 cells, 2 failed";
        assert_eq!(at(61), Some(line.to_owned()));
        assert_eq!(at(120), None);
        assert!(at(121).is_some());
        display.pace = Pace(None);
        assert_eq!(display.line(begin + 10 * BETWEEN_LINES), None);
    }
}
