//! One record in every dialect: its numbers, or a refusal that says what is ambiguous.

use crate::data::csv::{Missing, ReadOptions, Table, read_table};
use proptest::prelude::*;
use proptest::sample::select;

/// How a table is written.
#[allow(clippy::struct_excessive_bools)]
#[derive(Clone, Debug)]
struct Dialect {
    separator: &'static str,
    decimal: char,
    /// The mark that divides thousands.
    thousands: &'static str,
    quotes: bool,
    end: &'static str,
    encoding: &'static str,
    header: &'static str,
    preamble: &'static str,
    comment: bool,
    times: &'static str,
    digits: usize,
    scale: f64,
    newest_first: bool,
    trailing: &'static str,
    /// The text that stands for a missing sample, in which column, and in which row.
    gap: Option<(&'static str, usize, usize)>,
    /// Whether the numbers have an exponent of Fortran.
    fortran: bool,
}

fn dialects() -> impl Strategy<Value = Dialect> {
    let form = (
        select(vec![",", ";", "\t", "  ", ", "]),
        select(vec!['.', ',']),
        select(vec!["", "", "", ",", ".", "'", "\u{a0}", " "]),
        any::<bool>(),
        select(vec!["\n", "\r\n", "\r"]),
        select(vec!["utf-8", "bom", "utf-16le", "utf-16be", "latin"]),
    );
    let around = (
        select(vec!["plain", "named", "units", "below", "quoted", "none"]),
        select(vec![
            "",
            "",
            "Measurement\nWriter_Version,2\nDate;2024/01/05\n",
            "# a\n# b, c\n",
            "sep",
        ]),
        any::<bool>(),
        select(vec!["", "", "number", "ms", "iso", "german", "us", "epoch", "day", "k"]),
        0..6_usize,
        select(vec![1.0, 1000.0, 1e6, 0.001]),
    );
    let rows = (
        any::<bool>(),
        select(vec!["", "", "separator"]),
        prop::option::weighted(
            0.4,
            (
                select(vec![
                    "#N/A",
                    "#NV",
                    "#DIV/0!",
                    "#WERT!",
                    "#VALUE!",
                    "NaN",
                    "",
                    "#####",
                    "#\u{417}\u{41d}\u{410}\u{427}!",
                ]),
                0..2_usize,
                1..38_usize,
            ),
        ),
        prop::bool::weighted(0.1),
    );
    (form, around, rows).prop_map(|(form, around, rows)| Dialect {
        separator: form.0,
        decimal: form.1,
        thousands: form.2,
        quotes: form.3,
        end: form.4,
        encoding: form.5,
        header: around.0,
        preamble: around.1,
        comment: around.2,
        times: around.3,
        digits: around.4,
        scale: around.5,
        newest_first: rows.0,
        trailing: rows.1,
        gap: rows.2,
        fortran: rows.3,
    })
}

/// Sample k of a column: both signs, numbers below one and in the thousands.
fn sample(column: usize, k: usize, scale: f64, digits: usize) -> f64 {
    let x = ((k * 7919 + column * 104_729) % 2003) as f64 / 2003.0 - 0.4;
    format!("{:.digits$}", x * 3.0 * scale).parse().unwrap()
}

impl Dialect {
    /// A dialect in which numbers have one meaning at most where they are divided into cells.
    fn is_possible(&self) -> bool {
        self.thousands.chars().all(|c| c != self.decimal)
            && (self.header != "none" || self.preamble != "sep" || self.times != "k")
    }

    fn number(&self, value: f64) -> String {
        if self.fortran {
            return format!("{value:.9E}")
                .replace('E', "D")
                .replace('.', &self.decimal.to_string());
        }
        let digits = format!("{:.*}", self.digits, value.abs());
        let (whole, fraction) = digits.split_once('.').unwrap_or((&digits, ""));
        let mut grouped = String::new();
        for (at, digit) in whole.chars().enumerate() {
            if at > 0 && (whole.len() - at) % 3 == 0 {
                grouped += self.thousands;
            }
            grouped.push(digit);
        }
        let sign = if value < 0.0 { "-" } else { "" };
        let mark = if fraction.is_empty() {
            String::new()
        } else {
            self.decimal.to_string()
        };
        format!("{sign}{grouped}{mark}{fraction}")
    }

