//! Sections and figures of made-up claims.

use super::*;
use crate::document::figure::Drawn;
use crate::document::tests::study;
use crate::html::Page;
use asobench_study::claim::{JudgedTest, Scale};

/// A claim "below 1" of a study. In turn the number of a cell is 0.5 and passes, 1 and is open, 2 and fails.
fn claim(study: &Study) -> Judged {
    let cell = |index: usize| {
        let (value, says) = [(0.5, "pass"), (1.0, "open"), (2.0, "fail")][index % 3];
        JudgedCell {
            case: None,
            cells: vec![index],
            place: study.summary.cells[index].place().words(&study.varying()),
            says,
            p_pass: 0.5,
            p_fail: 0.5,
            level: Some(0.025),
            numbers: vec![JudgedNumber {
                test: 0,
                what: "the ratio of one to another".to_owned(),
                text: format!("{value}"),
                value,
                error: 0.01,
                interval: [value - 0.02, value + 0.02],
                kept: None,
            }],
            missing: Vec::new(),
        }
    };
    Judged {
        standing: asobench_study::claim::Standing::Planned,
        added_after_run: false,
        id: "W1".to_owned(),
        text: "One is better than another.".to_owned(),
        source: "own".to_owned(),
        verdict: asobench_study::claim::Verdict::DoesNotHold,
        level: 0.025,
        line: "W1  does not hold: the ratio is 2.00(1), not below 1.".to_owned(),
        needed: None,
        timed: false,
        tests: vec![JudgedTest {
            what: "the ratio of one to another".to_owned(),
            must: "below 1".to_owned(),
            limits: [f64::NEG_INFINITY, 1.0],
            scale: Scale::Ratio,
        }],
        cells: (0..study.summary.cells.len()).map(cell).collect(),
    }
}

fn grid(settings: &str) -> Study {
    study(&format!("measures = [\"e_a\"]\n[settings]\n{settings}"))
}

fn picture(study: &Study, claim: &Judged) -> Drawn {
    let mut all = pictures(study, claim);
    assert_eq!(all.len(), 1);
    all.remove(0)
}

/// Number of markers of a class without the one in the legend; triangles and squares are paths.
fn marks(svg: &str, class: &str) -> usize {
    svg.matches(&format!("<path class=\"f {class}\"")).count() - 1
}

#[test]
fn few_cells_have_a_row_each() {
    let study = grid("window = [58, 98, 218]");
    let Drawn { picture, caption, .. } = picture(&study, &claim(&study));
    let svg = picture.wide.svg();
    for text in [
        "N = 58",
        "N = 98",
        "N = 218",
        "certainly passes",
        "certainly fails",
        ">open<",
    ] {
        assert!(svg.contains(text), "no '{text}'");
    }
    assert_eq!([marks(&svg, "s2"), marks(&svg, "s1")], [1, 1]);
    assert_eq!(svg.matches("<rect class=\"f s2\"").count(), 1, "the shaded side");
    assert!(
        caption.contains("Numbers in the shaded range pass: below 1."),
        "{caption}"
    );
}

#[test]
fn more_cells_have_panels_over_the_setting_that_varies_most() {
    let study = grid("eta = { logspace = [1, 30, 19] }\nnoise = [\"ar\", \"white\"]\nwindow = [98, 218]");
    let Drawn { picture, .. } = picture(&study, &claim(&study));
    let svg = picture.wide.svg();
    assert_eq!(svg.matches("<rect class=\"f s2\"").count(), 4, "panels");
    // 76 cells: 26 pass, 25 are open, 25 fail.
    assert_eq!([marks(&svg, "s2"), marks(&svg, "s1")], [26, 25]);
    assert!(svg.contains("eta, %") && svg.contains("N = 98, 1/A noise"));
}

#[test]
fn many_cells_are_thinned_and_no_verdict_is_lost() {
    let study = grid("eta = { linspace = [1, 20, 40] }\namplitude = { linspace = [1, 9, 25] }");
    let Drawn { picture, caption, .. } = picture(&study, &claim(&study));
    let svg = picture.wide.svg();
    assert!(caption.starts_with("200 of 1000 cells"), "{caption}");
    assert!(svg.len() < 150_000, "{}", svg.len());
    // A third of the cells for each, as among all.
    for class in ["s2", "s1"] {
        assert!((66..=68).contains(&marks(&svg, class)), "{class}");
    }
}

#[test]
fn what_cannot_be_drawn_is_counted() {
    let study = grid("window = [58, 98, 218]");
    let mut claim = claim(&study);
    claim.cells[1].numbers[0].value = f64::INFINITY;
    claim.cells[2].numbers.clear();
    claim.cells[2].missing.push("the run did not keep it".to_owned());
    let Drawn { picture, caption, .. } = picture(&study, &claim);
    let svg = picture.wide.svg();
    assert!(caption.contains("Not drawn: 2 cells"), "{caption}");
    assert_eq!([marks(&svg, "s2"), svg.matches("<path class=\"f s1\"").count()], [1, 0]);
    let table = cells(&claim).take_csv();
    assert!(table.contains("N = 218,the run did not keep it,,-,fail"), "{table}");
}

