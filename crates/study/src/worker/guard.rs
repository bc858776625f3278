//! The guard: kills workers if the program that uses them is killed itself.

use crate::files::Mark;
use rustix::process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal};
use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// The subcommand that runs a guard.
pub const SUBCOMMAND: &str = "guard-workers";
/// Sent instead of a group number: the processes with the mark that follows are already killed.
const FORGET: &str = "forget";
/// Time for a process that is being started to execute its command.
const STARTING: Duration = Duration::from_millis(200);
/// Pause after a guard was replaced.
const RENEWAL: Duration = Duration::from_millis(10);

/// A process that outlives this one by a moment. Once its input ends, it kills all groups that it was not told to
/// forget. A guard that is killed is replaced.
#[derive(Debug)]
pub struct Guard {
    told: Arc<Mutex<Told>>,
    keeper: Option<JoinHandle<()>>,
}

/// The lines that a guard was told, from which the next one is told again.
#[derive(Debug, Default)]
struct Told {
    /// `None` once no guard is wanted any more, or if none could be started.
    input: Option<ChildStdin>,
    /// The last line about each folder of pipes.
    watched: BTreeMap<PathBuf, String>,
    is_over: bool,
}

impl Told {
    fn say(&mut self, line: &str) {
        if let Some(input) = &mut self.input {
            // A guard that is gone is replaced, and told again.
            let _ = writeln!(input, "{line}");
        }
    }
}

impl Guard {
    /// Starts a guard from the program's own executable.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(program: &Path) -> std::io::Result<Self> {
        let mut child = spawn(program)?;
        let told = Arc::new(Mutex::new(Told {
            input: child.stdin.take(),
            ..Told::default()
        }));
        let (shared, program) = (Arc::clone(&told), program.to_owned());
        let keeper = std::thread::Builder::new().spawn(move || keep(child, &program, &shared))?;
        Ok(Self {
            told,
            keeper: Some(keeper),
        })
    }

    /// Asks the guard to kill a group, and the processes with this mark, if this process ends before [`Self::forget`].
    /// Without a group, the mark is that of a process about to be started.
    pub fn watch(&self, group: Option<Pid>, mark: &Mark) {
        let group = group.map_or(0, |group| group.as_raw_nonzero().get());
        let line = format!("{group} {mark}");
        let mut told = lock(&self.told);
        told.say(&line);
        told.watched.insert(mark.folder().to_owned(), line);
    }

    /// Tells the guard that the processes with this mark are already killed.
    pub fn forget(&self, mark: &Mark) {
        let mut told = lock(&self.told);
        told.say(&format!("{FORGET} {mark}"));
        told.watched.remove(mark.folder());
    }
}

fn lock(told: &Mutex<Told>) -> MutexGuard<'_, Told> {
    told.lock().unwrap_or_else(PoisonError::into_inner)
}

fn spawn(program: &Path) -> std::io::Result<Child> {
    Command::new(program)
        .arg(SUBCOMMAND)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
}

/// Waits for a guard, and replaces it if it ends before it should.
fn keep(mut child: Child, program: &Path, told: &Mutex<Told>) {
    loop {
        let _ = child.wait();
        let mut told = lock(told);
        if told.is_over {
            return;
        }
        let Ok(mut next) = spawn(program) else {
            // Without a guard, workers still end when their requests end.
            told.input = None;
            return;
        };
        told.input = next.stdin.take();
        let lines: Vec<String> = told.watched.values().cloned().collect();
        for line in &lines {
            told.say(line);
        }
        child = next;
        drop(told);
        // One that cannot live is not started without a pause.
        std::thread::sleep(RENEWAL);
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        {
            let mut told = lock(&self.told);
            told.is_over = true;
            told.input = None;
        }
        // The guard ends with its input, and its keeper with the guard.
        let _ = self.keeper.take().map(JoinHandle::join);
    }
}

/// Runs the subcommand: reads groups to watch, with their marks, and marks to forget. At the end of its input it kills
/// what is left.
pub fn stand(input: impl BufRead) {
    let mut watched = BTreeMap::new();
    for line in input.lines().map_while(Result::ok) {
        let Some((group, mark)) = line.split_once(' ') else {
            continue;
        };
        let Some(mark) = Mark::read(mark) else {
            continue;
        };
        let folder = mark.folder().to_owned();
        if group == FORGET {
            watched.remove(&folder);
        } else if let Ok(group) = group.parse() {
            watched.insert(folder, (Pid::from_raw(group), mark));
        }
    }
    if watched.values().any(|(group, _)| group.is_none()) {
        // That process may not have executed its command yet.
        std::thread::sleep(STARTING);
    }
    for (group, mark) in watched.into_values() {
        kill_all(group, &mark);
    }
}

/// Kills a process group and all processes with a mark, whatever group they are in.
pub fn kill_all(group: Option<Pid>, mark: &Mark) {
    // If a process cannot be killed, nothing more can be done; it may have ended by itself.
    let _ = group.map(|group| kill_process_group(group, Signal::KILL));
    let leader = group.map(|group| group.as_raw_nonzero().get());
    for _ in 0..3 {
        let mut found = mark.processes();
        found.retain(|number| Some(*number) != leader);
        if found.is_empty() {
            break;
        }
        for number in found {
            // The process is held by a descriptor before the mark is checked again, so its number cannot pass to
            // another process.
            let process = Pid::from_raw(number);
            let held = process.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
            if let Some(held) = held.filter(|_| mark.is_of(number)) {
                let _ = pidfd_send_signal(held, Signal::KILL);
            }
        }
    }
}
