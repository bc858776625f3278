//! Worksheets are read as their program would save them as CSV.

use super::*;
use crate::files::read_record;
use asobench_identification::data::csv::{ReadOptions, Table, read_table};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A workbook of worksheets with these rows; `attributes` of the first one and of the book, such as a hidden state.
fn book(sheets: &[(&str, &str)], hidden: bool, properties: &str) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut part = |name: &str, text: &str| {
        let deflated = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        zip.start_file(name, deflated).unwrap();
        let text = format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>{text}");
        io::Write::write_all(&mut zip, text.as_bytes()).unwrap();
    };
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let package = "http://schemas.openxmlformats.org/package/2006";
    let (mut list, mut relations, mut types) = (String::new(), String::new(), String::new());
    for (i, (name, _)) in sheets.iter().enumerate() {
        let state = if hidden && i == 0 { " state=\"hidden\"" } else { "" };
        let _ = write!(
            list,
            "<sheet name=\"{name}\" sheetId=\"{0}\" r:id=\"rId{0}\"{state}/>",
            i + 1
        );
        let _ = write!(
            relations,
            "<Relationship Id=\"rId{0}\" Type=\"{office}/worksheet\" Target=\"worksheets/sheet{0}.xml\"/>",
            i + 1
        );
        let _ = write!(
            types,
            "<Override PartName=\"/xl/worksheets/sheet{}.xml\" ContentType=\"application/vnd.openxmlformats-\
             officedocument.spreadsheetml.worksheet+xml\"/>",
            i + 1
        );
    }
    let _ = write!(
        relations,
        "<Relationship Id=\"rId99\" Type=\"{office}/styles\" Target=\"styles.xml\"/>"
    );
    part(
        "[Content_Types].xml",
        &format!("<Types xmlns=\"{package}/content-types\">{types}</Types>"),
    );
    part(
        "_rels/.rels",
        &format!(
            "<Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"rId1\" \
             Type=\"{office}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
        ),
    );
    part(
        "xl/workbook.xml",
        &format!("<workbook xmlns=\"{main}\" xmlns:r=\"{office}\">{properties}<sheets>{list}</sheets></workbook>"),
    );
    part(
        "xl/_rels/workbook.xml.rels",
        &format!("<Relationships xmlns=\"{package}/relationships\">{relations}</Relationships>"),
    );
    // Styles 1 to 3: a date with a time, a time, a duration.
    part(
        "xl/styles.xml",
        &format!(
            "<styleSheet xmlns=\"{main}\"><cellXfs count=\"4\"><xf numFmtId=\"0\"/><xf numFmtId=\"22\"/>\
             <xf numFmtId=\"21\"/><xf numFmtId=\"46\"/></cellXfs></styleSheet>"
        ),
    );
    for (i, (_, rows)) in sheets.iter().enumerate() {
        part(
            &format!("xl/worksheets/sheet{}.xml", i + 1),
            &format!("<worksheet xmlns=\"{main}\"><sheetData>{rows}</sheetData></worksheet>"),
        );
    }
    zip.finish().unwrap().into_inner()
}

/// A row from cells: `s:` before a text, `e:` before an error, `1:` to `3:` before a number with this style, `-` for
/// none.
fn row(number: usize, cells: &[&str]) -> String {
    let cells = cells
        .iter()
        .zip('A'..)
        .filter(|(cell, _)| **cell != "-")
        .map(|(cell, column)| match cell.split_once(':') {
            Some(("s", text)) => {
                format!("<c r=\"{column}{number}\" t=\"inlineStr\"><is><t>{text}</t></is></c>")
            }
            Some(("e", error)) => format!("<c r=\"{column}{number}\" t=\"e\"><v>{error}</v></c>"),
            Some((style, value)) => {
                format!("<c r=\"{column}{number}\" s=\"{style}\"><v>{value}</v></c>")
            }
            None => format!("<c r=\"{column}{number}\"><v>{cell}</v></c>"),
        });
    format!("<row r=\"{number}\">{}</row>", cells.collect::<String>())
}

