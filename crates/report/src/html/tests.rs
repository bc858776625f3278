use super::*;
use crate::plot::{Plot, PlotAxis, Point, Series, Style};
use crate::tests::xml::elements;

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
        .picture();
    for id in ["c1", "c 2", "c 2", ""] {
        page.section(id, "Claim `x<y` & more", |s| {
            s.question("Is it <so>?");
            s.answer(Verdict::HoldsInPart, "N > 98 & `a<b`");
            s.heading("<h>");
            s.list(&["<li>", "`"]);
            s.figure(&plot, "e < 1");
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
        parts.map(|part| part.split('"').next().unwrap().to_owned()).collect()
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
            assert!(a.name() != b.name() && verdict::look(*a)[1] != verdict::look(*b)[1]);
        }
        assert!(badge(*a).contains(a.name()) && badge(*a).contains(verdict::look(*a)[1]));
    }
}

/// SHA-256, FIPS 180-4.
fn sha256(text: &[u8]) -> [u8; 32] {
    let primes = (2u32..).filter(|n| (2..*n).all(|d| n % d != 0));
    let primes: Vec<f64> = primes.take(64).map(f64::from).collect();
    let fraction = |root: f64| (root.fract() * f64::from(2.0f32.powi(32))) as u32;
    let k: Vec<u32> = primes.iter().map(|p| fraction(p.cbrt())).collect();
    let mut h: Vec<u32> = primes[..8].iter().map(|p| fraction(p.sqrt())).collect();
    let mut padded = text.to_vec();
    padded.push(0x80);
    while padded.len() % 64 != 56 {
        padded.push(0);
    }
    padded.extend((8 * text.len() as u64).to_be_bytes());
    for chunk in padded.chunks(64) {
        let words = chunk.chunks(4);
        let mut w: Vec<u32> = words.map(|word| u32::from_be_bytes(word.try_into().unwrap())).collect();
        for i in 16..64 {
            let (x, y) = (w[i - 15], w[i - 2]);
            let s0 = x.rotate_right(7) ^ x.rotate_right(18) ^ (x >> 3);
            let s1 = y.rotate_right(17) ^ y.rotate_right(19) ^ (y >> 10);
            let sum = w[i - 16].wrapping_add(s0).wrapping_add(w[i - 7]);
            w.push(sum.wrapping_add(s1));
        }
        let mut v = h.clone();
        for i in 0..64 {
            let (a, e) = (v[0], v[4]);
            let s1 = e.rotate_right(6) ^ e.rotate_right(11) ^ e.rotate_right(25);
            let choice = (e & v[5]) ^ (!e & v[6]);
            let first = v[7].wrapping_add(s1).wrapping_add(choice);
            let first = first.wrapping_add(k[i]).wrapping_add(w[i]);
            let s0 = a.rotate_right(2) ^ a.rotate_right(13) ^ a.rotate_right(22);
            let majority = (a & v[1]) ^ (a & v[2]) ^ (v[1] & v[2]);
            v.rotate_right(1);
            v[0] = first.wrapping_add(s0).wrapping_add(majority);
            v[4] = v[4].wrapping_add(first);
        }
        h.iter_mut().zip(v).for_each(|(h, v)| *h = h.wrapping_add(v));
    }
    let bytes: Vec<u8> = h.iter().flat_map(|h| h.to_be_bytes()).collect();
    bytes.try_into().unwrap()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |chunk: &[u8]| {
        let mut three = [0; 3];
        three[..chunk.len()].copy_from_slice(chunk);
        let bits = u32::from_be_bytes([0, three[0], three[1], three[2]]);
        let digit = |i: usize| DIGITS[(bits >> (18 - 6 * i)) as usize & 63] as char;
        (0..4)
            .map(|i| if i > chunk.len() { '=' } else { digit(i) })
            .collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

/// A browser runs the page's own script and no other, whatever text a page shows.
#[test]
fn only_the_own_script_is_allowed() {
    // The example of FIPS 180-4 (NIST's SHA256.pdf), `printf abc | openssl dgst -sha256 -binary | base64`.
    assert_eq!(base64(&sha256(b"abc")), "ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
    let html = page().html();
    let (_, script) = html.split_once("<script>").unwrap();
    let (script, rest) = script.split_once("</script>").unwrap();
    assert!(!rest.contains("<script"));
    let policy = format!("script-src 'sha256-{}';", base64(&sha256(script.as_bytes())));
    assert!(html.contains(&policy), "{policy}");
    assert!(!html.contains("script-src 'unsafe-inline'"));
    assert!(!elements(body(&html)).unwrap().iter().any(|name| name == "script"));
}
