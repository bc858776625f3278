//! The page of the reference suite, and its tables: readers of the results of methods, each of which stands for itself.

mod pictures;
mod subject;
mod tables;

use super::document::paper;
use super::folder::Files;
use super::html::{Page, Section};
use asobench_study::suite::{Division, IDEAL, REFERENCE, RecordedFits, Suite, TIME_LIMIT};
use asobench_study::text::{count, grouped};
use std::collections::BTreeSet;
pub use subject::SuitePage;
use tables::Tables;
pub use tables::{SuiteTable, about_loss, law_table, published_table, recorded as recorded_tables, times_table};

/// The words of the tables, a line for each; some have a meaning of their own where methods are told nothing.
const WORDS: &str = include_str!("words.txt");
/// Notes for readers of the page, a paragraph in each line.
const ABOUT: &str = include_str!("about.txt");
/// The rows of the first table; the others stand below.
const FIRST: usize = 10;

/// The tables of the suite's page: those that a run ends with first.
pub fn suite_tables(of: &SuitePage<'_>) -> Vec<SuiteTable> {
    let mut all = Tables::new(of).all();
    if let Some(open) = of.open {
        all.extend(Tables::new(open).all());
    }
    all.extend(of.recorded.into_iter().flat_map(recorded_tables));
    all
}

/// A page that is being written, with the files beside it.
struct Sheet<'a> {
    tables: Tables<'a>,
    files: Files,
}

/// The files of the suite's page.
pub fn suite_page(of: &SuitePage<'_>) -> Files {
    let suite = of.suite;
    let division = match suite.division {
        Division::Closed => String::new(),
        contest => format!(", contest {contest}"),
    };
    let newcomer = of.newcomer.map(|name| format!(", with {name}"));
    let title = format!(
        "asobench report: reference suite {}, tier {}{division}{}",
        suite.manifest.edition,
        suite.tier,
        newcomer.unwrap_or_default()
    );
    let mut page = Page::new(title);
    let mut sheet = Sheet {
        tables: Tables::new(of),
        files: Files::new(),
    };
    page.introduction(|section| introduction(section, of));
    page.section("ranking", "The ranking", |section| sheet.ranking(section));
    page.section("words", "The words", |section| words(section, of));
    if of.newcomer.is_some() {
        page.section("newcomer", "The newcomer beside the others", |section| {
            sheet.put(section, sheet.tables.own_losses());
            sheet.put(section, sheet.tables.against());
        });
    }
    page.section("all", "All methods", |section| sheet.all(section));
    page.section("difficulty", "What is hard for whom", |section| {
        sheet.put(section, sheet.tables.difficulties());
        sheet.put(section, sheet.tables.reasons());
    });
    if let Some(open) = of.open {
        page.section("open", "Methods that choose their order", |section| {
            sheet.choosing(section, open);
        });
    }
    page.section("scenarios", "Scenario by scenario", |section| {
        sheet.put(section, [sheet.tables.scenarios()]);
        sheet.put(section, sheet.tables.efficiencies());
    });
    page.section("by-method", "Method by method", |section| {
        sheet.pictured(section, of);
    });
    if let Some(fits) = of.recorded {
        page.section("recorded", "Recorded data", |section| {
            sheet.recorded(section, fits);
        });
    }
    if let Some(table) = sheet.tables.contributed() {
        page.section("contributed", "Results of others", |section| {
            sheet.put(section, [table]);
        });
    }
    page.section("about", "About this page", |section| about(section, of));
    let mut files = sheet.files;
    files.push(("report.html".to_owned(), page.html()));
    files
}

