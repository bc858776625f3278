//! One process of a worker. It is killed with everything that it started.

use super::fault::Fault;
use super::guard::{Guard, kill_all};
use super::log::Log;
use super::message::Incoming;
use crate::files::{Mark, Pipes};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, WaitId, WaitIdOptions, WaitIdStatus, waitid};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Time between two checks whether the process still runs and whether to stop.
const LOOK: Duration = Duration::from_millis(50);
/// Time between two attempts to open the pipe of a starting process.
const KNOCK: Duration = Duration::from_millis(2);
/// Time for a process to end by itself after its requests were closed.
const GRACE: Duration = Duration::from_secs(2);
/// Time to read the rest of what a killed process printed.
const SETTLE: Duration = Duration::from_millis(200);

/// Environment variables that set the number of threads for linear algebra: OpenMP, OpenBLAS and MKL.
const THREADS: [&str; 3] = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"];

/// Environment variables by which the GNU C library keeps freed memory, with bytes. By default it returns large arrays
/// to the system after each message and fetches them page by page for the next one, which takes longer than estimating.
const MEMORY: [(&str, &str); 2] = [
    ("MALLOC_MMAP_THRESHOLD_", "33554432"),
    ("MALLOC_TRIM_THRESHOLD_", "268435456"),
];

/// A process of a worker, and leader of its process group.
pub struct Process {
    child: Child,
    group: Pid,
    guard: Option<Arc<Guard>>,
    /// Identifies its descendants.
    mark: Mark,
    /// Each channel closes when all that the process printed on one pipe has been read.
    printed: Vec<Receiver<()>>,
    pipes: Option<Pipes>,
    requests: Option<File>,
    replies: File,
    incoming: Incoming,
    /// Buffer for one read.
    room: Vec<u8>,
}

