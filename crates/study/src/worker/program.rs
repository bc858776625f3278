//! An external program that is a method. The threads of a run share its processes.

use super::fault::Fault;
use super::guard::Guard;
use super::log::Log;
use super::message::{Incoming, Ready, Reply};
use super::options::{CommandOptions, Workers};
use super::process::Process;
use asobench_identification::estimator::ProgramError;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// Shortest time limit for a process to become ready.
const STARTING: Duration = Duration::from_mins(2);
/// Attempts to start a process.
const ATTEMPTS: usize = 3;
/// Number of faults after which the user is warned, if no process has answered a batch yet.
const WARNED_AFTER: u64 = 3;
/// Number of printed lines in that warning.
const LINES: usize = 10;

/// The permission to run a program.
#[derive(Clone, Debug)]
pub struct Permit {
    /// The folder in which it runs.
    pub folder: PathBuf,
    /// Set when the run must stop.
    pub stop: Arc<AtomicBool>,
    /// Kills the program's processes if this process is killed.
    pub guard: Option<Arc<Guard>>,
    /// Shows the user a line while the study runs.
    pub warn: fn(&str),
}

/// An external program that is a method.
pub struct Program {
    /// The method's name.
    pub name: String,
    /// Its options in the experiment file.
    pub options: CommandOptions,
    /// A fingerprint of the study that does not include the program's version.
    pub fingerprint: String,
    /// The output of its processes.
    pub log: Log,
    permit: OnceLock<Permit>,
    idle: Mutex<Idle>,
    freed: Condvar,
    answered: AtomicBool,
    /// Number of faults while no process had answered a batch.
    faults: AtomicU64,
    /// Length of the log at the last fault.
    logged: AtomicU64,
}

/// The idle processes.
#[derive(Default)]
struct Idle {
    processes: Vec<Greeted>,
    /// Number of processes at work.
    leased: u64,
}

/// A process that has answered the greeting.
struct Greeted {
    process: Process,
    hello: String,
    ready: Ready,
    /// Number of messages that it has answered.
    served: u64,
}

impl Program {
    /// Creates a program without a permit.
    pub fn new(name: String, options: CommandOptions, fingerprint: String) -> Self {
        Self {
            name,
            options,
            fingerprint,
            log: Log::default(),
            permit: OnceLock::new(),
            idle: Mutex::default(),
            freed: Condvar::new(),
            answered: AtomicBool::new(false),
            faults: AtomicU64::new(0),
            logged: AtomicU64::new(0),
        }
    }

    /// Permits it to run from now on.
    pub fn permit(&self, permit: Permit) {
        // Only the first permit is kept.
        let _ = self.permit.set(permit);
    }

    /// The time limit for a message.
    pub fn time(&self) -> Duration {
        Duration::from_secs_f64(self.options.timeout)
    }

    /// Returns a process that knows the cell: an idle one if possible, otherwise a new one.
    pub(super) fn lease(self: &Arc<Self>, hello: &str) -> Result<Lease, ProgramError> {
        let mut idle = self.idle();
        if let Workers::Most(most) = self.options.workers {
            while idle.leased >= most {
                idle = self.freed.wait(idle).unwrap_or_else(PoisonError::into_inner);
            }
        }
        idle.leased += 1;
        let like = idle.processes.iter().position(|of| of.hello == hello);
        let found = match like {
            Some(at) => Some(idle.processes.swap_remove(at)),
            None => idle.processes.pop(),
        };
        drop(idle);
        let mut lease = Lease {
            program: Arc::clone(self),
            hello: hello.to_owned(),
            at_work: None,
        };
        if let Some(mut greeted) = found
            && greeted.process.is_clean()
            && (greeted.hello == hello || self.greet(&mut greeted, hello)?)
        {
            lease.at_work = Some(greeted);
        }
        if lease.at_work.is_none() {
            lease.renew()?;
        }
        Ok(lease)
    }

    fn idle(&self) -> MutexGuard<'_, Idle> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes a fault to the log. Warns the user once if no process has answered a batch so far: a program that always
    /// fails would otherwise take long to be noticed.
    pub(super) fn fault(&self, trials: &str, what: &Fault) {
        self.log.note(&format!("{trials}: {what}; the process is killed"));
        let since = self.logged.swap(self.log.length(), Ordering::Relaxed);
        if self.answered.load(Ordering::Relaxed) {
            return;
        }
        let faults = self.faults.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(permit) = self.permit.get()
            && faults == WARNED_AFTER
        {
            let name = &self.name;
            (permit.warn)(&format!(
                "warning: method {name}: no batch was answered in {faults} attempts; the last: {what}"
            ));
            for line in self.log.last_lines(since, LINES) {
                (permit.warn)(&format!("| {line}"));
            }
            (permit.warn)(
                "if this goes on, all trials will be recorded as failed, slowly; Ctrl-C stops the run, asobench \
                 test-method FILE tests the program",
            );
        }
    }

    fn failed(&self, reason: impl Into<String>) -> ProgramError {
        ProgramError::Failed {
            name: self.name.clone(),
            reason: reason.into(),
        }
    }