impl Sheet<'_> {
    /// Writes tables, each with links to its files.
    fn put(&mut self, section: &mut Section, tables: impl IntoIterator<Item = SuiteTable>) {
        for SuiteTable { name, title, table } in tables {
            section.table(&table);
            let mut files = vec![(format!("tables/{name}.csv"), table.csv())];
            files.extend(paper::files(&name, &title, &table));
            section.files(&paper::links(&files, ""));
            self.files.extend(files);
        }
    }

    /// The first screen.
    fn ranking(&mut self, section: &mut Section) {
        section.table(&self.tables.ranking(FIRST).table);
        let claims = self.tables.claims();
        if !claims.is_empty() {
            section.heading("Use X when Y");
            section.list(&claims);
        }
        self.put(section, self.tables.best());
    }

    fn all(&mut self, section: &mut Section) {
        self.put(section, [self.tables.ranking(usize::MAX)]);
        if self.tables.has_below() {
            section.paragraph(
                "Below the bound: certainly more than half of a method's runs, over all or in one scenario, are nearer \
                 to the truth than the median of an efficient method. It is biased towards the truth, or knows what it \
                 should not.",
            );
        }
        self.put(section, self.tables.partial());
        self.put(section, self.tables.places());
        self.overview(section, self.tables.of, "figures/suite.svg");
    }

    fn overview(&mut self, section: &mut Section, of: &SuitePage<'_>, path: &str) {
        let (picture, caption) = pictures::overview(of);
        section.figure(&picture, &caption);
        self.files.push((path.to_owned(), picture.wide.svg()));
    }

    /// The open contest.
    fn choosing(&mut self, section: &mut Section, open: &SuitePage<'_>) {
        section.paragraph(&format!(
            "Here each method is {}, and chooses an order up to 6 by BIC; `kernel-fir` needs no order. There is no \
             common theta, so d is the squared error of the impulse response, or of the frequency response over all \
             frequencies, over what it is on average at the Cramer-Rao bound of the true structure. `pem-from-truth` \
             is told that structure.",
            told(open.suite)
        ));
        let tables = Tables::new(open);
        self.put(section, [tables.ranking(usize::MAX)]);
        section.list(&tables.claims());
        self.put(section, tables.best());
        self.overview(section, open, "figures/suite-choosing.svg");
        self.pictured(section, open);
        self.put(section, tables.difficulties());
        self.put(section, tables.reasons());
    }

    /// The distributions of each method.
    fn pictured(&mut self, section: &mut Section, of: &SuitePage<'_>) {
        for (name, picture, caption) in pictures::distributions(of) {
            section.figure(&picture, &caption);
            let path = format!("figures/suite-{name}.svg");
            self.files.push((path, picture.wide.svg()));
        }
    }

    /// The appendix of recorded data.
    fn recorded(&mut self, section: &mut Section, fits: &RecordedFits) {
        section.paragraph(
            "Models of the methods that choose their order, from the first samples of records of real plants, and \
             their FIT over the rest. One record has one noise, so these numbers have no Monte-Carlo error and rank no \
             method. Their command is `asobench suite recorded`.",
        );
        self.put(section, recorded_tables(fits));
        let about = fits
            .records
            .iter()
            .map(|of| format!("{}: {}", of.file, of.about.join("; ")));
        section.list(&about.collect::<Vec<_>>());
    }
}

fn introduction(section: &mut Section, of: &SuitePage<'_>) {
    let suite = of.suite;
    section.question("How near do methods come to what a record can say, and how often do they fail?");
    let bank = suite.scenarios().filter(|of| of.is_bank);
    let bank: Vec<_> = bank.collect();
    let (published, bank) = (
        suite.scenarios().count() - bank.len(),
        match bank.len() {
            0 => String::new(),
            plants => format!(" and {plants} random plants with {} runs each", suite.trials(true)),
        },
    );
    let rivals = of.methods.iter().filter(|of| of.method != IDEAL).count();
    section.paragraph(&format!(
        "{} with default options, each {}, on {published} scenarios of published systems with {} runs each{bank}. \
         Relative efficiency is the error at the Cramer-Rao bound over that of the method; 0.88(3) is 0.88 \
         with Monte-Carlo standard error 0.03.",
        count(rivals as u64, "method"),
        told(suite),
        grouped(suite.trials(false)),
    ));
}

/// The knowledge of the methods.
fn told(suite: &Suite) -> &'static str {
    match suite.division {
        Division::Closed => "told the orders of the truth in its own form",
        Division::Orders => {
            "told na, nb and nk of the plant (n where it takes no orders) and nothing of the noise, whose orders are \
             its own defaults"
        }
        Division::Structure => "told the polynomials of plant and noise with their orders",
        Division::Open if suite.manifest.has_contests() => "told nothing but the record",
        Division::Open => "told the delay",
    }
}

/// The definitions of the words in the tables.
fn words(section: &mut Section, of: &SuitePage<'_>) {
    let own = if of.suite.division == Division::Open {
        "[open] "
    } else {
        "[told] "
    };
    let all = WORDS.lines().filter_map(|line| {
        let is_of_some = line.starts_with('[');
        let line = if is_of_some { line.strip_prefix(own)? } else { line };
        line.split_once(": ")
    });
    section.settings(&all.collect::<Vec<_>>());
    if let Some(times) = of.times {
        section.settings(&[(
            "time",
            format!(
                "of an estimate on one thread over that of `{REFERENCE}` in the same scenario, all methods in turns; \
                 the geometric mean over scenarios of the median over rounds. A run of more than {TIME_LIMIT} s is \
                 lost. Measured by {}, apart from the results, which hold no times",
                times.program
            ),
        )]);
    }
}

fn about(section: &mut Section, of: &SuitePage<'_>) {
    section.paragraph("This command prints every number of the tables:");
    section.code(of.command);
    section.settings(&[
        ("suite", of.suite.manifest.edition.clone()),
        ("contest", of.suite.division.to_string()),
        ("tier", of.suite.tier.to_string()),
        ("seed", of.suite.manifest.seed.to_string()),
        ("program", format!("asobench {}", env!("CARGO_PKG_VERSION"))),
    ]);
    let loops = of.suite.scenarios().filter(|of| of.is_closed).map(|of| &of.plant);
    let loops: BTreeSet<&String> = loops.collect();
    let loops = ABOUT.replace("{loops}", &loops.len().to_string());
    section.list(&loops.lines().collect::<Vec<_>>());
}
