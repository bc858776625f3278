//! The output of workers: its beginning and its end.

use crate::files::WORKERS_TITLE;
use std::collections::VecDeque;
use std::io::Read;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes kept from the beginning, and the same number from the end.
const KEPT: usize = 1 << 16;

#[derive(Default)]
struct Content {
    first: Vec<u8>,
    last: VecDeque<u8>,
    left_out: u64,
}

/// The output of workers, bounded in size and shared by the threads that read it.
#[derive(Clone, Default)]
pub struct Log(Arc<Mutex<Content>>);

impl Log {
    /// Adds output of a worker.
    pub fn add(&self, mut bytes: &[u8]) {
        let mut content = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let room = (KEPT - content.first.len()).min(bytes.len());
        let (first, rest) = bytes.split_at(room);
        content.first.extend_from_slice(first);
        bytes = rest;
        let skipped = bytes.len().saturating_sub(KEPT);
        content.last.extend(&bytes[skipped..]);
        let over = content.last.len().saturating_sub(KEPT);
        content.last.drain(..over);
        content.left_out += (skipped + over) as u64;
    }

    /// Adds a line that the program itself writes.
    pub fn note(&self, line: &str) {
        self.add(format!("[asobench] {line}\n").as_bytes());
    }

    /// Reads a stream to its end on a new thread. The returned channel closes at the end.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn drain(&self, mut from: impl Read + Send + 'static) -> std::io::Result<Receiver<()>> {
        let (end, ended) = channel();
        let log = self.clone();
        std::thread::Builder::new().spawn(move || {
            let mut room = vec![0; 1 << 16];
            while let Ok(read @ 1..) = from.read(&mut room) {
                log.add(&room[..read]);
            }
            drop(end);
        })?;
        Ok(ended)
    }

    /// All output that is kept; `None` if nothing was printed.
    pub fn text(&self) -> Option<Vec<u8>> {
        let content = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if content.first.is_empty() {
            return None;
        }
        let mut text = [WORKERS_TITLE.as_bytes(), &content.first].concat();
        if content.left_out > 0 {
            let line = format!("\n[asobench] {} bytes omitted here\n", content.left_out);
            text.extend_from_slice(line.as_bytes());
        }
        text.extend(&content.last);
        Some(text)
    }

    /// Number of bytes added so far.
    pub fn length(&self) -> u64 {
        let content = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (content.first.len() + content.last.len()) as u64 + content.left_out
    }

    /// Returns the last lines printed since the log had `since` bytes, for example the message of a crash.
    pub fn last_lines(&self, since: u64, most: usize) -> Vec<String> {
        let (new, text) = (self.length() - since, self.text().unwrap_or_default());
        let from = text.len().saturating_sub(new as usize).max(WORKERS_TITLE.len());
        let text = String::from_utf8_lossy(text.get(from..).unwrap_or_default());
        let printed = |line: &&str| !line.trim().is_empty() && !line.starts_with("[asobench]");
        let lines = text.lines().filter(printed);
        let mut lines: Vec<String> = lines.map(|line| line.chars().take(200).collect()).collect();
        lines.split_off(lines.len().saturating_sub(most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beginning_and_the_end_are_kept() {
        let log = Log::default();
        assert_eq!(log.text(), None);
        log.add(b"first\n");
        for _ in 0..100 {
            log.add(&[b'x'; 10_000]);
        }
        log.add(b"\nlast\n");
        let text = String::from_utf8(log.text().unwrap()).unwrap();
        assert!(text.len() < 3 * KEPT);
        assert!(text.starts_with(&format!("{WORKERS_TITLE}first\nx")) && text.ends_with("x\nlast\n"));
        let left_out = 6 + 1_000_000 + 6 - 2 * KEPT;
        assert!(text.contains(&format!("{left_out} bytes omitted")));
        assert_eq!(log.last_lines(0, 1), ["last"]);
        assert_eq!(Log::default().last_lines(0, 1), [""; 0]);
        let length = log.length();
        assert_eq!(length, 6 + 1_000_000 + 6);
        log.add(b"one\ntwo\n");
        assert_eq!(log.last_lines(length, 10), ["one", "two"]);
    }
}
