//! Records as they are read, and the lines of refusals.

use super::*;
use crate::data::csv::error::LONGEST_LINE;
use crate::data::csv::{Missing, Record};

fn error(text: &str) -> String {
    read(text.as_bytes()).unwrap_err().to_string()
}

/// An error value of a spreadsheet is a missing sample wherever it stands; other rows that begin with # are comments.
#[test]
fn error_values_are_no_comments() {
    for value in ["#N/A", "#NV", "#DIV/0!", "#WERT!", "#VALEUR!", "#NAME?"] {
        for s in [",", ";", "\t", " "] {
            let missing = |column: &str| format!("line 3, column {column}: a sample is missing");
            let found = error(&format!("u{s}y\n1{s}2\n{value}{s}3\n4{s}5\n"));
            assert!(found.contains(&missing("u")), "{value}{s}: {found}");
            let found = error(&format!("u{s}y\n1{s}2\n3{s}{value}\n4{s}5\n"));
            assert!(found.contains(&missing("y")), "{value}{s}: {found}");
        }
    }
    assert!(error("u,y\n1,2\n####,3\n").contains("a sample is missing"));
    for comment in [
        "# a, b, c",
        "## by hand",
        "#a",
        "#m/s,V,s",
        "#####",
        "#! run",
        "#NV is the noise",
        "#",
    ] {
        let text = format!("u,y\n1,2\n{comment}\n3,4\n");
        assert_eq!(read(text.as_bytes()).unwrap().y, [2.0, 4.0], "{comment}");
    }
    // One that has as many cells as the rows may be a row.
    for row in ["# a, b", "#1,2", "#m/s,V"] {
        let found = error(&format!("u,y\n1,2\n{row}\n3,4\n"));
        assert!(found.starts_with("line 3"), "{row}: {found}");
    }
}

/// A row without a number below the names has the units; a missing sample is none.
#[test]
fn units_may_stand_below_the_names() {
    let table = |text: &str| read_table(text.as_bytes(), &ReadOptions::default()).unwrap();
    let found = table("time,u,y\n(ms),(V),(rpm)\n0,1,2\n100,3,4\n");
    assert_eq!(found.record.u, [1.0, 3.0]);
    assert_eq!(found.times, Some([0.0, 0.1]));
    assert!(found.form.contains(&"a row of units".to_owned()));
    assert_eq!(table("u;y\nV;\n1;2\n").record.y, [2.0]);
    assert!(error("u,y\nNaN,NaN\n1,2\n").contains("a sample is missing"));
    assert!(error("u,y\n1,x\n1,2\n").contains("'x' is not a finite number"));
    assert_eq!(table("t,u,y\ns,-,1/min\n0,1,2\n1,3,4\n").record.u, [1.0, 3.0]);
    for row in ["inf,1e400", "n.v.,n.v.", "-inf,-1e999"] {
        let cell = row.split(',').next().unwrap();
        let message = format!("line 2, column u: '{cell}' is not a finite number");
        assert_eq!(error(&format!("u,y\n{row}\n1,2\n")), message);
    }
    assert!(error("u;y\n1,5E400;2\n1;2\n").contains("'1,5E400' is not a finite number"));
}

#[test]
fn a_record_survives_writing_and_reading() {
    let record = Record {
        u: vec![1.0, -0.1, 1e-300],
        y: vec![std::f64::consts::PI, -1.0 / 3.0, 12345.678],
        r: Vec::new(),
    };
    let mut text = Vec::new();
    crate::data::csv::write(&mut text, &["truth".to_owned()], &record.u, &record.y).unwrap();
    assert_eq!(read(text.as_slice()).unwrap(), record);
}

#[test]
fn columns_may_stand_in_any_order_and_k_may_start_anywhere() {
    let record = read("# a\ny, u ,k\n1,2,7\n# b\n\n3,4,8\r\n".as_bytes()).unwrap();
    assert_eq!((record.u, record.y), (vec![2.0, 4.0], vec![1.0, 3.0]));
    let record = read("time,u,y\n0.03,1,2\n0.07,3,4\n0.1,5,6\n".as_bytes()).unwrap();
    assert_eq!(record.u, [1.0, 3.0, 5.0]);
    let record = read("\u{feff}u,y\n1,2\n".as_bytes()).unwrap();
    assert_eq!(record.y, [2.0]);
}

