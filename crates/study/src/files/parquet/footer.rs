//! The footer of a Parquet file: columns, groups of rows, and where their bytes are. It is read by our own
//! hand, so that nothing in it is believed before it is held against the length of the file.

use super::kind::{Annotation, Kind, Number, no_numbers};
use super::thrift::{Found, Thrift, Wire};
use std::ops::Range;

/// Largest number of columns, with those within groups.
pub(super) const MOST_COLUMNS: usize = 10_000;
/// Largest number of groups within each other.
pub(super) const DEEPEST: usize = 32;
/// Largest number of groups of rows; the bytes of the footer are a limit too.
const MOST_GROUPS: usize = 1 << 24;
/// The key of the schema that Arrow stores.
const ARROW: &[u8] = b"ARROW:schema";

/// A column at the top of the table. A nested structure is one column, of no kind that can be read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub name: String,
    pub kind: Kind,
    /// Whether a value may be missing.
    pub(super) optional: bool,
    /// Its place among the chunks of a group of rows, if it is not nested.
    pub(super) chunk: usize,
}

/// The bytes of a column in a group of rows.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    pub codec: i64,
    pub bytes: Range<u64>,
}

/// A group of rows, with a chunk for each column.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    pub rows: u64,
    pub chunks: Vec<Chunk>,
}

#[derive(Debug, Default)]
pub(super) struct Footer {
    pub columns: Vec<Column>,
    pub groups: Vec<Group>,
    pub rows: u64,
}

/// An element of the schema: a column, or a group with so many.
#[derive(Default)]
struct Element {
    name: String,
    children: i64,
    repetition: i64,
    /// The physical type.
    of: i64,
    annotation: Annotation,
}

impl Column {
    /// Its name and its kind; whole numbers are one kind, since older builds wrote them without a sign.
    pub(crate) fn is(&self) -> (&str, Kind) {
        let kind = match self.kind {
            Kind::Number(Number::U32) => Kind::Number(Number::I32),
            Kind::Number(Number::U64) => Kind::Number(Number::I64),
            other => other,
        };
        (&self.name, kind)
    }
}

impl Footer {
    /// Reads a footer. The data lie before `end`.
    pub(super) fn read(bytes: &[u8], end: u64) -> Found<Self> {
        let (mut schema, mut groups, mut arrow) = (Vec::new(), Vec::new(), None);
        let mut rows = 0;
        Thrift::new(bytes).fields(&mut |field, wire, thrift| match field {
            2 => thrift.list(wire, MOST_COLUMNS, &mut |thrift| {
                schema.push(element(thrift)?);
                Ok(())
            }),
            3 => counted(thrift.integer(wire)?).map(|count| rows = count),
            4 => thrift.list(wire, MOST_GROUPS, &mut |thrift| {
                groups.push(group(thrift, end)?);
                Ok(())
            }),
            5 => thrift.list(wire, usize::MAX, &mut |thrift| {
                let (key, value) = pair(thrift)?;
                if key == ARROW {
                    arrow = Some(value);
                }
                Ok(())
            }),
            _ => thrift.skip(wire),
        })?;
        let (mut columns, chunks) = columns(&schema)?;
        if let Some(schema) = arrow {
            let others = no_numbers(schema, MOST_COLUMNS)?;
            for column in &mut columns {
                let other = others.iter().find(|(name, _)| *name == column.name);
                if let (Kind::Number(_), Some((_, what))) = (column.kind, other) {
                    column.kind = Kind::Other(what);
                }
            }
        }
        if groups.iter().any(|group: &Group| group.chunks.len() != chunks) {
            return Err("a group of rows has other columns than its schema");
        }
        let all = groups.iter().map(|group| group.rows);
        if all.fold(0, u64::saturating_add) != rows {
            return Err("its groups have other numbers of rows than it says");
        }
        Ok(Self { columns, groups, rows })
    }
}

fn counted(number: i64) -> Found<u64> {
    u64::try_from(number).map_err(|_| "a number of its footer is negative")
}

fn element(thrift: &mut Thrift<'_>) -> Found<Element> {
    let mut own = Element {
        of: -1,
        ..Element::default()
    };
    thrift.fields(&mut |field, wire, thrift| {
        match field {
            1 => own.of = thrift.integer(wire)?,
            2 => own.annotation.length = thrift.integer(wire)?,
            3 => own.repetition = thrift.integer(wire)?,
            4 => own.name = String::from_utf8_lossy(thrift.binary(wire)?).into_owned(),
            5 => own.children = thrift.integer(wire)?,
            6 => own.annotation.converted = Some(thrift.integer(wire)?),
            7 => own.annotation.scale = thrift.integer(wire)?,
            10 => own.annotation.logical = logical(thrift, wire)?,
            _ => thrift.skip(wire)?,
        }
        Ok(())
    })?;
    Ok(own)
}

