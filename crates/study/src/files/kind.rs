//! The kinds of files that the program knows: their largest size, and how it recognises its own.

use asobench_identification::names::named_enum;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;
/// The name of the file with what studies simulated.
pub const SIMULATED: &str = "simulated.md";

/// Its first line.
pub const SIMULATED_TITLE: &str = "# What was simulated\n";

/// A line of every page, by which it is known.
pub const PAGE_MAKER: &str = "<meta name=\"generator\" content=\"asobench\">";

/// The first line of every LaTeX table.
pub const LATEX_TITLE: &str = "% Table of an asobench report; in the preamble: \\usepackage{booktabs}\n";

/// The first line of the file with the commands that the user has agreed to.
pub const AGREED_TITLE: &str = "# asobench: commands that were agreed to\n";

/// The first line of `workers.log`.
pub const WORKERS_TITLE: &str = "# asobench: what workers printed\n";

/// Bytes read from the beginning of a file to recognise it.
const HEAD: u64 = 1 << 16;
/// Longest footer of a Parquet file that is searched.
const LONGEST_FOOTER: u64 = 16 * MIB;

named_enum! {
    /// A kind of file, named as in the names of temporary files.
    Kind, "kind of file" {
        /// An experiment file. Once it exists, it belongs to the user.
        Experiment = "experiment",
        /// The samples of a disturbance, `t,delta`.
        Signal = "signal",
        /// A record `k,u,y`.
        Record = "record",
        /// Observer states of `estimate --states` and of `observe --out`, as CSV or Parquet.
        States = "states",
        /// `manifest.json`.
        Manifest = "manifest",
        /// `looks.json`.
        Looks = "looks",
        /// `blocks/design.json`.
        Design = "design",
        /// A block of trials.
        Block = "block",
        /// `summary.json`.
        Summary = "summary",
        /// A Parquet table.
        Parquet = "parquet",
        /// `timing/times.json`.
        Times = "times",
        /// The results of a method in the reference suite.
        Suite = "suite",
        /// A figure as SVG or PDF.
        Figure = "figure",
        /// `report.html`.
        Page = "page",
        /// `claims.md`.
        Verdicts = "verdicts",
        /// A CSV table of a report.
        Table = "table",
        /// A LaTeX table of a report.
        Latex = "latex",
        /// `simulated.md`.
        Simulated = "simulated",
        /// The plan of a study in shards.
        Plan = "plan",
        /// `run.json` of a process that computed blocks of a shard.
        Run = "run",
        /// A job script. Once it exists, it belongs to the user.
        Script = "script",
        /// `workers.log`: the output of external programs.
        Log = "log",
        /// The commands that the user has agreed to.
        Agreed = "agreed",
    }
}

impl Kind {
    /// Returns the kind of a file of a report or a figure by its name.
    pub fn of_report(name: &str) -> Option<Self> {
        if name == SIMULATED {
            return Some(Self::Simulated);
        }
        match name.rsplit_once('.')?.1 {
            "svg" => Some(Self::Figure),
            "csv" => Some(Self::Table),
            "tex" => Some(Self::Latex),
            "html" => Some(Self::Page),
            "md" => Some(Self::Verdicts),
            _ => None,
        }
    }

    /// Largest size in bytes of a file that is read, or written to be read again.
    pub const fn limit(self) -> u64 {
        match self {
            Self::Experiment | Self::Log | Self::Agreed => 64 * MIB,
            Self::Signal => 256 * MIB,
            Self::Record
            | Self::Manifest
            | Self::Looks
            | Self::Design
            | Self::Block
            | Self::Times
            | Self::Suite
            | Self::Plan
            | Self::Run
            | Self::Script => GIB,
            Self::Summary => 4 * GIB,
            // Never read completely.
            Self::States
            | Self::Parquet
            | Self::Figure
            | Self::Page
            | Self::Verdicts
            | Self::Table
            | Self::Latex
            | Self::Simulated => u64::MAX,
        }
    }