impl Process {
    /// Starts a process, which has not opened its pipes yet.
    ///
    /// # Errors
    /// The reason why it cannot be started.
    pub fn start(command: &[String], folder: &Path, guard: Option<Arc<Guard>>, log: &Log) -> Result<Self, String> {
        let pipes = Pipes::new().map_err(|error| error.to_string())?;
        let replies = pipes.open_replies().map_err(|error| error.to_string())?;
        let (program, arguments) = command.split_first().ok_or("an empty command")?;
        let mut command = Command::new(program);
        command
            .args(arguments)
            .current_dir(folder)
            .env("ASOBENCH_REQUESTS", pipes.requests())
            .env("ASOBENCH_REPLIES", pipes.replies())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        // Each thread of the run has its own process. With more threads per process, they would only wait for each
        // other.
        let threads = THREADS.map(|name| (name, "1"));
        for (name, value) in threads.into_iter().chain(MEMORY) {
            if std::env::var_os(name).is_none() {
                command.env(name, value);
            }
        }
        let before = pipes.mark(&[] as &[BorrowedFd<'_>]);
        if let Some(guard) = &guard {
            guard.watch(None, &before);
        }
        let started = command.spawn().inspect_err(|_| {
            if let Some(guard) = &guard {
                guard.forget(&before);
            }
        });
        let mut child = started.map_err(|error| format!("cannot start '{program}': {error}"))?;
        let group = Pid::from_child(&child);
        let (out, err) = (child.stdout.take(), child.stderr.take());
        let ends = [out.as_ref().map(AsFd::as_fd), err.as_ref().map(AsFd::as_fd)];
        let mark = pipes.mark(&ends.into_iter().flatten().collect::<Vec<_>>());
        if let Some(guard) = &guard {
            guard.watch(Some(group), &mark);
        }
        let mut process = Self {
            child,
            group,
            guard,
            mark,
            printed: Vec::new(),
            pipes: Some(pipes),
            requests: None,
            replies,
            incoming: Incoming::default(),
            room: vec![0; Incoming::ROOM],
        };
        // A process whose output nobody reads is killed when it is dropped.
        let no_thread = |error: std::io::Error| format!("cannot start a thread: {error}");
        if let Some(out) = out {
            process.printed.push(log.drain(out).map_err(no_thread)?);
        }
        if let Some(err) = err {
            process.printed.push(log.drain(err).map_err(no_thread)?);
        }
        Ok(process)
    }

    /// Whether nothing arrived that was not asked for.
    pub fn is_clean(&mut self) -> bool {
        // This includes bytes after an answer, bytes since then, and the end of the pipe.
        self.read().is_none() && self.incoming.is_empty()
    }

    /// Sends a message and waits for the answer, which `take` takes of the bytes once it is complete.
    ///
    /// # Errors
    /// [`Fault`]: the process must then be killed.
    pub fn ask<T>(
        &mut self,
        message: &[u8],
        take: impl Fn(&mut Incoming) -> Result<Option<T>, String>,
        time: Duration,
        stop: &AtomicBool,
    ) -> Result<T, Fault> {
        let end = Instant::now() + time;
        let mut sent = 0;
        let mut is_gone = false;
        loop {
            let taken = take(&mut self.incoming).map_err(Fault::Malformed)?;
            match taken {
                Some(answer) if sent == message.len() => {
                    // A process that answers has opened both pipes.
                    self.pipes = None;
                    return Ok(answer);
                }
                Some(_) => {
                    let early = "an answer before the message was read to its end";
                    return Err(Fault::Malformed(early.to_owned()));
                }
                None if is_gone => return Err(self.crash()),
                None => {}
            }
            if stop.load(Ordering::Relaxed) {
                return Err(Fault::Stopped);
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(Fault::Timeout(self.came(sent, message.len())));
            }
            let is_there = self.wait(sent < message.len(), left)?;
            sent += self.write(&message[sent..])?;
            let is_closed = is_there && self.read() == Some(0);
            if is_closed || !is_there && self.has_ended() {
                while self.read().is_some_and(|read| read > 0) {}
                is_gone = true;
            }
        }
    }

    /// Describes how much of the answer to a message has arrived.
    fn came(&self, sent: usize, message: usize) -> String {
        if self.requests.is_none() {
            "it has not opened the pipe ASOBENCH_REQUESTS".to_owned()
        } else if sent < message {
            format!("it has not read all {message} bytes of the message")
        } else {
            self.incoming.came()
        }
    }

    /// Waits until something can be written or read, at most for [`LOOK`]. Returns true if replies can be read or have
    /// ended.
    fn wait(&mut self, writes: bool, left: Duration) -> Result<bool, Fault> {
        if self.requests.is_none() {
            let opened = self.pipes.as_ref().map(Pipes::open_requests);
            match opened {
                Some(Ok(Some(requests))) => self.requests = Some(requests),
                Some(Ok(None)) => {
                    std::thread::sleep(KNOCK.min(left));
                    return Ok(false);
                }
                _ => return Err(self.crash()),
            }
        }
        let mut watched = vec![PollFd::new(&self.replies, PollFlags::IN)];
        if let Some(requests) = self.requests.as_ref().filter(|_| writes) {
            watched.push(PollFd::new(requests, PollFlags::OUT));
        }
        let time = LOOK.min(left);
        let time = Timespec {
            tv_sec: 0,
            tv_nsec: time.subsec_nanos().into(),
        };
        let ready = poll(&mut watched, Some(&time)).unwrap_or(0);
        // No end is reported before the other side was opened once.
        Ok(ready > 0 && !watched[0].revents().is_empty())
    }

    /// Writes as much as the pipe accepts.
    fn write(&mut self, message: &[u8]) -> Result<usize, Fault> {
        let Some(requests) = self.requests.as_mut().filter(|_| !message.is_empty()) else {
            return Ok(0);
        };
        match requests.write(message) {
            Ok(written) => Ok(written),
            Err(error) if is_later(&error) => Ok(0),
            Err(_) => Err(self.crash()),
        }
    }

    /// Reads what is available: `Some(0)` if the other end was closed, `None` if nothing is available.
    fn read(&mut self) -> Option<usize> {
        match self.replies.read(&mut self.room) {
            Ok(read) => {
                self.incoming.add(&self.room[..read]);
                Some(read)
            }
            Err(error) if is_later(&error) => None,
            Err(_) => Some(0),
        }
    }

    /// Whether the process has ended; its exit status is left to be collected.
    fn has_ended(&self) -> bool {
        !matches!(self.look(), Ok(None))
    }

    fn look(&self) -> rustix::io::Result<Option<WaitIdStatus>> {
        let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(self.group), look)
    }

    /// How it ended, or that it closed a pipe. A process that ends closes its pipes a moment before.
    fn crash(&self) -> Fault {
        let begin = Instant::now();
        while !self.has_ended() && begin.elapsed() < LOOK {
            std::thread::sleep(KNOCK);
        }
        let status = self.look().ok().flatten();
        let ended = status.and_then(|status| {
            let exited = status.exit_status();
            let killed = status.terminating_signal();
            let exited = exited.map(|code| format!("the process ended with exit status {code}"));
            exited.or_else(|| Some(format!("the process was ended by signal {}", killed?)))
        });
        Fault::Crashed(ended.unwrap_or_else(|| "the process closed a pipe".to_owned()))
    }
}

fn is_later(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

impl Process {
    /// Closes its requests and gives it time to end by itself.
    pub fn end(mut self) {
        self.requests = None;
        let begin = Instant::now();
        while !self.has_ended() && begin.elapsed() < GRACE {
            std::thread::sleep(KNOCK);
        }
    }
}

impl Drop for Process {
    /// Kills it with everything that it started, whatever process group that is in.
    fn drop(&mut self) {
        // The group number cannot have passed to others, because its first process has not been waited for.
        kill_all(Some(self.group), &self.mark);
        if let Some(guard) = &self.guard {
            guard.forget(&self.mark);
        }
        let _ = self.child.wait();
        for printed in &self.printed {
            let _ = printed.recv_timeout(SETTLE);
        }
    }
}