fn rows(all: &[&[&str]]) -> String {
    let all = all.iter().enumerate();
    all.filter(|(_, cells)| !cells.is_empty())
        .map(|(i, cells)| row(i + 1, cells))
        .collect()
}

fn text(bytes: &[u8]) -> Result<String, String> {
    let mut book = Workbook::open(bytes)?;
    let names = book.worksheets(None)?;
    book.text(names.first().ok_or("no worksheet")?)
}

fn record(bytes: &[u8]) -> Result<Table, String> {
    read_table(text(bytes)?.as_bytes(), &ReadOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn cells_are_what_their_program_shows() {
    let sheet = rows(&[
        &["s:Rig 7"],
        &[],
        &["s:u", "s:y", "s:said \"so\", twice"],
        &["0.1", "-2.5e-3", "s:a"],
        &["1234", "7"],
        &["e:#DIV/0!", "-", "s:b"],
    ]);
    let found = text(&book(&[("Data", &sheet)], false, "")).unwrap();
    assert_eq!(
        found,
        "\"Rig 7\",,\n,,\n\"u\",\"y\",\"said \"\"so\"\", twice\"\n1e-1,-2.5e-3,\"a\"\n1.234e3,7e0,\n#DIV/0!,,\"b\"\n"
    );
    // A missing sample has the number of its row.
    let sheet = rows(&[
        &["s:Rig 7"],
        &[],
        &["s:u", "s:y"],
        &["0.1", "2"],
        &["1", "7"],
        &["e:#DIV/0!", "-"],
    ]);
    let error = record(&book(&[("Data", &sheet)], false, "")).unwrap_err();
    assert!(error.contains("line 6") && error.contains("missing"), "{error}");
}

/// Serial numbers of Excel: 45985.5853009259 is 2025-11-24 14:02:50, by Microsoft's "Date systems in Excel".
#[test]
fn dates_times_and_durations_are_those_of_excel() {
    let times = |cells: [&str; 3], properties: &str| {
        let rows: Vec<Vec<&str>> = [vec!["s:t", "s:u", "s:y"]]
            .into_iter()
            .chain(cells.map(|cell| vec![cell, "1", "2"]))
            .collect();
        let rows: Vec<&[&str]> = rows.iter().map(Vec::as_slice).collect();
        let bytes = book(&[("Data", &self::rows(&rows))], false, properties);
        (text(&bytes).unwrap(), record(&bytes).unwrap().times)
    };
    let day = ["1:45985.5853009259", "1:45985.5853009838", "1:45985.5853010417"];
    let (found, step) = times(day, "");
    assert!(found.contains("2025-11-24T14:02:50,"), "{found}");
    assert!(found.contains("2025-11-24T14:02:50.005,"), "{found}");
    assert!((step.unwrap()[1] - 0.005).abs() < 1e-12, "{step:?}");
    let (found, _) = times(day, "<workbookPr date1904=\"1\"/>");
    assert!(found.contains("2029-11-25T14:02:50,"), "{found}");
    // 0.5 s is 5.787037037e-6 days.
    let (found, step) = times(["2:0.5", "2:0.500005787037037", "2:0.500011574074074"], "");
    assert!(found.contains("12:00:00.5,"), "{found}");
    assert_eq!(step, Some([0.0, 0.5]));
    let (found, step) = times(["3:0", "3:1.5", "3:3"], "");
    assert!(found.contains("\n1.296e5,"), "{found}");
    assert_eq!(step, Some([0.0, 129_600.0]));
}

#[test]
fn the_first_worksheet_that_has_the_columns_or_the_one_that_is_named() {
    let about = rows(&[&["s:operator", "s:NN"]]);
    let [one, two] = [["1", "2"], ["3", "4"]].map(|values| rows(&[&["s:u", "s:y"], &values]));
    let gap = rows(&[&["s:u", "s:y"], &["1", "2"], &["e:#N/A", "2"], &["1", "2"]]);
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, bytes: &[u8], sheet: Option<&str>| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let table = read_record(&path, sheet, &ReadOptions::default());
        table.map_err(|error| error.to_string())
    };
    let sheets = [("Empty", ""), ("About", &about), ("One", &one), ("Two", &two)];
    let bytes = book(&sheets, false, "");
    let table = read("rig.xlsx", &bytes, None).unwrap();
    assert_eq!((table.record.u, table.record.y), (vec![1.0], vec![2.0]));
    assert_eq!(table.form, ["worksheet 'One' of 4 (--sheet chooses)"]);
    let table = read("rig.XLSX", &bytes, Some("Two")).unwrap();
    assert_eq!((table.record.u, table.form.len()), (vec![3.0], 0));
    let error = read("rig.xlsx", &bytes, Some("two")).unwrap_err();
    assert_eq!(error, "no worksheet 'two'; expected 'Empty', 'About', 'One', 'Two'");
    // A worksheet with the columns is not passed over for its samples.
    let error = read("rig.xlsx", &book(&[("Gap", &gap), ("One", &one)], false, ""), None);
    assert!(error.unwrap_err().contains("line 3, column u: a sample is missing"));
    let hidden = book(&[("One", &one), ("Two", &two)], true, "");
    assert_eq!(read("rig.xlsx", &hidden, None).unwrap().record.u, [3.0]);
    assert_eq!(read("rig.xlsx", &hidden, Some("One")).unwrap().record.u, [1.0]);
    let error = read("rig.xlsx", &book(&sheets[..2], false, ""), None).unwrap_err();
    assert!(error.contains("operator"), "{error}");
    let error = read("rig.xlsx", &book(&sheets[..1], false, ""), None).unwrap_err();
    assert_eq!(error, "no worksheet with a cell");
    let error = read("rig.csv", b"u,y\n1,2\n", Some("Two")).unwrap_err();
    assert_eq!(error, "--sheet is for .xlsx");
}

#[test]
fn more_than_the_file_can_hold_is_refused_before_memory_is_taken() {
    let far = "<row r=\"1\"><c r=\"A1\"><v>1</v></c></row><row r=\"1048576\"><c r=\"XFD1048576\"><v>1</v></c></row>";
    let error = text(&book(&[("Data", far)], false, "")).unwrap_err();
    assert_eq!(error, "too much for so short a file; expected at most 16 MiB unpacked");
    let beyond = "<row r=\"4294967290\"><c r=\"A4294967290\"><v>1</v></c></row>";
    let error = text(&book(&[("Data", beyond)], false, "")).unwrap_err();
    assert!(
        error.contains("expected at most 1048576 rows") || error.contains("no workbook"),
        "{error}"
    );
    let blank = " ".repeat(17 << 20);
    let error = text(&book(&[("Data", &blank)], false, "")).unwrap_err();
    assert_eq!(error, "too much for so short a file; expected at most 16 MiB unpacked");
    let back = "<row r=\"2\"><c r=\"A2\"><v>1</v></c></row><row r=\"1\"><c r=\"A1\"><v>1</v></c></row>";
    let error = text(&book(&[("Data", back)], false, "")).unwrap_err();
    assert_eq!(error, "row 1: cells are not in order");
    let old = [&[0xd0, 0xcf, 0x11, 0xe0, 0xa1, 0xb1][..], &[0; 600]].concat();
    assert!(text(&old).unwrap_err().contains("with a password, or of Excel 97"));
}

/// A word about the file, or the same cells.
#[test]
fn changed_bytes_do_no_harm() {
    let sheet = rows(&[&["s:u", "s:y"], &["1", "2"], &["1:45985.5", "4"]]);
    let bytes = book(&[("Data", &sheet)], false, "");
    let right = text(&bytes).unwrap();
    for at in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            if let Ok(found) = text(&changed) {
                assert_eq!(found, right, "byte {at} by {flip}");
            }
        }
        let _ = text(&bytes[..at]);
    }
}