/// The number of a logical type, and the bits of whole numbers with whether they have a sign, the scale of decimals, or
/// the unit of times as the second number.
fn logical(thrift: &mut Thrift<'_>, wire: Wire) -> Found<Option<(i64, [i64; 2])>> {
    let mut own = None;
    thrift.structure(wire, &mut |field, wire, thrift| {
        let mut bits = [0; 2];
        thrift.structure(wire, &mut |part, wire, thrift| match (field, part) {
            (10, 1 | 2) | (5, 1) => {
                bits[part as usize - 1] = thrift.integer(wire)?;
                Ok(())
            }
            (7 | 8, 2) => thrift.structure(wire, &mut |unit, wire, thrift| {
                bits[1] = unit;
                thrift.skip(wire)
            }),
            _ => thrift.skip(wire),
        })?;
        own = Some((field, bits));
        Ok(())
    })?;
    Ok(own)
}

/// The columns at the top, and how many chunks a group of rows has.
fn columns(schema: &[Element]) -> Found<(Vec<Column>, usize)> {
    const WRONG: &str = "its schema is not a tree of columns";
    let (root, rest) = schema.split_first().ok_or("it has no schema")?;
    // How many columns are still to come, in each group around the next one.
    let mut open = vec![counted(root.children)?];
    let (mut columns, mut chunks) = (Vec::new(), 0);
    for element in rest {
        while open.last() == Some(&0) {
            open.pop();
        }
        let depth = open.len();
        *open.last_mut().ok_or(WRONG)? -= 1;
        let is_group = element.children > 0;
        if depth == 1 {
            let plain = !is_group && element.repetition < 2;
            let kind = if plain {
                Kind::of(element.of, &element.annotation)
            } else {
                Kind::Other("nested columns")
            };
            columns.push(Column {
                name: element.name.clone(),
                kind,
                optional: element.repetition == 1,
                chunk: chunks,
            });
        }
        if is_group {
            open.push(counted(element.children)?);
        } else {
            chunks += 1;
        }
        if open.len() > DEEPEST {
            return Err("its columns are nested too deeply");
        }
    }
    if open.iter().any(|left| *left > 0) {
        return Err(WRONG);
    }
    Ok((columns, chunks))
}

fn group(thrift: &mut Thrift<'_>, end: u64) -> Found<Group> {
    let mut own = Group::default();
    thrift.fields(&mut |field, wire, thrift| match field {
        1 => thrift.list(wire, MOST_COLUMNS, &mut |thrift| {
            own.chunks.push(chunk(thrift, end)?);
            Ok(())
        }),
        3 => counted(thrift.integer(wire)?).map(|rows| own.rows = rows),
        _ => thrift.skip(wire),
    })?;
    Ok(own)
}

fn chunk(thrift: &mut Thrift<'_>, end: u64) -> Found<Chunk> {
    let mut own = None;
    thrift.fields(&mut |field, wire, thrift| match field {
        1 => Err("a column of it is in another file"),
        3 => {
            let (mut codec, mut length, mut starts) = (0, 0, [None; 2]);
            thrift.structure(wire, &mut |field, wire, thrift| {
                match field {
                    4 => codec = thrift.integer(wire)?,
                    7 => length = counted(thrift.integer(wire)?)?,
                    9 => starts[0] = Some(counted(thrift.integer(wire)?)?),
                    11 => starts[1] = Some(counted(thrift.integer(wire)?)?),
                    _ => thrift.skip(wire)?,
                }
                Ok(())
            })?;
            // Some programs write 0 where there is no dictionary.
            let starts = starts.into_iter().flatten().filter(|start| *start > 0);
            let start = starts.min().ok_or("a column has no place in it")?;
            let bytes = start..start.saturating_add(length);
            if bytes.end > end {
                return Err("a column reaches beyond its end");
            }
            own = Some(Chunk { codec, bytes });
            Ok(())
        }
        _ => thrift.skip(wire),
    })?;
    own.ok_or("a column has no place in it")
}

fn pair<'a>(thrift: &mut Thrift<'a>) -> Found<(&'a [u8], &'a [u8])> {
    let mut own = [&[][..]; 2];
    thrift.fields(&mut |field, wire, thrift| match field {
        1 | 2 => thrift.binary(wire).map(|bytes| own[field as usize - 1] = bytes),
        _ => thrift.skip(wire),
    })?;
    let [key, value] = own;
    Ok((key, value))
}
