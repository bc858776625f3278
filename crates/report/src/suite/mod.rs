//! The page of the reference suite, and its tables: readers of the results of methods, each of which stands for itself.

mod pictures;
mod subject;
mod tables;

use super::folder::Files;
use super::html::{Page, Section};
use super::table::Table;
use asobench_study::suite::IDEAL;
use asobench_study::text::grouped;
pub use subject::SuitePage;
use tables::Tables;

/// The tables of the suite's page, in its order.
pub fn suite_tables(of: &SuitePage<'_>) -> Vec<Table> {
    let tables = Tables::new(of);
    let mut all = vec![tables.scores()];
    all.extend(tables.against());
    all.extend(tables.difficulties());
    all.push(tables.scenarios());
    all.extend(tables.efficiencies());
    all
}

/// The files of the suite's page.
pub fn suite_page(of: &SuitePage<'_>) -> Files {
    let suite = of.suite;
    let tables = Tables::new(of);
    let title = format!(
        "asobench report: reference suite {}, tier {}",
        suite.manifest.edition, suite.tier
    );
    let mut page = Page::new(title);
    page.introduction(|section| introduction(section, of));
    let mut files = Files::new();
    let scores = tables.scores();
    page.section("all", "All scenarios", |section| {
        for (i, (name, picture, caption)) in pictures::distributions(of).into_iter().enumerate() {
            section.figure(&picture, &caption);
            files.push((format!("figures/suite-{name}.svg"), picture.wide.svg()));
            if i == 0 {
                section.table(&scores);
            }
        }
        section.paragraph(
            "A method that is *below the bound* has d smaller than an unbiased estimate can have: it is biased \
             towards the truth, or knows what it should not. A method that serves a scenario's structure only in part \
             is told the smallest orders of its own form that hold the truth.",
        );
    });
    if let Some(against) = tables.against() {
        page.section("newcomer", "The newcomer beside the others", |section| {
            section.table(&against);
        });
    }
    page.section("difficulty", "What is hard for whom", |section| {
        for table in tables.difficulties() {
            section.table(&table);
        }
    });
    page.section("scenarios", "Scenario by scenario", |section| {
        section.table(&tables.scenarios());
        for table in tables.efficiencies() {
            section.table(&table);
        }
    });
    page.section("reading", "How to read it", reading);
    files.push(("tables/scores.csv".to_owned(), scores.csv_as_shown()));
    files.push(("report.html".to_owned(), page.html()));
    files
}

fn introduction(section: &mut Section, of: &SuitePage<'_>) {
    let suite = of.suite;
    section
        .question("How near do methods come to what a record can say, and how often do they fail?");
    section.paragraph(
        "The distance d of an estimate from the truth is measured with the Fisher information of the record: for a \
         method that reaches the Cramer-Rao bound it is 1 on average in a long record. A run that fails or leaves an \
         unstable model is lost: infinitely far, and in every denominator. Every method is told the same orders and has its \
         default options. No number depends on who else takes part. 0.88(3) is 0.88 with Monte-Carlo standard error 0.03.",
    );
    let scenarios = suite.scenarios().count();
    let runs = scenarios as u64 * suite.trials();
    section.settings(&[
        ("suite", suite.manifest.edition.clone()),
        ("tier", suite.tier.to_string()),
        ("scenarios", scenarios.to_string()),
        ("runs of each method", grouped(runs)),
        (
            "estimators",
            of.methods
                .iter()
                .filter(|of| of.method != IDEAL)
                .count()
                .to_string(),
        ),
        ("program", format!("asobench {}", env!("CARGO_PKG_VERSION"))),
    ]);
    section.paragraph("This command prints every number of the page:");
    section.code(of.command);
}

fn reading(section: &mut Section) {
    section.list(&[
        "d = (theta_hat - theta)' F (theta_hat - theta) / p, with F the Fisher information of the record about the p free \
         coefficients of the plant, the noise's unknown.",
        "Pictures: the share of runs within d. A curve ends at the share of runs that was kept. One curve is \
         the law of an efficient method, chi-squared(p)/p; `pem-from-truth` is the prediction error \
         method of the scenario's structure that starts its search at the truth: where it leaves the law, the record is too \
         short for the law, and where a method leaves it, the method is at fault. Bands are 95 % Monte-Carlo intervals.",
        "Lost: the share of runs that failed or left an unstable model.",
        "Efficiency: the quantile of d that the bound has over that of the method, for a typical run (median) and for the \
         worst tenth (90 % quantile), averaged over scenarios with equal weights: 1 is the bound, 0 says that half (or a tenth) \
         of the runs is lost.",
        "Coverage: how many of the 95 % intervals of the coefficients hold the truth, none in a lost run.",
        "FIT: the median of the simulated FIT on fresh data without noise, 0 where it is below.",
        "What it does not say: how methods choose orders, what an expert's options would give, or how long it takes.",
    ]);
}