    /// Whether a run needs the complete file after a crash of the machine. Any other file is made again by its command.
    pub(super) const fn is_synced(self) -> bool {
        matches!(
            self,
            Self::Manifest
                | Self::Looks
                | Self::Design
                | Self::Block
                | Self::Summary
                | Self::Parquet
                | Self::Plan
                | Self::Run
        )
    }

    /// Whether the program wrote a file, judged by its beginning and, for Parquet, by its columns. An empty file
    /// belongs to nobody.
    pub(super) fn is_own(self, file: &mut File) -> io::Result<bool> {
        let mut head = Vec::new();
        file.seek(SeekFrom::Start(0))?;
        file.by_ref().take(HEAD).read_to_end(&mut head)?;
        if head.is_empty() {
            return Ok(true);
        }
        let text = String::from_utf8_lossy(&head);
        // JSON with another layout is still the program's own.
        let json: String = match self {
            Self::Manifest
            | Self::Looks
            | Self::Design
            | Self::Summary
            | Self::Times
            | Self::Suite
            | Self::Plan
            | Self::Run => text.split_ascii_whitespace().collect(),
            _ => String::new(),
        };
        Ok(match self {
            Self::Experiment | Self::Signal | Self::Script => false,
            Self::Plan => json.starts_with("{\"plan\":\"asobench\","),
            Self::Run => json.starts_with("{\"run\":\"asobench\","),
            Self::Manifest => json.starts_with("{\"program\":\"asobench\","),
            Self::Looks => json.starts_with("{\"looks_of\":\"asobench\","),
            Self::Design => json.starts_with("{\"version\":\"") && json.contains("\",\"experiment\":{"),
            Self::Summary => json.starts_with("{\"title\":\"") && json.contains("\",\"hypothesis\":\""),
            Self::Times => json.starts_with("{\"design\":\""),
            Self::Suite => json.starts_with("{\"suite\":\""),
            Self::Log => text.starts_with(WORKERS_TITLE),
            Self::Agreed => text.starts_with(AGREED_TITLE),
            Self::Block => head.starts_with(b"asobench"),
            Self::Parquet => head.starts_with(b"PAR1") && has_columns(file, &["claim", "estimator", "window"])?,
            Self::Figure => {
                text.starts_with(PLOTTERS)
                    || text.starts_with("%PDF-") && text.contains("/Creator (asobench)")
                    || text.starts_with("<svg ") && text.contains(" class=\"asoplot\" ")
            }
            Self::Page => {
                // Pages of 0.2.0 are told by their title.
                let told = [PAGE_MAKER, "<title>asobench report"]
                    .iter()
                    .any(|words| text.contains(words));
                text.starts_with("<!DOCTYPE html>") && told
            }
            Self::Verdicts => text.starts_with("# Verdicts\n\n| claim | what it says | verdict | experiment |\n"),
            Self::Table => text
                .split_once("\r\n")
                .is_some_and(|(header, _)| TABLES.iter().any(|line| header.contains(line))),
            Self::Latex => text.starts_with(LATEX_TITLE),
            Self::Simulated => text.starts_with(SIMULATED_TITLE),
            Self::Record => text.starts_with("# asobench re") && text.contains("\n# order: "),
            Self::States if head.starts_with(b"PAR1") => has_columns(file, &["x1", "y_predicted", "innovation"])?,
            Self::States => {
                let (first, rest) = text.split_once('\n').unwrap_or_default();
                first.starts_with("# observer ") && rest.starts_with("k,x1")
            }
        })
    }
}

/// Beginning of the figures of `reproduce`.
const PLOTTERS: &str = "<svg width=\"900\" height=\"980\" viewBox=\"0 0 900 980\" \
    xmlns=\"http://www.w3.org/2000/svg\">\n";

