//! Files as people reported them, each with variants: the record, or a refusal that leads on.

use crate::data::csv::{ReadOptions, RecordError, Table, read_table};

/// Sample k of the input: from -2,400 to 2,400.
fn u(k: usize) -> i64 {
    (k * 1543 % 4801) as i64 - 2400
}

/// `y(k) = 0.7 y(k-1) + 0.5 u(k-1)` in whole numbers.
fn y(k: usize) -> i64 {
    (1..=k).fold(0.0, |y, k| 0.7 * y + 0.5 * u(k - 1) as f64).round() as i64
}

/// A table of 40 rows.
fn table(header: &str, row: impl Fn(usize) -> String) -> String {
    (0..40).fold(header.to_owned(), |text, k| text + &row(k) + "\n")
}

/// A whole number with a mark of thousands.
fn grouped(number: i64, mark: char) -> String {
    let sign = if number < 0 { "-" } else { "" };
    let size = number.abs();
    match size / 1000 {
        0 => format!("{sign}{size}"),
        thousands => format!("{sign}{thousands}{mark}{:03}", size % 1000),
    }
}

fn read(text: &str) -> Result<Table, RecordError> {
    read_table(text.as_bytes(), &ReadOptions::default())
}

/// Reads the record itself; returns what was recognised.
fn reads(text: &str) -> String {
    let table = read(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    assert!(
        table.record.u.iter().copied().eq((0..40).map(|k| u(k) as f64)),
        "{text}"
    );
    assert!(
        table.record.y.iter().copied().eq((0..40).map(|k| y(k) as f64)),
        "{text}"
    );
    format!("{:?} {}", table.times, table.form.join(", "))
}

fn refuses(text: &str, part: &str) {
    let error = read(text).expect_err(text).to_string();
    assert!(error.contains(part), "no '{part}' in: {error}");
}

/// A row that begins with an error value is no comment.
#[test]
fn error_values_are_missing_samples() {
    for value in [
        "#N/A",
        "#NV",
        "#DIV/0!",
        "#WERT!",
        "#VALEUR!",
        "#\u{a1}DIV/0!",
        "#NAME?",
        "#######",
        "Err:502",
    ] {
        for (separator, quote) in [(",", ""), (";", ""), ("\t", "\""), ("  ", "")] {
            let header = format!("u{separator}y\n");
            let text = table(&header, |k| match k {
                20 => format!("{quote}{value}{quote}{separator}{}", y(k)),
                _ => format!("{}{separator}{}", u(k), y(k)),
            });
            refuses(&text, &format!("line 22, column u: a sample is missing ('{value}')"));
        }
    }
    let row = |line: &'static str| {
        move |k: usize| {
            if k == 20 {
                line.to_owned()
            } else {
                format!("{},{}", u(k), y(k))
            }
        }
    };
    // A row that was taken out, and rows of which nothing is left.
    refuses(&table("u,y\n", row("#12,5")), "line 22: begins with #");
    refuses(&table("u,y\n", row("# 12,5")), "line 22: begins with #");
    refuses(&table("u,y\n", row("#N/A")), "line 22: 1 cell");
    let remark = |k| {
        if k == 20 {
            format!("# new pump\n{},{}", u(k), y(k))
        } else {
            format!("{},{}", u(k), y(k))
        }
    };
    assert_eq!(reads(&table("u,y\n", remark)), "None 1 comment line among the rows");
}