    /// Greets a process again, for another cell. Returns false if its answer has changed.
    fn greet(&self, greeted: &mut Greeted, hello: &str) -> Result<bool, ProgramError> {
        let permit = self.permit.get();
        let Permit { stop, .. } = permit.ok_or(ProgramError::NotAgreed(self.name.clone()))?;
        let asked = greeted
            .process
            .ask(hello.as_bytes(), Incoming::ready, self.time(), stop);
        match asked {
            Ok(ready) if ready == greeted.ready => {
                hello.clone_into(&mut greeted.hello);
                Ok(true)
            }
            Err(Fault::Stopped) => Err(ProgramError::Stopped),
            _ => Ok(false),
        }
    }

    /// Starts a new process and greets it.
    fn start(&self, hello: &str) -> Result<Greeted, ProgramError> {
        let permit = self.permit.get();
        let permit = permit.ok_or(ProgramError::NotAgreed(self.name.clone()))?;
        let start = || Process::start(&self.options.command, &permit.folder, permit.guard.clone(), &self.log);
        let mut reason = String::new();
        for _ in 0..ATTEMPTS {
            let mut process = start().map_err(|reason| self.failed(reason))?;
            let time = STARTING.max(self.time());
            match process.ask(hello.as_bytes(), Incoming::ready, time, &permit.stop) {
                Ok(ready) => {
                    self.check(&ready)?;
                    return Ok(Greeted {
                        process,
                        hello: hello.to_owned(),
                        ready,
                        served: 0,
                    });
                }
                Err(Fault::Stopped) => return Err(ProgramError::Stopped),
                Err(Fault::Timeout(came)) => {
                    let seconds = time.as_secs_f64();
                    return Err(self.failed(format!(
                        "'{}' is not ready after {seconds} s: {came}",
                        self.options.typed()
                    )));
                }
                Err(Fault::Malformed(what)) => {
                    reason = format!("its answer to \"hello\" violates docs/protocol.md: {what}");
                }
                Err(Fault::Crashed(how)) => {
                    reason = format!("'{}' was not ready: {how}", self.options.typed());
                }
            }
            drop(process);
        }
        Err(self.failed(reason))
    }

    /// Checks that this is the program named in the file.
    fn check(&self, ready: &Ready) -> Result<(), ProgramError> {
        match &self.options.worker {
            Some(agreed) if *agreed != ready.identity() => Err(self.failed(format!(
                "the program says that it is '{}'; expected worker = '{}'",
                crate::text::visible(ready.identity()),
                crate::text::visible(agreed)
            ))),
            _ => Ok(()),
        }
    }

    /// Takes over the permit, the idle processes and the log of another program.
    pub fn take_over(&self, other: &Self) {
        if let Some(permit) = other.permit.get() {
            self.permit(permit.clone());
        }
        if let Some(printed) = other.log.text() {
            self.log.add(&printed[crate::files::WORKERS_TITLE.len()..]);
        }
        let processes = std::mem::take(&mut other.idle().processes);
        self.idle().processes.extend(processes);
    }

    /// Ends the idle processes; they are killed only if they do not end by themselves.
    pub fn end(&self) {
        let processes = std::mem::take(&mut self.idle().processes);
        let threads = processes.into_iter();
        let threads: Vec<_> = threads
            .filter_map(|greeted| {
                // Without a thread its process is killed.
                let thread = std::thread::Builder::new();
                thread.spawn(move || greeted.process.end()).ok()
            })
            .collect();
        for thread in threads {
            // If a thread panicked, its process has been killed.
            let _ = thread.join();
        }
    }
}

/// A process at work. It is killed unless it is given back.
pub(super) struct Lease {
    program: Arc<Program>,
    hello: String,
    at_work: Option<Greeted>,
}

impl Lease {
    /// Replaces the process by a new one.
    pub(super) fn renew(&mut self) -> Result<(), ProgramError> {
        self.at_work = None;
        self.at_work = Some(self.program.start(&self.hello)?);
        Ok(())
    }

    fn greeted(&self) -> &Greeted {
        self.at_work.as_ref().expect("a process until it is dropped")
    }

    /// The process's answer to the greeting.
    pub(super) fn ready(&self) -> &Ready {
        &self.greeted().ready
    }

    /// How many messages the process has answered.
    pub(super) fn answered(&self) -> u64 {
        self.greeted().served
    }

    /// Sends the message with this number, and returns the reply.
    pub(super) fn ask(&mut self, number: u64, message: &[u8], trials: usize) -> Result<Reply, Fault> {
        let stop = &self.program.permit.get().ok_or(Fault::Stopped)?.stop;
        let greeted = self.at_work.as_mut().ok_or(Fault::Stopped)?;
        if !greeted.process.is_clean() {
            let stray = "bytes that were not asked for, or the pipe of replies was closed";
            return Err(Fault::Malformed(stray.to_owned()));
        }
        let (time, matrices) = (self.program.time(), greeted.ready.matrices);
        let take = |incoming: &mut Incoming| incoming.reply(number, trials, matrices);
        let reply = greeted.process.ask(message, take, time, stop)?;
        reply.check().map_err(Fault::Malformed)?;
        greeted.served += 1;
        self.program.answered.store(true, Ordering::Relaxed);
        Ok(reply)
    }

    /// Returns the process to the idle ones.
    pub(super) fn give_back(mut self) {
        let greeted = self.at_work.take();
        self.program.idle().processes.extend(greeted);
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        // The process is killed before another one may start.
        self.at_work = None;
        self.program.idle().leased -= 1;
        self.program.freed.notify_one();
    }
}
