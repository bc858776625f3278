//! What kills workers when the program that asks them is killed itself.

use crate::files::Mark;
use rustix::process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal};
use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The subcommand that a guard runs.
pub const SUBCOMMAND: &str = "guard-workers";
/// Instead of a group: what follows is killed already.
const FORGET: &str = "forget";
/// For a process that is being started to have its command.
const STARTING: Duration = Duration::from_millis(200);

/// A process that outlives this one by a moment: once its input ends, it kills the groups that were not forgotten.
#[derive(Debug)]
pub struct Guard {
    child: Child,
    input: Mutex<Option<ChildStdin>>,
}

impl Guard {
    /// Starts one, by the program's own file.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(program: &Path) -> std::io::Result<Self> {
        let mut child = Command::new(program)
            .arg(SUBCOMMAND)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()?;
        let input = Mutex::new(child.stdin.take());
        Ok(Self { child, input })
    }

    /// Kills a group, and the processes with this mark, if this process ends before it is forgotten.
    /// Without a group, what is about to be started.
    pub fn watch(&self, group: Option<Pid>, mark: &Mark) {
        let group = group.map_or(0, |group| group.as_raw_nonzero().get());
        self.say(&format!("{group} {mark}"));
    }

    /// What has this mark is killed already.
    pub fn forget(&self, mark: &Mark) {
        self.say(&format!("{FORGET} {mark}"));
    }

    fn say(&self, line: &str) {
        let mut input = self.input.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(input) = &mut *input {
            // Without a guard, workers still end with their requests.
            let _ = writeln!(input, "{line}");
        }
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        *self.input.get_mut().unwrap_or_else(PoisonError::into_inner) = None;
        // It ends with its input.
        let _ = self.child.wait();
    }
}

/// What the subcommand does: reads groups to watch, with their marks, and to forget, and kills what is left.
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
        // It may be between its start and its command.
        std::thread::sleep(STARTING);
    }
    for (group, mark) in watched.into_values() {
        kill_all(group, &mark);
    }
}

/// Kills a process group and all processes with a mark, whatever group they are in.
pub fn kill_all(group: Option<Pid>, mark: &Mark) {
    // Nothing more can be done where a process cannot be killed; it may have ended by itself.
    let _ = group.map(|group| kill_process_group(group, Signal::KILL));
    let leader = group.map(|group| group.as_raw_nonzero().get());
    for _ in 0..3 {
        let mut found = mark.processes();
        found.retain(|number| Some(*number) != leader);
        if found.is_empty() {
            break;
        }
        for number in found {
            // Held before it is looked at again: the number cannot become another process's meanwhile.
            let process = Pid::from_raw(number);
            let held = process.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
            if let Some(held) = held.filter(|_| mark.is_of(number)) {
                let _ = pidfd_send_signal(held, Signal::KILL);
            }
        }
    }
}