/// The header of a report's table contains at least one of these texts. Builds before the columns `measure` called them
/// `figure`.
const TABLES: [&str; 33] = [
    // Tables with a column for each method.
    ",next / best",
    ",next - best",
    ",trials of a cell",
    "output,measure,trials,failed,unstable,",
    "output,figure,trials,failed,unstable,",
    "failed (%),unstable (%)",
    "measure,statistic,over,output,slope,",
    "figure,statistic,over,output,slope,",
    "bound,output,met in (%),",
    "output,coefficient,covered (%),",
    "first,second,measure,median ratio,",
    "first,second,figure,median ratio,",
    "method,median (\u{b5}s),",
    "output,failure,trials,share (%)",
    "output,failure,trials,first failed trials,",
    "claim,number,value,MCSE",
    "value,verdict,p (pass),p (fail)",
    "value (%),verdict,p (pass),p (fail)",
    "claim,what it says,verdict,experiment",
    "method,lost (%),",
    "method,scenarios,lost (%),",
    "method,median,90 %,",
    "method,scenarios,median,90 %,",
    "what is hard,scenarios,first,",
    "method,all (",
    "method,failure rate (%),",
    "scenario,lost runs,reason,",
    "beside,nearer (%),tie (%),",
    "scenario,system,p,noise model,",
    "scenario,noise model,",
    "record,samples,used,",
    "method,computed by,what it is,",
    "method,by scenario,place,",
];

/// Whether the footer of a Parquet file, which names its columns, has columns with these names.
fn has_columns(file: &mut File, names: &[&str]) -> io::Result<bool> {
    let length = file.seek(SeekFrom::End(0))?;
    let mut end = [0; 8];
    if length < 16 {
        return Ok(false);
    }
    file.seek(SeekFrom::End(-8))?;
    file.read_exact(&mut end)?;
    let [a, b, c, d, magic @ ..] = end;
    let size = u64::from(u32::from_le_bytes([a, b, c, d]));
    if magic != *b"PAR1" || size > LONGEST_FOOTER.min(length - 8) {
        return Ok(false);
    }
    file.seek(SeekFrom::Start(length - 8 - size))?;
    let mut footer = Vec::new();
    file.by_ref().take(size).read_to_end(&mut footer)?;
    let has = |name: &&str| footer.windows(name.len()).any(|part| part == name.as_bytes());
    Ok(names.iter().all(has))
}

pub(super) fn too_large(kind: Kind) -> io::Error {
    let limit = kind.limit() >> 20;
    io::Error::other(format!("larger than {limit} MiB, the limit for such a file"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn is_own(path: &Path, kind: Kind) -> bool {
        let mut file = File::open(path).expect("a file");
        kind.is_own(&mut file).expect("readable")
    }

    /// Every committed result is recognised, and none is taken for another kind.
    #[test]
    fn committed_results_are_the_programs_own() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results");
        let kinds = [
            Kind::Manifest,
            Kind::Looks,
            Kind::Design,
            Kind::Summary,
            Kind::Times,
            Kind::Suite,
            Kind::Parquet,
            Kind::Block,
            Kind::Figure,
            Kind::Page,
            Kind::Verdicts,
            Kind::Table,
            Kind::Latex,
            Kind::Simulated,
            Kind::Record,
            Kind::States,
        ];
        let mut seen = 0;
        for folder in ["nikolov2023", "report", "report/figures", "report/tables"] {
            for entry in std::fs::read_dir(root.join(folder)).expect("a folder") {
                let path = entry.expect("an entry").path();
                let name = path.file_name().and_then(|name| name.to_str());
                let name = name.expect("UTF-8");
                let expected = match name {
                    "manifest.json" => Kind::Manifest,
                    "summary.json" => Kind::Summary,
                    _ => match Kind::of_report(name) {
                        Some(kind) => kind,
                        None => continue,
                    },
                };
                for kind in kinds {
                    assert_eq!(is_own(&path, kind), kind == expected, "{name}: {kind:?}");
                }
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}
