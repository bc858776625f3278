//! Every number in the prose about results stands in the committed results.
//!
//! A number that is a result is followed by a comment that says where it stands, either a table's
//! cell or the words of a text that end with it:
//!
//! ```text
//! 31 %<!-- convergence-overview.csv: 998,30,white,IV(4): failed --> of the trials fail
//! at a level of 2.8 %<!-- claims.md: the medians at eta = 2.82 -->
//! ```
//!
//! Texts are of `results/report`, tables of its `tables`. A row is told by its first cells (`*` is
//! any cell), a column by its heading without the unit; `least` or `greatest` before it is of
//! several rows. `claims.md: number of claims` and `number of studies` are counts. The number shown
//! is the value rounded to as many decimals.

use super::read;
use std::collections::BTreeSet;

/// Sections that hold no results: numbers there are formulas, settings, limits, what is quoted, results of older
/// versions, and times of one machine that the commands beside them print. `*` is a whole page.
const WITHOUT_RESULTS: [(&str, &str); 29] = [
    ("README.md", "asobench"),
    ("README.md", "Four things to do"),
    ("README.md", "Why trust it"),
    ("README.md", "Beside other programs"),
    ("README.md", "Install"),
    ("README.md", "The parts"),
    ("docs/README.md", "*"),
    ("docs/claims.md", "*"),
    ("docs/cluster.md", "*"),
    ("docs/conventions.md", "*"),
    ("docs/files.md", "*"),
    ("docs/findings.md", "How far to trust these verdicts"),
    ("docs/formats.md", "*"),
    ("docs/glossary.md", "*"),
    ("docs/methods.md", "*"),
    ("docs/observers.md", "*"),
    ("docs/performance.md", "*"),
    ("docs/protocol.md", "*"),
    ("docs/python.md", "*"),
    ("docs/records.md", "*"),
    ("docs/reference.md", "*"),
    ("docs/reproduce.md", "One trial again"),
    ("docs/reproduce.md", "Sentence by sentence"),
    ("docs/reproduce.md", "The papers"),
    ("docs/studies.md", "*"),
    ("docs/suite.md", "*"),
    ("docs/theory.md", "*"),
    ("experiments/README.md", "*"),
    ("results/README.md", "*"),
];

/// Settings and limits of the program, in words that have a number.
const TERMS: [&str; 3] = ["10 % band", "four passes", "Four passes"];

/// Numbers in words, but those that are pronouns and articles too.
const WORDS: [&str; 21] = [
    "half", "third", "quarter", "fifth", "tenth", "twice", "thrice", "three", "four", "five", "six", "seven", "eight",
    "nine", "ten", "twelve", "twenty", "dozen", "hundred", "thousand", "million",
];

/// Units of what is not a result: the time that a command takes.
const TIMES: [&str; 3] = ["minutes", "seconds", "cores"];

/// A word of the prose, or a mark: what stands in a comment.
#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    Mark(String),
}

/// A section's heading and its prose, without code, pictures, targets of links.
struct Section {
    heading: String,
    prose: String,
}

/// The sections of a page. Rows of tables that are committed results are left out.
fn sections(page: &str, committed: &str) -> Vec<Section> {
    let mut sections = vec![Section {
        heading: String::new(),
        prose: String::new(),
    }];
    let mut is_code = false;
    // A comment of `.ci/docs`, about the block below it or a command, marks no number.
    let of_blocks = ["file", "append", "run", "not run"].map(|word| format!("<!-- {word}: "));
    let lines = page.lines();
    let lines = lines.filter(|line| !of_blocks.iter().any(|comment| line.starts_with(comment)));
    for line in lines {
        if line.starts_with("```") {
            is_code = !is_code;
        } else if let (false, Some(heading)) = (is_code, line.strip_prefix('#')) {
            sections.push(Section {
                heading: heading.trim_start_matches('#').trim().to_owned(),
                prose: String::new(),
            });
        } else if !is_code && !line.starts_with("    ") && !is_committed_row(line, committed) {
            let section = sections.last_mut().expect("the first one");
            section.prose.push_str(without_item(line));
            section.prose.push('\n');
        }
    }
    for section in &mut sections {
        section.prose = without(&section.prose, "![", ")");
        section.prose = without(&section.prose, "](", ")");
        section.prose = without(&section.prose, "`", "`");
        for term in TERMS {
            section.prose = section.prose.replace(term, "");
        }
    }
    sections
}