/// Thousands are no decimals.
#[test]
fn thousands_are_told_or_refused() {
    let quoted = table("u,y\n", |k| {
        format!("\"{}\",\"{}\"", grouped(u(k), ','), grouped(y(k), ','))
    });
    refuses(&quoted, "may be -2.400 or -2400");
    let semicolons = table("u;y\n", |k| format!("{};{}", grouped(u(k), '.'), grouped(y(k), '.')));
    refuses(&semicolons, "three digits stand behind each such mark");
    // Another column, or another number, proves it.
    let timed = table("t;u;y\n", |k| {
        format!("{},5;{};{}", k, grouped(u(k), '.'), grouped(y(k), '.'))
    });
    assert!(reads(&timed).contains("decimal commas, marks of thousands"));
    for mark in ['\'', '\u{2019}', '\u{a0}', '\u{202f}'] {
        reads(&table("u;y\n", |k| {
            format!("{};{}", grouped(u(k), mark), grouped(y(k), mark))
        }));
    }
    for (decimal, is) in [("comma", true), ("point", false)] {
        let options = ReadOptions {
            decimal: Some(decimal.parse().unwrap()),
            ..ReadOptions::default()
        };
        let first = read_table(semicolons.as_bytes(), &options).unwrap().record.u[0];
        assert_eq!(first, if is { -2400.0 } else { -2.4 });
    }
    // Three decimals everywhere are decimals.
    let decimals = read("u;y\n21.250;1.125\n21.500;1.250\n").unwrap();
    assert_eq!(decimals.record.u, [21.25, 21.5]);
}

/// Dates and times of any common form, with the step that they have.
#[test]
fn dates_and_times() {
    let day = jiff::civil::date(2025, 10, 31).at(23, 59, 50, 0);
    let at = |k: usize| day + jiff::SignedDuration::from_millis(500 * k as i64);
    for format in [
        "%Y-%m-%dT%H:%M:%S%.3f",
        "%Y-%m-%dT%H:%M:%S%.3fZ",
        "%Y-%m-%d %H:%M:%S%.3f+01:00",
        "%d.%m.%Y %H:%M:%S,%3f",
        "%d.%m.%y %H:%M:%S%.1f",
        "%m/%d/%Y %I:%M:%S%.3f %p",
        "%d/%m/%Y %H:%M:%S%.3f",
        "%Y/%m/%d %H:%M:%S%.6f",
        "%d-%b-%Y %H:%M:%S%.3f",
        "%H:%M:%S%.3f",
        "%H:%M:%S:%3f",
        "%M:%S%.1f",
        "%Y%m%dT%H%M%S%.3f",
    ] {
        let text = table("t;u;y\n", |k| format!("{};{};{}", at(k).strftime(format), u(k), y(k)));
        assert!(reads(&text).starts_with("Some([0.0, 0.5]) "), "{format}");
        let newest = text.lines().skip(1).collect::<Vec<_>>();
        let newest: String = newest
            .iter()
            .rev()
            .fold("t;u;y\n".to_owned(), |text, line| text + line + "\n");
        assert!(reads(&newest).contains("newest first"), "{format}");
    }
    let since = |unit: u128| {
        table("t,u,y\n", |k| {
            format!(
                "{},{},{}",
                (1_764_000_000_000_000_000 + 500_000_000 * k as u128) / unit,
                u(k),
                y(k)
            )
        })
    };
    for unit in [1, 1000, 1_000_000] {
        let said = reads(&since(unit));
        let [_, step] = read(&since(unit)).unwrap().times.unwrap();
        assert!(
            said.contains("seconds since 1970") && (step - 0.5).abs() < 1e-7,
            "{said}"
        );
    }
    refuses(
        &table("t,u,y\n", |k| format!("Tuesday {k},1,2")),
        "'Tuesday 0' is no time",
    );
    refuses(
        &table("t,u,y\n", |k| format!("10:{k:02},1,2")),
        "hour:minute or minute:second",
    );
    // A minute is left out.
    let lost = table("t,u,y\n", |k| {
        format!("2025-03-01 10:{:02}:00,1,2", k + usize::from(k > 7))
    });
    refuses(&lost, "line 10, column t: a step of 120");
}

