//! The page of the reference suite, and its tables: readers of the results of methods, each of which stands for itself.

mod pictures;
mod subject;
mod tables;

use super::folder::Files;
use super::html::{Page, Section};
use super::table::Table;
use asobench_study::suite::{Division, IDEAL, REFERENCE, RecordedFits, TIME_LIMIT};
use asobench_study::text::grouped;
pub use subject::SuitePage;
use tables::Tables;
pub use tables::recorded as recorded_tables;

/// The tables of the suite's page, in its order.
pub fn suite_tables(of: &SuitePage<'_>) -> Vec<Table> {
    let tables = Tables::new(of);
    let mut all = vec![tables.scores()];
    all.extend(tables.against());
    all.extend(tables.difficulties());
    all.extend(tables.reasons());
    all.push(tables.scenarios());
    all.extend(tables.efficiencies());
    if let Some(open) = of.open {
        let open = Tables::new(open);
        all.push(open.scores());
        all.extend(open.difficulties());
        all.extend(open.reasons());
    }
    all.extend(of.recorded.into_iter().flat_map(recorded_tables));
    all
}

/// The files of the suite's page.
pub fn suite_page(of: &SuitePage<'_>) -> Files {
    let suite = of.suite;
    let tables = Tables::new(of);
    let division = match suite.division {
        Division::Closed | Division::Orders | Division::Structure => "",
        Division::Open => ", open division",
    };
    let newcomer = of.newcomer.map(|name| format!(", with {name}"));
    let title = format!(
        "asobench report: reference suite {}, tier {}{division}{}",
        suite.manifest.edition,
        suite.tier,
        newcomer.unwrap_or_default()
    );
    let mut page = Page::new(title);
    page.introduction(|section| introduction(section, of));
    let mut files = Files::new();
    let scores = tables.scores();
    let (picture, caption) = pictures::overview(of);
    files.push(("figures/suite.svg".to_owned(), picture.wide.svg()));
    page.section("all", "All scenarios", |section| {
        section.figure(&picture, &caption);
        section.table(&scores);
        if tables.has_below() {
            section.paragraph(
                "Below the bound: certainly more than half of a method's runs, over all or in one scenario, are nearer \
                 to the truth than the median of an efficient method. It is biased towards the truth, or knows what it \
                 should not.",
            );
        }
    });
    if let Some(against) = tables.against() {
        page.section("newcomer", "The newcomer beside the others", |section| {
            section.table(&against);
        });
    }
    page.section("difficulty", "What is hard for whom", |section| {
        for table in tables.difficulties().into_iter().chain(tables.reasons()) {
            section.table(&table);
        }
    });
    if let Some(open) = of.open {
        page.section("open", "Methods that choose their order", |section| {
            choosing(section, open, &mut files);
        });
    }
    page.section("scenarios", "Scenario by scenario", |section| {
        section.table(&tables.scenarios());
        for table in tables.efficiencies() {
            section.table(&table);
        }
    });
    page.section("by-method", "Method by method", |section| {
        pictured(section, of, &mut files);
    });
    if let Some(fits) = of.recorded {
        page.section("recorded", "Recorded data", |section| {
            recorded(section, fits);
        });
    }
    page.section("reading", "How to read it", |section| reading(section, of));
    files.push(("tables/scores.csv".to_owned(), scores.csv_as_shown()));
    files.push(("report.html".to_owned(), page.html()));
    files
}

fn introduction(section: &mut Section, of: &SuitePage<'_>) {
    let suite = of.suite;
    section
        .question("How near do methods come to what a record can say, and how often do they fail?");
    let told = match suite.division {
        Division::Closed | Division::Orders | Division::Structure => {
            "The distance d of an estimate from the truth is measured with the Fisher information of the record: for a \
             method that reaches the Cramer-Rao bound it is 1 on average in a long record. Each method is told the \
             orders of the truth in its own form; one that takes the order alone is not told the delay."
        }
        Division::Open => {
            "Methods choose their order. d is the squared error of the response over what it is on average at the \
             Cramer-Rao bound."
        }
    };
    section.paragraph(told);
    let unfinished = match suite.division {
        Division::Closed | Division::Orders | Division::Structure => {
            "ends its search without a minimum, or leaves an unstable model or one of another order"
        }
        Division::Open => "leaves an unstable model",
    };
    section.paragraph(&format!(
        "A run that fails, {unfinished} is lost: infinitely far, and in every denominator. Options are the defaults. \
         No number depends on who else takes part. 0.88(3) is 0.88 with Monte-Carlo standard error 0.03; methods share \
         their records, so differences between them are known better than two such errors say."
    ));
    let scenarios = suite.scenarios().count();
    section.settings(&[
        ("suite", suite.manifest.edition.clone()),
        ("tier", suite.tier.to_string()),
        ("scenarios", scenarios.to_string()),
        ("runs in each", grouped(suite.trials())),
        (
            "methods taking part",
            of.methods
                .iter()
                .filter(|of| of.method != IDEAL)
                .count()
                .to_string(),
        ),
        ("program", format!("asobench {}", env!("CARGO_PKG_VERSION"))),
    ]);
    section.paragraph("This command prints every number of the tables:");
    section.code(of.command);
}