/// A line without the number of an item of a list.
fn without_item(line: &str) -> &str {
    match line.split_once(". ") {
        Some((item, text)) if item.parse::<u8>().is_ok() => text,
        _ => line,
    }
}

fn is_committed_row(line: &str, committed: &str) -> bool {
    line.starts_with('|') && committed.lines().any(|row| row == line)
}

/// A text without what stands between two signs, comments left as they are.
fn without(text: &str, from: &str, to: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(from) {
        if let Some(comment) = rest[..start].rfind("<!--")
            && let Some(end) = rest[comment..].find("-->")
            && comment + end > start
        {
            kept.push_str(&rest[..comment + end]);
            rest = &rest[comment + end..];
            continue;
        }
        let inner = start + from.len();
        let end = rest[inner..].find(to).expect("an end of code, a link or a picture");
        kept.push_str(&rest[..start]);
        kept.push(' ');
        rest = &rest[inner + end + to.len()..];
    }
    kept + rest
}

fn tokens(prose: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let words = |text: &str, tokens: &mut Vec<Token>| {
        tokens.extend(text.split_whitespace().map(|word| Token::Word(word.to_owned())));
    };
    let mut parts = prose.split("<!--");
    words(parts.next().unwrap_or_default(), &mut tokens);
    for part in parts {
        let (mark, text) = part.split_once("-->").expect("an end of a comment");
        let mark = mark.split_whitespace().collect::<Vec<_>>().join(" ");
        tokens.push(Token::Mark(mark));
        words(text, &mut tokens);
    }
    tokens
}

/// The number that a word is, as it is shown; not names such as C2 and 2n, nor (9), an equation or
/// a year, nor 1/A.
fn number(word: &str) -> Option<String> {
    let bare = word.trim_matches(|c: char| !c.is_alphanumeric());
    let is_reference = word.trim_end_matches(['.', ',', ';', ':']) == format!("({bare})");
    if WORDS.contains(&bare.to_lowercase().as_str()) {
        return Some(bare.to_owned());
    }
    let shown = bare.replace(',', "");
    let is_name = shown.parse::<f64>().is_err() && bare.contains(char::is_alphabetic);
    let is_number = bare.starts_with(|c: char| c.is_ascii_digit());
    (is_number && !is_name && !is_reference).then_some(shown)
}

/// Whether a number is what something is set to, or a time that a command takes.
fn is_setting(tokens: &[Token], at: usize) -> bool {
    let word = |at: Option<usize>| match at.and_then(|at| tokens.get(at)) {
        Some(Token::Word(word)) => word.as_str(),
        _ => "",
    };
    let after = word(Some(at + 1)).trim_end_matches(['.', ',', ';', ')']);
    ["=", "<", ">"].contains(&word(at.checked_sub(1))) || TIMES.contains(&after)
}

/// The mistakes in the numbers and marks of a section.
fn mistakes(prose: &str, has_results: bool, value: &dyn Fn(&str) -> Result<f64, String>) -> Vec<String> {
    let tokens = tokens(prose);
    let mut wrong = Vec::new();
    let mut used = 0;
    for (at, token) in tokens.iter().enumerate() {
        let Token::Word(word) = token else { continue };
        let Some(shown) = number(word) else { continue };
        let unit = usize::from(tokens.get(at + 1) == Some(&Token::Word("%".to_owned())));
        match tokens.get(at + 1 + unit) {
            Some(Token::Mark(mark)) => {
                used += 1;
                wrong.extend(compare(&shown, mark, value).err());
            }
            _ if has_results && !is_setting(&tokens, at) => {
                wrong.push(format!("'{word}' does not say where it stands in the results"));
            }
            _ => {}
        }
    }
    let marks = tokens.iter().filter(|token| matches!(token, Token::Mark(_))).count();
    if used < marks {
        wrong.push(format!("{} comments follow no number", marks - used));
    }
    wrong
}