#[test]
fn one_column_of_any_table() {
    let table = "# a\nt, in ,out\n0,1,x\n\n1,-2.5,y\n";
    let column = |name: &str| read_column(table.as_bytes(), name);
    assert_eq!(column("in").unwrap(), [1.0, -2.5]);
    for (text, message) in [
        (
            "1,2\n",
            "line 1: no header, so no column 'u'; expected its number, 1 to 2",
        ),
        ("y,u\n", "no samples after the header"),
        ("y,u\n1\n", "line 2: 1 cell, but the header has 2"),
        ("y,u\n1,nan\n", "line 2, column u: a sample is missing ('nan')"),
    ] {
        assert_eq!(read_column(text.as_bytes(), "u").unwrap_err().to_string(), message);
    }
}

#[test]
fn refusals_name_line_and_column() {
    assert!(error("").starts_with("the file is empty"));
    assert!(error("# only\n").starts_with("the file is empty"));
    assert!(error("1,2\n3,4\n").starts_with("line 1: no header"));
    assert!(error("# c\nu,z\n1,2\n").starts_with("line 2: unknown column 'z'"));
    assert!(error("u,u,y\n").starts_with("line 1: column 'u' appears twice"));
    assert!(error("k,y\n").starts_with("line 1: no column 'u'"));
    assert!(error("u,y\n").starts_with("no samples"));
    for last in ["0.4", "0.2", "0.1"] {
        let message = error(&format!("t,u,y\n0,1,2\n0.1,1,2\n0.2,1,3\n{last},1,2\n"));
        assert!(message.starts_with("line 5, column t: a step of "), "{message}");
    }
    assert!(error("t,time,u,y\n").starts_with("line 1: column 't' appears twice"));
    let long = "\0".repeat(LONGEST_LINE as usize + 1);
    assert!(error(&long).starts_with("line 1: longer than"));
    assert!(error(&format!("u,y\n{long}")).starts_with("line 2: expected text"));
    assert!(error("u,y\n1,2\n3\n").starts_with("line 3: 1 cell, but the header has 2"));
    for cell in ["abc", "inf", "-infinity", "1e999", "1.234.5"] {
        let message = error(&format!("# c\nu,y\n1,2\n3,{cell}\n"));
        assert_eq!(message, format!("line 4, column y: '{cell}' is not a finite number"));
    }
    assert!(error("k,u,y\n0,1,1\n2,1,1\n").starts_with("line 3, column k: found 2, expected 1"));
}
/// Reads with options; u, y and what was recognised.
fn table(text: &[u8], options: &ReadOptions) -> (Vec<f64>, Vec<f64>, String) {
    let table = read_table(text, options).unwrap();
    (table.record.u, table.record.y, table.form.join(", "))
}

fn chosen(input: &str, output: &str) -> ReadOptions {
    ReadOptions {
        input: Some(input.to_owned()),
        output: Some(output.to_owned()),
        ..ReadOptions::default()
    }
}

/// The same two rows as programs of several countries write them.
#[test]
fn separators_and_decimals_are_recognised() {
    let plain = ReadOptions::default();
    for (text, form) in [
        ("u,y\n1.5,2\n-3,0.25\n", ""),
        ("u;y\n1,5;2\n-3;0,25\n", "separated by semicolons, decimal commas"),
        ("u;y;\r\n1.5;2;\r\n-3;0.25;\r\n", "separated by semicolons"),
        (
            "sep=;\nu;y\n1,5;2\n-3;0,25\n",
            "separated by semicolons, decimal commas",
        ),
        ("u\ty\n1,5\t2\n-3\t0,25\n", "separated by tabs, decimal commas"),
        ("  u   y\n 1.5 2\n-3 2.5e-1\n", "separated by blanks"),
        ("\"u\",\"y\"\n\"1,5\",\"2\"\n\"-3\",\"0,25\"\n", "decimal commas"),
        ("\u{feff}u,y\n1.5,2\n-3,0.25\n", "a byte order mark"),
        ("in,Output\n1.5,2\n-3,0.25\n", "u is column 'in', y is column 'Output'"),
        (
            "U [V];Y (K)\n1.5;2\n-3;0.25\n",
            "separated by semicolons, u is column 'U [V]', y is column 'Y (K)'",
        ),
    ] {
        let read = table(text.as_bytes(), &plain);
        assert_eq!(read, (vec![1.5, -3.0], vec![2.0, 0.25], form.to_owned()), "{text}");
    }
    let latin = b"u;Druck;y \xb0C\n1;7;2\n";
    assert_eq!(
        table(latin, &chosen("u", "3")).2,
        "separated by semicolons, Latin-1, y is column 'y \u{b0}C', not used: 'Druck'"
    );
    let mixed = "u;y\n1,5;2\n3.5;2\n";
    assert_eq!(
        error(mixed),
        "line 3, column u: '3.5', but earlier numbers have decimal commas"
    );
    let ambiguous = error("u,y\n1,5,2,5\n");
    assert!(ambiguous.starts_with("line 2: 4 cells, but the header has 2; numbers with decimal commas"));
    assert!(error("u;y\n1.34,5;2\n").starts_with("line 2, column u: '1.34,5' is not"));
}