    fn time(&self, k: usize) -> String {
        // Over midnight, and over the end of a month.
        let since = 86_400_000 - 200 + 20 * k as i128 + 30 * 86_400_000;
        let time = jiff::civil::date(2025, 10, 1).at(0, 0, 0, 0) + jiff::SignedDuration::from_millis_i128(since);
        let fraction = format!("{}{:03}", self.decimal, since % 1000);
        match self.times {
            "number" => format!("{:.2}", 0.02 * k as f64).replace('.', &self.decimal.to_string()),
            "ms" => (20 * k).to_string(),
            "iso" => time.strftime("%Y-%m-%dT%H:%M:%S.").to_string() + &fraction[1..],
            "german" => time.strftime("%d.%m.%Y %H:%M:%S").to_string() + &fraction,
            "us" => time.strftime("%m/%d/%Y %I:%M:%S").to_string() + &fraction + &time.strftime(" %p").to_string(),
            "epoch" => (1_761_868_800_000 + since).to_string(),
            "day" => time.strftime("%H:%M:%S").to_string() + &fraction,
            _ => (k + 5).to_string(),
        }
    }

    fn text(&self) -> String {
        let cell = |text: String| {
            if self.quotes || text.contains(&self.separator[..1]) {
                format!("\"{text}\"")
            } else {
                text
            }
        };
        let timed = !self.times.is_empty();
        let mut lines: Vec<Vec<String>> = Vec::new();
        let time = if self.times == "k" { "k" } else { "t" };
        let names: [&str; 3] = match self.header {
            "named" => [time, "In", "OUTPUT"],
            "units" => [time, "u [V]", "y (1/min)"],
            "quoted" => [time, "\"u\n[V]\"", "\"y\n[K]\""],
            _ => [time, "u", "y"],
        };
        let time = if self.times == "ms" { "t [ms]" } else { names[0] };
        if self.header != "none" {
            let names = [time, names[1], names[2]].map(|name| {
                if self.separator == "  " {
                    name.replace(' ', "")
                } else {
                    name.to_owned()
                }
            });
            lines.push(names[usize::from(!timed)..].to_vec());
            if self.header == "below" {
                let time = if ["ms", "epoch"].contains(&self.times) {
                    "ms"
                } else {
                    "s"
                };
                lines.push(
                    [time, "V", "m/s"][usize::from(!timed)..]
                        .iter()
                        .map(|unit| (*unit).to_owned())
                        .collect(),
                );
            }
        }
        let mut rows = Vec::new();
        for k in 0..40 {
            let mut row: Vec<String> = if timed { vec![cell(self.time(k))] } else { Vec::new() };
            for column in 0..2 {
                row.push(match self.gap {
                    Some((text, of, at)) if (of, at) == (column, k) => text.to_owned(),
                    _ => cell(self.number(sample(column, k, self.scale, self.digits))),
                });
            }
            rows.push(row);
        }
        if self.newest_first && timed {
            rows.reverse();
        }
        lines.extend(rows);
        let mut text = match self.preamble {
            "sep" => format!("sep={}\n", self.separator),
            preamble => preamble.to_owned(),
        };
        for (at, line) in lines.iter().enumerate() {
            text += &line.join(self.separator);
            if self.trailing == "separator" && self.separator != "  " {
                text += self.separator;
            }
            text.push('\n');
            if self.comment && at == 20 {
                text += "# the pump was changed\n";
            }
        }
        text.replace('\n', self.end)
    }