/// Whether a value, rounded to the decimals that are shown, is what is shown.
fn compare(shown: &str, mark: &str, value: &dyn Fn(&str) -> Result<f64, String>) -> Result<(), String> {
    let found = value(mark)?;
    let decimals = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let limit = 0.5 * 0.1_f64.powi(i32::try_from(decimals).expect("few decimals"));
    let number: f64 = shown
        .parse()
        .map_err(|_| format!("'{shown}' ({mark}): not in digits"))?;
    if (found - number).abs() <= limit * (1.0 + 1e-9) {
        Ok(())
    } else {
        Err(format!("'{shown}' is {found} ({mark})"))
    }
}

/// The value that a mark tells of.
fn value(mark: &str) -> Result<f64, String> {
    let (file, place) = mark.split_once(": ").ok_or(format!("'{mark}': expected FILE: PLACE"))?;
    if let Some(name) = file.strip_suffix(".csv") {
        cell(&read(&format!("results/report/tables/{name}.csv")), place)
    } else {
        let page = read(&format!("results/report/{file}"));
        counted(&page, place).map_or_else(|| quoted(&page, place), Ok)
    }
}

/// The number of claims of a page of verdicts, or of their studies.
fn counted(page: &str, of: &str) -> Option<f64> {
    let rows = page.lines().filter(|line| line.starts_with("| "));
    let rows: Vec<&str> = rows.skip(2).collect();
    let studies: BTreeSet<&str> = rows.iter().filter_map(|row| row.rsplit(" | ").next()).collect();
    match of {
        "number of claims" => Some(rows.len() as f64),
        "number of studies" => Some(studies.len() as f64),
        _ => None,
    }
}

/// The number at the end of words that stand in a text.
fn quoted(text: &str, words: &str) -> Result<f64, String> {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut found = text.match_indices(words);
    let (at, _) = found.next().ok_or(format!("'{words}' does not stand there"))?;
    let rest = &text[at + words.len()..];
    let mut next = rest.chars();
    let goes_further = match next.next() {
        Some('.' | ',') => next.next().is_some_and(|c| c.is_ascii_digit()),
        Some(c) => c.is_ascii_digit(),
        None => false,
    };
    let number = words
        .rsplit(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)))
        .next();
    let number = number.and_then(|number| number.parse().ok());
    number
        .filter(|_| !goes_further && found.next().is_none())
        .ok_or(format!("'{words}' does not end with a number, or is not there once"))
}

/// The value in a table: `ROW: COLUMN`, `ROW: least COLUMN`, `ROW: greatest COLUMN`.
fn cell(table: &str, place: &str) -> Result<f64, String> {
    let (row, column) = place
        .split_once(": ")
        .ok_or(format!("'{place}': expected ROW: COLUMN"))?;
    let mut lines = table.lines().map(fields);
    let headings = lines.next().ok_or("an empty table")?;
    let extreme = ["least", "greatest"].map(|which| column.strip_prefix(&format!("{which} ")));
    let name = extreme.iter().flatten().next().unwrap_or(&column);
    let column = headings
        .iter()
        .position(|heading| heading.split(" (").next() == Some(name))
        .ok_or(format!("no column '{name}'"))?;
    let wanted = fields(row);
    let is_it = |cells: &Vec<String>| {
        let mut pairs = wanted.iter().zip(cells);
        wanted.len() <= cells.len() && pairs.all(|(wanted, cell)| wanted == "*" || wanted == cell)
    };
    let values = lines.filter(is_it).map(|cells| cells[column].parse::<f64>());
    let values: Result<Vec<f64>, _> = values.collect();
    let values = values.map_err(|_| format!("'{place}' is not a number"))?;
    match (extreme, values.as_slice()) {
        (_, []) => Err(format!("no row '{row}'")),
        ([Some(_), _], all) => Ok(all.iter().copied().fold(f64::INFINITY, f64::min)),
        ([_, Some(_)], all) => Ok(all.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        (_, [value]) => Ok(*value),
        (_, all) => Err(format!("{} rows '{row}'", all.len())),
    }
}

/// The cells of a line of CSV, quoted where they have commas.
pub(super) fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut is_quoted = false;
    for c in line.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            _ => fields.last_mut().expect("the first one").push(c),
        }
    }
    fields
}

