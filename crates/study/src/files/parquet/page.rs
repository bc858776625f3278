//! The heads of the pages of a column, counted before any page is decoded.

use super::thrift::{Found, Thrift, Wire};

/// The size of pages in memory.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Pages {
    /// The values in all pages of data.
    pub(super) values: u64,
    /// The bytes of all pages after decompression, and of the values of dictionaries.
    pub(super) bytes: u64,
}

/// Bytes of a value of a dictionary in memory, at most.
const VALUE: u64 = 16;

/// Counts the pages of a column with so many values.
pub(super) fn count(bytes: &[u8], values: u64) -> Found<Pages> {
    let (mut rest, mut all) = (bytes, Pages::default());
    while all.values < values {
        let mut thrift = Thrift::new(rest);
        let head = head(&mut thrift)?;
        rest = thrift
            .rest()
            .get(head.compressed..)
            .ok_or("a page is longer than its column")?;
        all.values = all.values.saturating_add(head.values);
        let dictionary = head.dictionary.saturating_mul(VALUE);
        all.bytes = all.bytes.saturating_add(head.bytes).saturating_add(dictionary);
    }
    Ok(all)
}

#[derive(Default)]
struct Head {
    bytes: u64,
    compressed: usize,
    values: u64,
    dictionary: u64,
}

/// Reads a head. The library takes a field by its number alone, so that each that it knows must be of its type.
fn head(thrift: &mut Thrift<'_>) -> Found<Head> {
    let (mut own, mut kind) = (Head::default(), -1);
    thrift.fields(&mut |field, wire, thrift| {
        match field {
            1 => kind = thrift.integer(wire)?,
            2 => own.bytes = size(thrift, wire)?,
            3 => own.compressed = size(thrift, wire)? as usize,
            4 => drop(thrift.integer(wire)?),
            5 | 8 => {
                thrift.structure(wire, &mut |part, wire, thrift| match (field, part) {
                    (_, 1) => size(thrift, wire).map(|count| own.values = count),
                    (5, 2..=4) | (8, 2..=7) => size(thrift, wire).map(drop),
                    (5, 5) | (8, 8) => statistics(thrift, wire),
                    _ => thrift.skip(wire),
                })?;
            }
            6 => thrift.structure(wire, &mut |_, wire, thrift| thrift.skip(wire))?,
            7 => thrift.structure(wire, &mut |part, wire, thrift| match part {
                1 => size(thrift, wire).map(|count| own.dictionary = count),
                2 | 3 => thrift.integer(wire).map(drop),
                _ => thrift.skip(wire),
            })?,
            _ => thrift.skip(wire)?,
        }
        Ok(())
    })?;
    match kind {
        0 | 3 => own.dictionary = 0,
        2 => own.values = 0,
        _ => return Err("a page of no known kind"),
    }
    Ok(own)
}

fn statistics(thrift: &mut Thrift<'_>, wire: Wire) -> Found<()> {
    thrift.structure(wire, &mut |field, wire, thrift| match field {
        1 | 2 | 5 | 6 => thrift.binary(wire).map(drop),
        3 | 4 | 7 | 8 => thrift.integer(wire).map(drop),
        _ => thrift.skip(wire),
    })
}

fn size(thrift: &mut Thrift<'_>, wire: Wire) -> Found<u64> {
    let number = thrift.integer(wire)?;
    u64::try_from(number).map_err(|_| "a number of a page is negative")
}
