//! The page of the suite in headless Chromium: nothing wider than its box without a hint, names in view, columns that
//! sort. Without a browser these tests say so and pass; where CI is set they fail.

use crate::common::done_in;
use std::path::Path;
use std::process::{Command, Stdio};

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// A script by which a page in a frame of some width tells its measures to the page around it: [`measured`].
const MEASURE: &str = r##"<script>
addEventListener("load", () => {
  const tables = [...document.querySelectorAll(".wide > table")].map((table) => {
    const box = table.parentElement;
    const over = box.scrollWidth - box.clientWidth;
    const hint = getComputedStyle(table.querySelector("caption span"), "::after").content;
    box.scrollLeft = box.scrollWidth;
    const name = table.querySelector("tbody td").getBoundingClientRect();
    const place = box.getBoundingClientRect();
    const named = name.left >= place.left - 1 && name.left + Math.min(name.width, 60) <= place.right;
    return { over, hint: hint.includes("scroll"), named };
  });
  const table = document.querySelector("#all table");
  const button = [...table.querySelectorAll("button")].find((of) => of.textContent.startsWith("median"));
  button.click();
  const column = [...table.tHead.rows[0].cells].findIndex((of) => of.contains(button));
  const sorted = [...table.tBodies[0].rows].map((row) => parseFloat(row.cells[column].textContent));
  const top = (id) => document.getElementById(id).getBoundingClientRect().top + scrollY;
  const page = document.documentElement;
  const over = page.scrollWidth - page.clientWidth;
  parent.postMessage({ width: innerWidth, over, tables, sorted, words: top("words") }, "*");
});
</script></body>"##;

/// The page around frames of two widths, which collects what they say.
const FRAMES: &str = r#"<!DOCTYPE html><body><pre id="said"></pre><script>
const said = [];
addEventListener("message", (event) => {
  said.push(event.data);
  document.getElementById("said").textContent = JSON.stringify(said);
});
</script>
<iframe src="measured.html" style="width:1280px;height:900px;border:0"></iframe>
<iframe src="measured.html" style="width:400px;height:900px;border:0"></iframe>"#;

/// The name of a browser that runs; `None` where there is none.
fn browser() -> Option<&'static str> {
    let runs = |name: &&str| {
        let version = Command::new(name)
            .arg("--version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        version.is_ok_and(|status| status.success())
    };
    let found = BROWSERS.into_iter().find(runs);
    if found.is_none() {
        eprintln!("not tested: none of {BROWSERS:?} runs here");
        assert!(
            std::env::var("CI").map_or(true, |of| of.is_empty()),
            "CI needs a browser: one of {BROWSERS:?}"
        );
    }
    found
}

/// The document that a browser makes of a file, after its scripts.
fn document(browser: &str, folder: &Path, file: &str) -> String {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--window-size=1280,1000",
            "--virtual-time-budget=20000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", folder.join(file).display()))
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .expect("a browser");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The measures of the page at both widths.
fn measured(browser: &str, folder: &Path, page: &str) -> Vec<serde_json::Value> {
    // The policy of the page forbids other scripts than its own, such as that which measures.
    let (before, rest) = page.split_once("script-src '").expect("a policy");
    let (_, after) = rest.split_once('\'').expect("a hash");
    let open = format!("{before}script-src 'unsafe-inline'{after}");
    let measuring = open.replace("</body>", MEASURE);
    std::fs::write(folder.join("measured.html"), measuring).expect("written");
    std::fs::write(folder.join("frames.html"), FRAMES).expect("written");
    let document = document(browser, folder, "frames.html");
    let (_, said) = document.split_once("<pre id=\"said\">").expect("what was said");
    let (said, _) = said.split_once("</pre>").expect("all of it");
    serde_json::from_str(said).unwrap_or_else(|error| panic!("{error}: {said}"))
}

#[test]
fn the_page_fits_a_desk_and_a_telephone() {
    let Some(browser) = browser() else {
        return;
    };
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path();
    done_in(folder, &["suite", "scores", "--tier", "standard", "--page", "page"]);
    let folder = &folder.join("page");
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    // The script with the page's hash runs, and finds the tables that are wider than their boxes.
    let untouched = document(browser, folder, "report.html");
    assert!(untouched.contains("class=\"wide scrolls\""));
    let said = measured(browser, folder, &page);
    let mut widths: Vec<u64> = said.iter().filter_map(|of| of["width"].as_u64()).collect();
    widths.sort_unstable();
    assert_eq!(widths, [400, 1280]);
    for of in &said {
        let width = of["width"].as_u64().expect("a width");
        assert!(
            of["over"].as_i64().expect("a number") <= 1,
            "{width}: the page itself scrolls"
        );
        let tables = of["tables"].as_array().expect("tables");
        assert!(tables.len() > 10, "{}", tables.len());
        for (number, table) in (1..).zip(tables) {
            let is_wide = table["over"].as_i64().expect("a number") > 1;
            assert_eq!(table["hint"], is_wide, "{width}: table {number}: {table}");
            assert_eq!(table["named"], true, "{width}: table {number}: {table}");
        }
        let sorted: Vec<f64> = of["sorted"]
            .as_array()
            .expect("numbers")
            .iter()
            .filter_map(serde_json::Value::as_f64)
            .collect();
        assert!(sorted.len() > 10 && sorted.is_sorted(), "{sorted:?}");
    }
    let desk = said.iter().find(|of| of["width"] == 1280).expect("a desk");
    // Two tables and what to use when stand on the first screen or two; then what the words mean.
    assert!(desk["words"].as_f64().expect("a place") < 1800.0, "{}", desk["words"]);
}
