//! Many independent studies in one run: a cell for each, whose number is its `eta`, with a claim of its own. The worker
//! makes the numbers of a cell from that, so cells share nothing, and no claim sees two of them.

use super::rows::{Place, Row};
use crate::common::{asobench_in, stderr, stdout};
use std::path::Path;
use std::process::Command;

/// A study's verdict on its claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Holds,
    DoesNotHold,
    Undecided,
}

/// Compiles the worker of known errors into a folder.
pub fn make_worker(folder: &Path) {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/verdict_audit/worker.rs");
    let mut rustc = Command::new("rustc");
    rustc.args(["--edition", "2024", "-O", "-o"]);
    let made = rustc.arg(folder.join("worker")).arg(source).status();
    assert!(made.expect("rustc runs").success());
}

/// A method with these words on its command line.
fn method(name: &str, stream: u32, words: &str, batch: u64) -> String {
    let words = if words.contains("--") {
        words.to_owned()
    } else {
        format!("-- {words}")
    };
    let words: Vec<&str> = words.split(' ').collect();
    format!(
        "[[methods]]\nname = '{name}'\ncommand = ['./worker', '{stream}', '{}']\nbatch = {batch}\nworkers = 1\n\
         told = ['noise']\n",
        words.join("', '")
    )
}

/// The file of a run: a plan of looks, so many studies of methods x and y, and for each study these claims.
pub fn file(methods: [&str; 2], windows: &str, trials: u64, studies: u32, claims: &[String]) -> String {
    let horizon = if claims.iter().any(|claim| claim.contains("fit_fresh")) {
        100
    } else {
        16
    };
    let mut text = format!(
        "trials = {trials}\nmeasures = ['e_a']\n[settings]\nplant = 'first'\norder = 1\nnoise = 'white'\n\
         eta = {{ linspace = [1, {studies}, {studies}] }}\nwindow = {windows}\nhorizon = {horizon}\n\
         [plants.first]\nA = [1, -0.5]\nB = [0, 1]\n"
    );
    let batch = trials.clamp(1, 4096);
    for (stream, (name, words)) in (0..).zip(["x", "y"].into_iter().zip(methods)) {
        if !words.is_empty() {
            text += &method(name, stream, words, batch);
        }
    }
    let claims_of = |study: u32| {
        let claims = claims.iter().zip(0..);
        let with_id = move |(claim, place): (&String, usize)| {
            format!("[[claims]]\nid = 'S{study}-{place}'\nwhere = {{ eta = {study} }}\n{claim}\n")
        };
        claims.map(with_id)
    };
    text.extend((1..=studies).flat_map(claims_of));
    text
}

/// Runs a file in a folder and returns the verdicts in the order of the claims, each with its sentence.
pub fn verdicts(folder: &Path, arguments: &[&str]) -> Vec<(Verdict, String)> {
    let run = [&["run", "study.toml", "--allow-commands", "--every-claim"], arguments].concat();
    let output = asobench_in(folder, &run);
    assert!(output.status.success(), "{run:?}: {}", stderr(&output));
    let mut found: Vec<(Verdict, String)> = Vec::new();
    for line in stdout(&output).lines() {
        let (id, said) = line.split_once("  ").unwrap_or_default();
        let said = said.trim_start();
        let is_claim = id.starts_with('S') && id.contains('-');
        let verdict = match said.split(':').next() {
            Some("holds") => Some(Verdict::Holds),
            Some("does not hold") => Some(Verdict::DoesNotHold),
            Some("undecided") => Some(Verdict::Undecided),
            _ => None,
        };
        match (verdict.filter(|_| is_claim), found.last_mut()) {
            (Some(verdict), _) => found.push((verdict, said.to_owned())),
            (None, Some((_, sentence))) if line.starts_with("  ") => {
                *sentence = format!("{sentence} {}", line.trim_start());
            }
            _ => {}
        }
    }
    found
}

/// Returns what every study of a row said at each of its looks.
pub fn looks(folder: &Path, row: &Row, studies: u32, seed: u64) -> Vec<Vec<(Verdict, String)>> {
    let claim = format!("holds = '{}'\ntest = [{{ {} }}]", row.holds, row.test);
    let first = row.looks[0].1;
    let text = file(row.methods, row.windows, first, studies, &[claim]);
    let results = folder.join("results");
    if results.exists() {
        std::fs::remove_dir_all(&results).expect("removed");
    }
    let mut all = vec![Vec::new(); studies as usize];
    for ((plan, trials), number) in row.looks.iter().zip(1..) {
        let plan = plan.map_or_else(String::new, |looks| format!("looks = {looks}\n"));
        let file = format!("seed = {seed}\n{plan}{text}");
        std::fs::write(folder.join("study.toml"), file).expect("a file");
        let (out, fresh) = (format!("results/{number}"), (seed + number).to_string());
        let (out, confirm) = match row.place {
            Place::Here => ("results/out", None),
            Place::NewFolder => (&*out, None),
            Place::Confirmed => (&*out, Some(["--confirm", &fresh])),
        };
        let trials = trials.to_string();
        let mut arguments = vec!["--trials", &trials, "--out", out];
        arguments.extend(confirm.into_iter().flatten());
        let found = verdicts(folder, &arguments);
        assert_eq!(found.len(), all.len(), "{}: {}", row.law, row.test);
        all.iter_mut().zip(found).for_each(|(all, found)| all.push(found));
    }
    all
}