#[test]
fn columns_are_chosen_by_name_or_number() {
    let text = "time [ms],valve,flow,temp\n0,1,2,3\n10,4,5,6\n20,7,8,9\n";
    let read = read_table(text.as_bytes(), &chosen("valve", "4")).unwrap();
    assert_eq!(
        (read.record.u, read.record.y),
        (vec![1.0, 4.0, 7.0], vec![3.0, 6.0, 9.0])
    );
    assert_eq!(read.times, Some([0.0, 0.01]));
    // The unit may be left off, in brackets or behind a mark, where one column is left.
    let text = b"t_s;Spannung_V;Drehzahl_1/min;Drehzahl_soll\n0;1;2;3\n1;4;5;6\n";
    assert_eq!(table(text, &chosen("spannung", "4")).1, [3.0, 6.0]);
    assert!(read_table(&text[..], &chosen("Spannung", "Drehzahl")).is_err());
    assert!(read_table(&text[..], &chosen("Spann", "4")).is_err());
    // Without a header, by number alone.
    let bare = chosen("2", "1");
    assert_eq!(
        table(b"1 2\n3 4\n", &bare),
        (
            vec![2.0, 4.0],
            vec![1.0, 3.0],
            "separated by blanks, no header, u is column 2, y is column 1".to_owned()
        )
    );
    for (text, options, message) in [
        (
            "a,b\n1,2\n",
            chosen("a", "c"),
            "line 1: no column 'c' among 'a', 'b'; expected one of these, or its number from 1",
        ),
        (
            "a,b\n1,2\n",
            chosen("a", "1"),
            "line 1: column 'a' is chosen as input and as output",
        ),
        (
            "a,a\n1,2\n",
            chosen("a", "2"),
            "line 1: several columns are named 'a'; expected a column's number, from 1",
        ),
        (
            "1,2\n",
            chosen("u", "2"),
            "line 1: no header, so no column 'u'; expected its number, 1 to 2",
        ),
        (
            "u,y,t (d)\n1,2,3\n",
            chosen("u", "y"),
            "line 1: the unit of column 't (d)' is unknown; expected s, ms, us, min or h",
        ),
    ] {
        assert_eq!(read_table(text.as_bytes(), &options).unwrap_err().to_string(), message);
    }
    // A column that is no time, although its name says so.
    let none = ReadOptions {
        time: Some("none".to_owned()),
        ..chosen("u", "y")
    };
    assert_eq!(table(b"t,u,y\n0,1,2\n7,3,4\n9,5,6\n", &none).0, [1.0, 3.0, 5.0]);
}

#[test]
fn the_longest_run_without_a_gap() {
    let longest = ReadOptions {
        missing: Missing::LongestRun,
        ..ReadOptions::default()
    };
    let kept = |text: &str| {
        let table = read_table(text.as_bytes(), &longest).unwrap();
        let lines = table.kept.map(|kept| (kept.lines, kept.rows, kept.parts));
        (table.record.u, lines, table.times)
    };
    let run = |u: [f64; 3], lines, rows, parts| (u.to_vec(), Some((lines, rows, parts)), None);
    let text = "u,y\n1,1\n2,\n3,1\nNaN,1\n5,1\n6,1\n7,1\n8,NA\n";
    assert_eq!(error(text), "line 3, column y: a sample is missing ('')");
    assert_eq!(kept(text), run([5.0, 6.0, 7.0], [6, 8], 8, 3));
    let text = "k,u,y\n0,1,1\n1,2,1\n4,5,1\n5,6,1\n6,7,1\n";
    assert_eq!(kept(text), run([5.0, 6.0, 7.0], [4, 6], 5, 2));
    // The step that differs is the first one of the part before.
    let text = "t,u,y\n0,1,1\n0.1,2,1\n0.3,5,1\n0.4,6,1\n0.5,7,1\n";
    let (u, lines, times) = kept(text);
    assert_eq!((u, lines), (vec![5.0, 6.0, 7.0], Some(([4, 6], 5, 2))));
    let [start, step] = times.unwrap();
    assert!(start == 0.3 && (step - 0.1).abs() < 1e-15);
    assert_eq!(kept("u,y\n1,1\n2,1\n").1, None);
}
