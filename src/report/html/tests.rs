use super::*;
use crate::report::markup::elements;
use crate::report::plot::{Plot, PlotAxis, Point, Series, Style};

/// The body of a page without its script. It is well-formed XML, which HTML need not be.
fn body(html: &str) -> &str {
    let start = html.find("<body>").unwrap();
    let end = html.find("<script>").unwrap();
    &html[start + "<body>".len()..end]
}

fn page() -> Page {
    let mut page = Page::new("A <b> & \"c\"");
    page.introduction(|s| s.settings(&[("seed", "2023"), ("<i>", "</i>")]));
    let plot = Plot::new("t", PlotAxis::linear("k"), PlotAxis::linear("e"))
        .series(Series::new("a", Style::Line, vec![Point::new(0.0, 1.0)]))
        .svg();
    for id in ["c1", "c 2", "c 2", ""] {
        page.section(id, "Claim `x<y` & more", |s| {
            s.question("Is it <so>?");
            s.answer(Verdict::HoldsInPart, "N > 98 & `a<b`");
            s.heading("<h>");
            s.list(&["<li>", "`"]);
            s.figure(&format!("<?xml version=\"1.0\"?>\n{plot}"), "e < 1");
            s.details("more <of> it", |s| {
                s.table(&Table::new("t", vec![Column::text("a")]));
                s.code("a < b && c | d\n");
            });
            s.table(&Table::new("t", vec![Column::text("a")]));
            s.files(&[("t.csv", "tables/t \"1\".csv")]);
            s.paragraph("</section>");
        });
    }
    page
}

#[test]
fn a_page_is_well_formed_and_escaped() {
    let html = page().html();
    let names = elements(body(&html)).unwrap();
    let count = |wanted: &str| names.iter().filter(|name| *name == wanted).count();
    assert_eq!(count("section"), 4);
    assert_eq!(count("table"), 8);
    assert_eq!(count("figure"), 4);
    assert!(html.contains("<h1>A &lt;b&gt; &amp; &quot;c&quot;</h1>"));
    assert!(html.contains("<code>x&lt;y</code> &amp; more"));
    assert!(html.contains("<p>&lt;/section&gt;</p>"));
    assert!(html.contains("a &lt; b &amp;&amp; c | d</code>"));
}

#[test]
fn ids_are_unique_and_every_link_inside_the_page_has_a_target() {
    let html = page().html();
    let parts = |mark: &str| -> Vec<String> {
        let parts = html.split(mark).skip(1);
        parts
            .map(|part| part.split('"').next().unwrap().to_owned())
            .collect()
    };
    let ids = parts(" id=\"");
    assert_eq!(ids, ["contents", "c1", "c-2", "c-2-2", "-2"]);
    for target in parts("href=\"#") {
        assert!(ids.contains(&target), "{target}");
    }
}

#[test]
fn tables_and_figures_are_numbered_through() {
    let html = page().html();
    for i in 1..=8 {
        assert_eq!(html.matches(&format!("<b>Table {i}.</b>")).count(), 1);
    }
    for i in 1..=4 {
        assert_eq!(html.matches(&format!("<b>Figure {i}.</b>")).count(), 1);
    }
}

#[test]
fn a_page_loads_nothing_and_has_the_style_of_figures_once() {
    let html = page().html();
    assert_eq!(html.matches(plot::STYLE).count(), 1);
    assert!(!html.contains("<?xml"));
    let addresses = html.matches("http").count();
    let namespaces = html.matches("http://www.w3.org/2000/svg").count();
    assert_eq!(addresses, namespaces + html.matches("http-equiv").count());
    for loader in [" src=", "@import", "url("] {
        assert!(!html.contains(loader), "{loader}");
    }
}

#[test]
fn verdicts_differ_in_words_and_signs() {
    let all = Verdict::ALL;
    for (i, a) in all.iter().enumerate() {
        for b in &all[..i] {
            assert!(a.name() != b.name() && a.sign() != b.sign());
        }
        assert!(a.badge().contains(a.name()) && a.badge().contains(a.sign()));
    }
}