#[test]
fn every_result_in_prose_is_a_committed_one() {
    let committed = read("results/report/claims.md");
    let mut seen = Vec::new();
    let mut wrong = Vec::new();
    for page in super::pages() {
        for section in sections(&read(&page), &committed) {
            let is_listed =
                |exempt: &&(&str, &str)| exempt.0 == page && (exempt.1 == "*" || exempt.1 == section.heading);
            let listed = WITHOUT_RESULTS.iter().find(is_listed);
            seen.extend(listed);
            let found = mistakes(&section.prose, listed.is_none(), &value);
            let place = format!("{page}, {}", section.heading);
            wrong.extend(found.into_iter().map(|fault| format!("{place}: {fault}")));
        }
    }
    for listed in &WITHOUT_RESULTS {
        assert!(seen.contains(&listed), "{listed:?} is no section");
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn numbers_without_a_mark_and_wrong_ones_are_found() {
    let table = "N (samples),output,failed (%)\n98,\"IV, a (4)\",34.175\n218,LS,2\n218,IV,5\n";
    let text = "It costs 1.296(6) to\n4.14(4) times as much.";
    let value = |mark: &str| match mark.strip_prefix("t.csv: ") {
        Some(place) => cell(table, place),
        None => quoted(text, mark),
    };
    let right = "34 %<!-- t.csv: 98,\"IV, a (4)\": failed --> and 4.1<!-- to 4.14 -->, from \
                 2<!-- t.csv: 218: least failed --> to 5<!-- t.csv: 218: greatest failed --> at \
                 N = 98 and eta = 5 % by Eq. (9) of C2 (2023) in 1/A, 2n, N^(-1/2), ten minutes.";
    assert_eq!(mistakes(right, true, &value), Vec::<String>::new());
    for (prose, message) in [
        ("in 34 % of all", "does not say"),
        ("in half of all", "does not say"),
        ("in 1,363 trials", "does not say"),
        ("in 10^8 trials", "does not say"),
        ("35 %<!-- t.csv: 98: failed -->", "'35' is 34.175"),
        ("34.1 %<!-- t.csv: 98: failed -->", "'34.1' is 34.175"),
        ("2<!-- t.csv: 218: failed -->", "2 rows"),
        ("2<!-- t.csv: 99: failed -->", "no row"),
        ("2<!-- t.csv: 98: lost -->", "no column"),
        ("4.1<!-- to 4.1 -->", "does not end with a number"),
        ("4.1<!-- to 4.15 -->", "does not stand there"),
        ("half<!-- to 4.14 -->", "not in digits"),
        ("much<!-- to 4.14 -->", "follow no number"),
    ] {
        let found = mistakes(prose, true, &value);
        assert!(found.len() == 1 && found[0].contains(message), "{prose}: {found:?}");
    }
    let page = "# A\n`5` ![5 %](5.svg) [C2](5.md)\n\n    5\n```\n5\n```\n| 5 |\n## B\n1. 6\n";
    let found = sections(page, "| 5 |");
    let prose: Vec<&str> = found.iter().map(|number| number.prose.trim()).collect();
    assert_eq!(prose, ["", "[C2", "6"]);
}
