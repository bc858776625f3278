//! The page of the suite in headless Chromium: nothing wider than its box without a hint, names in view, columns that
//! sort. Without a browser these tests say so and pass; where CI is set they fail.

use crate::common::browser::{browser, frames, seen};
use crate::common::done_in;

/// The words of a page on itself in a frame of some width.
const MEASURE: &str = r##"
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
"##;

#[test]
fn the_page_fits_a_desk_and_a_telephone() {
    let Some(browser) = browser() else {
        return;
    };
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path();
    done_in(folder, &["suite", "scores", "--tier", "standard", "--page", "page"]);
    let folder = &folder.join("page");
    // The script with the page's hash runs, and finds the tables that are wider than their boxes.
    let untouched = seen(browser, folder, "report.html", "light");
    assert_eq!(untouched.console, Vec::<String>::new());
    assert!(untouched.document.contains("class=\"wide scrolls\""));
    let said = frames(browser, folder, "report.html", MEASURE);
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
    let desk = &said[1];
    // Two tables and what to use when stand on the first screen or two; then what the words mean.
    assert!(desk["words"].as_f64().expect("a place") < 1800.0, "{}", desk["words"]);
}