/// Lines around the rows, and ends of lines.
#[test]
fn layouts() {
    let rows = |header: &str| table(header, |k| format!("{},{}", u(k), y(k)));
    assert!(reads(&rows("\"u\n[V]\",\"y\n[degC]\"\n")).contains("u is column 'u [V]', y is column 'y [degC]'"));
    reads(&rows("\"u\r\n[V]\",\"y\"\n"));
    reads(&rows("u,y\n").replace('\n', "\r"));
    let labview = "LabVIEW Measurement\nWriter_Version,2\nDate,2024/01/05\n***End_of_Header***\nu,y\n";
    assert!(reads(&rows(labview)).contains("lines 1 to 4 above the table left out"));
    assert!(reads(&rows("Test bench 4, run of the 5th\n\nu,y\nV,bar\n")).contains("line 1 above"));
    reads(&rows("Samples;2,5\nu,y\n"));
    // A column of text hides no header, whatever stands above.
    for above in ["Rig 7\n\n", "Rig 7,,\n,,\n", "Rig,7\nof,May 5\n"] {
        let line = above.lines().count() + 1;
        for header in ["u,y,note", "in,y,remark", "u,out,x"] {
            let noted = table(&format!("{above}{header}\n"), |k| {
                format!("{},{},{}", u(k), y(k), if k % 7 == 3 { "" } else { "ok" })
            });
            let text = header.rsplit(',').next().unwrap_or_default();
            refuses(&noted, &format!("line {line}: "));
            refuses(&noted, &format!("'{text}'"));
        }
    }
    refuses(
        &format!("1,2\n{}", rows("u,y\n")),
        "line 1: numbers above the header in line 2",
    );
    for digits in ["D", "d", "E"] {
        let fortran = |x: i64| format!("{:.8}{digits}+03", x as f64 / 1000.0);
        reads(&table("u,y\n", |k| format!("{},{}", fortran(u(k)), fortran(y(k)))));
        reads(&table("u;y\n", |k| {
            format!("{};{}", fortran(u(k)), fortran(y(k))).replace('.', ",")
        }));
    }
    let newest = |time: fn(usize) -> String| {
        table("t,k,u,y\n", |k| {
            format!("{},{},{},{}", time(39 - k), 39 - k, u(39 - k), y(39 - k))
        })
    };
    assert!(reads(&newest(|k| format!("{:.1}", 0.1 * k as f64))).contains("newest first"));
    refuses(
        &newest(|k| format!("{:.1}", 0.1 * (k + k / 20) as f64)),
        "and times fall",
    );
    let unused = newest(|k| k.to_string()).replace("t,k,u,y", "Zeit [s],n,u,y");
    let chosen = ReadOptions {
        input: Some("u".to_owned()),
        output: Some("y".to_owned()),
        ..ReadOptions::default()
    };
    let error = read_table(unused.as_bytes(), &chosen).unwrap_err().to_string();
    assert!(error.contains("'Zeit [s]' falls: the newest sample"), "{error}");
    for (header, end) in [("u,y\n", ",,"), ("u,y,,\n", ",,"), ("u,y,\n", ","), ("u,y,\n", "")] {
        reads(&table(header, |k| format!("{},{}{end}", u(k), y(k))));
    }
    reads(&(rows("u,y\n") + ",\n,\n"));
    // A quote that never ends takes no rows with it.
    let open = table("u,y,note\n", |k| {
        format!("{},{},{}", u(k), y(k), if k % 9 == 5 { "\"5 inch" } else { "-" })
    });
    let error = read_table(open.as_bytes(), &chosen).unwrap_err().to_string();
    assert!(error.starts_with("line 7: a quote"), "{error}");
}

/// One column of a table, such as the input of a study.
#[test]
fn a_column_has_the_same_rules() {
    let column = |text: &str, name: &str| crate::data::csv::read_column(text.as_bytes(), name);
    let text = table("t,u,y\ns,V,bar\n", |k| {
        format!("2025-03-01 10:00:{k:02},{},{}", u(k), y(k))
    });
    for name in ["u", "2", "U"] {
        assert_eq!(column(&text, name).unwrap().len(), 40);
    }
    let gap = table("u,y\n", |k| {
        if k == 20 {
            format!("#N/A,{}", y(k))
        } else {
            format!("{},{}", u(k), y(k))
        }
    });
    assert!(
        column(&gap, "u")
            .unwrap_err()
            .to_string()
            .contains("line 22, column u: a sample is missing")
    );
    assert!(
        column("u\n1\n\n3\n", "u")
            .unwrap_err()
            .to_string()
            .contains("line 3, column u: a sample is missing")
    );
    assert_eq!(column("1;7\n2;8\n", "2").unwrap(), [7.0, 8.0]);
}