/// The open division.
fn choosing(section: &mut Section, open: &SuitePage<'_>, files: &mut Files) {
    section.paragraph(
        "Here methods are told the delay and that the order is at most 6, and choose by BIC; `kernel-fir` needs no \
         order. There is no common theta, so d is the squared error of the impulse response, or of the frequency \
         response over all frequencies, over what it is on average at the Cramer-Rao bound of the true structure. \
         `pem-from-truth` is told that structure.",
    );
    let tables = Tables::new(open);
    let scores = tables.scores();
    let (picture, caption) = pictures::overview(open);
    section.figure(&picture, &caption);
    files.push(("figures/suite-choosing.svg".to_owned(), picture.wide.svg()));
    section.table(&scores);
    pictured(section, open, files);
    for table in tables.difficulties().into_iter().chain(tables.reasons()) {
        section.table(&table);
    }
    files.push(("tables/choosing.csv".to_owned(), scores.csv_as_shown()));
}

/// The distributions of each method.
fn pictured(section: &mut Section, of: &SuitePage<'_>, files: &mut Files) {
    for (name, picture, caption) in pictures::distributions(of) {
        section.figure(&picture, &caption);
        files.push((format!("figures/suite-{name}.svg"), picture.wide.svg()));
    }
}

/// The appendix of recorded data.
fn recorded(section: &mut Section, fits: &RecordedFits) {
    section.paragraph(
        "Models of the methods that choose their order, from the first samples of records of real plants, and their \
         FIT over the rest. One record has one noise, so these numbers have no Monte-Carlo error and rank no method. \
         Their command is `asobench suite recorded`.",
    );
    for table in recorded_tables(fits) {
        section.table(&table);
    }
    let about = fits
        .records
        .iter()
        .map(|of| format!("{}: {}", of.file, of.about.join("; ")));
    section.list(&about.collect::<Vec<_>>());
}

fn reading(section: &mut Section, of: &SuitePage<'_>) {
    if let Some(times) = of.times {
        section.paragraph(&format!(
            "Time: that of an estimate on one thread over that of `{REFERENCE}` in the same scenario, all methods in \
             turns; the geometric mean over scenarios of the median over rounds. A run of more than {TIME_LIMIT} s is \
             lost. Measured by {}, apart from the results, which hold no times: `asobench suite times`.",
            times.program
        ));
    }
    section.list(&[
        "d = (theta_hat - theta)' F (theta_hat - theta) / p, with F the Fisher information of the record about the p \
         free coefficients of the plant, the noise's unknown.",
        "Pictures: the share of runs within d. A curve ends at the share of runs that are within d = 10,000. One curve \
         is the law of an efficient method, chi-squared(p)/p; `pem-from-truth` is the prediction error \
         method of the scenario's structure that starts its search at the truth: where it leaves the law, the record \
         is too short for the law, or its search ends at a boundary. Bands are 95 % Monte-Carlo intervals.",
        "A method of another structure than the truth's has a bound of its own, which may be far from 1. In noise 1/A \
         the bound knows that plant and noise share A: `arx` is efficient there, and methods with separate \
         polynomials, such as `oe` and `bj`, cannot be. In white noise it is the other way round.",
        "Lost, by reason: `boundary` and `iteration-limit`, a search came to no minimum, which one-step methods \
         cannot; `declined`, the method cannot serve the scenario; `other orders`, its model has another order than it \
         was told.",
        "Methods with the same numbers are the same here: `rls` without forgetting is `arx`, and so is \
         `iv-compensated`, which is told that u and y have none. `wnsf` and `rpem` are told a model B/F; with \
         `-structure` they are told that of the truth too.",
        "Efficiency: the quantile of d that the bound has over that of the method, for a typical run (median) and for \
         the worst tenth (90 % quantile), averaged over scenarios with equal weights: 1 is the bound, 0 says that half \
         (or a tenth) of the runs is lost. Values above 1 are Monte-Carlo error or bias towards the truth.",
        "Coverage: how many of the 95 % intervals of the coefficients hold the truth, none in a lost run, over the \
         scenarios in which the method gives intervals.",
        "FIT: the median of the simulated FIT on fresh data without noise, 0 where it is below.",
        "What it does not say: what an expert's options would give; anything of outliers, unknown delays or irregular \
         sampling. All that is said of closed loops rests on two systems.",
        "The page of `asobench suite run` has a report of every study, and links each number of a scenario to it.",
    ]);
}