/// A part has the claim, its verdict in words, the sentence without them, a figure and a table. Texts of users are
/// escaped.
#[test]
fn a_part_tells_one_claim() {
    let mut study = grid("window = [58, 98, 218]");
    let mut own = claim(&study);
    own.id = "../<W1>".to_owned();
    own.text = "<script>".to_owned();
    own.line = own.line.replace("W1", &own.id);
    study.judged = vec![own];
    let mut files = Files::new();
    let mut page = Page::new("");
    page.section("many", "", |section| verdicts(section, &study, &mut files));
    let html = page.html();
    for text in [
        "<article id=\"many:../&lt;W1&gt;\">",
        "does not hold</span></h3>",
        "<p>The ratio is 2.00(1), not below 1.</p>",
        "&lt;script&gt;",
        "<td class=\"n\">0.5</td><td>pass</td>",
    ] {
        assert!(html.contains(text), "no '{text}'");
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "figures/many-claim-~2e.~2f~3cW1~3e.svg",
            "tables/many-claim-~2e.~2f~3cW1~3e.csv",
            "tables/many-claim-~2e.~2f~3cW1~3e.tex",
            "tables/many-claim-~2e.~2f~3cW1~3e-paper.csv"
        ]
    );
}

/// The caption says at which levels the bars are drawn: those of the cells' marks. Of three cells one passes and one
/// fails, so Holm's correction ended at half the level both ways.
#[test]
fn a_caption_has_the_levels_of_the_marks() {
    let study = grid("window = [58, 98, 218]");
    let mut claim = claim(&study);
    let at = |claim: &mut Judged, levels: [f64; 3]| {
        for (cell, level) in claim.cells.iter_mut().zip(levels) {
            cell.level = Some(level);
        }
    };
    at(&mut claim, [0.0125; 3]);
    let text = picture(&study, &claim).caption;
    assert!(
        text.contains("at most 2.5 % / 2 (Holm's correction for 3 cells)."),
        "{text}"
    );
    at(&mut claim, [0.0125, 0.0125, 0.025]);
    let text = picture(&study, &claim).caption;
    let parts = "2.5 % / 2 where a cell passes, 2.5 % where it fails, 2.5 % / 2 where it is open \
                 (Holm's correction for 3 cells).";
    assert!(text.contains(parts), "{text}");
    let table = cells(&claim).take_csv();
    assert!(
        table.lines().any(|line| line.ends_with(",fail,0.5,0.5,0.025")),
        "{table}"
    );
    // A first look has nine tenths of the level, whose product is no short number.
    claim.level = 0.9 * 0.025;
    at(&mut claim, [0.9 * 0.0125; 3]);
    let text = picture(&study, &claim).caption;
    assert!(text.contains("at most 2.25 % / 2 (Holm's"), "{text}");
    claim.level = 0.025;
    for cell in &mut claim.cells {
        (cell.says, cell.level) = ("pass", Some(0.025));
    }
    let text = picture(&study, &claim).caption;
    assert!(
        text.contains("2.5 % (all cells are certain, so none is corrected)."),
        "{text}"
    );
}

/// Tests with one condition share a picture, with a row for each number; others have their own.
#[test]
fn a_claim_about_one_cell_has_one_picture() {
    let study = grid("window = 98");
    let mut claim = claim(&study);
    claim.cells.truncate(1);
    for (i, what) in [(1, "the ratio of one to third"), (2, "the ratio of one to fourth")] {
        let mut test = claim.tests[0].clone();
        test.what = what.to_owned();
        claim.tests.push(test);
        let mut number = claim.cells[0].numbers[0].clone();
        (number.test, number.what) = (i, what.to_owned());
        claim.cells[0].numbers.push(number);
    }
    let svg = picture(&study, &claim).picture.wide.svg();
    for text in [
        ">another<",
        ">third<",
        ">fourth<",
        ">W1 does not hold<",
        ">Ratio of one<",
        ">must be below 1 (shaded)<",
    ] {
        assert!(svg.contains(text), "no '{text}': {svg}");
    }
    claim.tests[2].limits = [f64::NEG_INFINITY, 2.0];
    assert_eq!(pictures(&study, &claim).len(), 2);
}

/// Of two numbers of a cell, of which the first passes and the second fails, many cells show the second.
#[test]
fn many_cells_draw_the_number_that_decides() {
    let study = grid("eta = { logspace = [1, 30, 19] }");
    let mut claim = claim(&study);
    let mut test = claim.tests[0].clone();
    "the ratio of one to third".clone_into(&mut test.what);
    claim.tests.push(test);
    for cell in &mut claim.cells {
        cell.says = "fail";
        let number = |test: usize, value: f64| JudgedNumber {
            test,
            value,
            interval: [value - 0.02, value + 0.02],
            ..cell.numbers[0].clone()
        };
        cell.numbers = vec![number(0, 0.5), number(1, 2.0)];
    }
    let Drawn { picture, caption, .. } = picture(&study, &claim);
    let svg = picture.wide.svg();
    assert_eq!(marks(&svg, "s1"), 19);
    assert!(!svg.contains("certainly passes"), "{svg}");
    assert!(caption.contains("the one that decides is drawn"), "{caption}");
    assert!(svg.contains(">One is better than another.<"), "{svg}");
}

/// A bar without an end runs off the picture, and does not widen it.
#[test]
fn a_bar_without_an_end_is_cut() {
    let study = grid("window = [58, 98, 218]");
    let mut claim = claim(&study);
    assert!(!picture(&study, &claim).caption.contains("edge"));
    claim.cells[1].numbers[0].interval = [0.0, f64::INFINITY];
    let Drawn { picture, caption, .. } = picture(&study, &claim);
    let svg = picture.wide.svg();
    assert!(caption.contains("A bar to the edge"), "{caption}");
    assert!(!svg.contains("inf") && !svg.contains("NaN"));
    assert_eq!(marks(&svg, "s2"), 1);
}

/// Words that all texts begin or end with are left away.
#[test]
fn only_what_differs_names_a_row() {
    let all = ["the coverage of a_1 of arx,", "the coverage of h_2 of arx,"];
    assert_eq!(super::picture::different("the coverage of a_1 of arx", &all), "a_1");
    assert_eq!(super::picture::different("x", &["x", "x"]), "");
    assert_eq!(super::picture::different("a a", &["a a", "a a a"]), "");
}