    fn bytes(&self) -> Vec<u8> {
        let text = self.text();
        let wide = |of: fn(u16) -> [u8; 2]| {
            std::iter::once(0xfeff)
                .chain(text.encode_utf16())
                .flat_map(of)
                .collect::<Vec<u8>>()
        };
        match self.encoding {
            "bom" => format!("\u{feff}{text}").into_bytes(),
            "utf-16le" => wide(u16::to_le_bytes),
            "utf-16be" => wide(u16::to_be_bytes),
            "latin" if self.gap.is_none_or(|gap| gap.0.is_ascii()) => {
                encoding_rs::WINDOWS_1252.encode(&text).0.into_owned()
            }
            _ => text.into_bytes(),
        }
    }

    fn options(&self) -> ReadOptions {
        let bare = self.header == "none";
        let first = 1 + usize::from(!self.times.is_empty());
        let time = match self.times {
            "" | "k" => None,
            _ => bare.then(|| "1".to_owned()),
        };
        ReadOptions {
            input: bare.then(|| first.to_string()),
            output: bare.then(|| (first + 1).to_string()),
            time,
            ..ReadOptions::default()
        }
    }

    /// The numbers of the record, or a refusal for a reason that this dialect has.
    fn check(&self, read: &Result<Table, crate::data::csv::RecordError>, kept: bool) {
        let expected =
            |column: usize| -> Vec<f64> { (0..40).map(|k| sample(column, k, self.scale, self.digits)).collect() };
        // Nothing in the table tells these.
        let is_backwards = self.newest_first && self.times == "k" && self.header == "none";
        match read {
            Ok(table) => {
                let [mut u, mut y] = [expected(0), expected(1)];
                if let (Some((_, _, at)), false) = (self.gap, is_backwards) {
                    assert!(kept, "a gap vanished: {self:?}\n{}", self.text());
                    let run = if at >= 40 - at - 1 { 0..at } else { at + 1..40 };
                    [u, y] = [u[run.clone()].to_vec(), y[run].to_vec()];
                }
                if is_backwards {
                    return;
                }
                let same = |own: &[f64], other: &[f64]| {
                    own.len() == other.len() && own.iter().zip(other).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs())
                };
                assert!(
                    same(&table.record.u, &u) && same(&table.record.y, &y),
                    "other numbers: {self:?}\n{:?}\n{}",
                    table.record.u,
                    self.text()
                );
                let step = match self.times {
                    "" | "k" => None,
                    "ms" if self.header == "none" => Some(20.0),
                    _ => Some(0.02),
                };
                let is = |times: [f64; 2]| step.is_some_and(|step: f64| (times[1] - step).abs() < 1e-6 * step);
                assert!(
                    table.times.map_or(step.is_none(), is),
                    "{:?} {self:?}\n{}",
                    table.times,
                    self.text()
                );
            }
            Err(error) => {
                let error = error.to_string();
                let reasons = [
                    (self.gap.is_some(), "a sample is missing"),
                    (
                        !self.thousands.is_empty() || self.digits == 3,
                        "three digits stand behind each such mark",
                    ),
                    // A comma that separates and divides, or a blank that does.
                    (self.separator.starts_with([',', ' ']), "cell"),
                    (
                        self.header == "none" && self.preamble.contains("Date"),
                        "'Date' is not a finite number",
                    ),
                    (self.separator == "  " && self.gap.is_some(), "cell"),
                ];
                assert!(
                    reasons.iter().any(|(may, part)| *may && error.contains(part)),
                    "{error}: {self:?}\n{}",
                    self.text()
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6000))]

    /// Never a third.
    #[test]
    fn the_same_numbers_or_a_refusal(dialect in dialects().prop_filter("one meaning", Dialect::is_possible)) {
        let (bytes, options) = (dialect.bytes(), dialect.options());
        dialect.check(&read_table(bytes.as_slice(), &options), false);
        let longest = ReadOptions { missing: Missing::LongestRun, ..options };
        dialect.check(&read_table(bytes.as_slice(), &longest), true);
    }
}
