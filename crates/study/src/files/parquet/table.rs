//! The one door to Parquet tables: what a file says of itself is held against its length before memory is taken, and a
//! panic of the library that decodes pages is an error of the file.

use super::footer::{Chunk, Column, Footer};
use super::kind::{Kind, Number};
use super::page;
use crate::files::quietly::quietly;
use crate::text::visible;
use polars_arrow::array::{Array, BinaryViewArray, BooleanArray, FixedSizeBinaryArray, PrimitiveArray, Utf8ViewArray};
use polars_arrow::datatypes::Field;
use polars_arrow::types::NativeType;
use polars_parquet::parquet::compression::Compression;
use polars_parquet::parquet::metadata::Descriptor;
use polars_parquet::parquet::read::PageMetaData;
use polars_parquet::parquet::schema::Repetition;
use polars_parquet::parquet::schema::types::PrimitiveType;
use polars_parquet::read::{BasicDecompressor, PageReader, column_iter_to_arrays};
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::Range;

/// Largest footer in bytes.
const FOOTER: u64 = 16 << 20;
/// A file may become so many bytes in memory, and so many more for each of its own.
const LEAST: u64 = 64 << 20;
const EACH: u64 = 64;

/// Values of a column.
#[derive(Debug)]
pub(crate) enum Values {
    Numbers(Vec<Option<f64>>),
    /// Times as they are counted.
    Times(Vec<Option<i64>>),
    Texts(Vec<Utf8ViewArray>),
}

/// An open table.
pub(crate) struct Table<R> {
    from: R,
    footer: Footer,
    /// Most bytes in memory.
    room: u64,
}

impl<R: Read + Seek> Table<R> {
    /// Reads the footer of a table.
    ///
    /// # Errors
    /// In words: what is wrong with it.
    pub(crate) fn open(mut from: R) -> Result<Self, String> {
        const WHOLE: &str = "not a whole Parquet file; it begins and ends with PAR1";
        let length = from.seek(SeekFrom::End(0)).map_err(|error| error.to_string())?;
        if length < 12 {
            return Err(WHOLE.to_owned());
        }
        let head = bytes(&mut from, 0..4)?;
        let end = bytes(&mut from, length - 8..length)?;
        if head != *b"PAR1" || end[4..] != *b"PAR1" {
            return Err(WHOLE.to_owned());
        }
        let size = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
        if size > length - 12 {
            return Err(damaged("its footer is longer than the file"));
        }
        if size > FOOTER {
            return Err(format!("a footer of {size} bytes; at most {FOOTER} are read"));
        }
        let start = length - 8 - size;
        let footer = bytes(&mut from, start..start + size)?;
        let footer = Footer::read(&footer, start).map_err(damaged)?;
        let room = LEAST.saturating_add(EACH.saturating_mul(length));
        Ok(Self { from, footer, room })
    }

    pub(crate) fn columns(&self) -> &[Column] {
        &self.footer.columns
    }

    /// The number of its rows.
    pub(crate) fn rows(&self) -> u64 {
        self.footer.rows
    }

    /// The numbers of rows of its groups.
    pub(crate) fn groups(&self) -> impl Iterator<Item = u64> {
        self.footer.groups.iter().map(|group| group.rows)
    }

    /// Refuses rows of so many columns that would take too much memory.
    pub(crate) fn fits(&self, rows: u64, columns: usize) -> Result<(), String> {
        let bytes = rows.saturating_mul(8).saturating_mul(columns as u64);
        if bytes <= self.room {
            return Ok(());
        }
        let room = self.room >> 20;
        Err(format!(
            "{rows} rows of {columns} columns from so short a file; expected at most {room} MiB of numbers"
        ))
    }

    /// Reads a column in a group of rows, both of which there are. Of a column of another kind there are no numbers.
    ///
    /// # Errors
    /// In words: what is wrong with it.
    pub(crate) fn read(&mut self, group: usize, column: usize) -> Result<Values, String> {
        let (group, column) = (&self.footer.groups[group], self.footer.columns[column].clone());
        if column.kind.types().is_none() {
            return Ok(Values::Numbers(Vec::new()));
        }
        let (rows, chunk) = (group.rows, group.chunks[column.chunk].clone());
        let is_wide = matches!(column.kind, Kind::Text | Kind::Number(Number::Bytes(..)));
        self.fits(rows, if is_wide { 2 } else { 1 })?;
        let pages = bytes(&mut self.from, chunk.bytes.clone())?;
        let room = self.room;
        let read = quietly(
            || decoded(pages, &chunk, &column, rows, room),
            &damaged("a page cannot be decoded"),
        );
        read.map_err(|reason| format!("{reason} (column {})", visible(&column.name)))
    }

    /// Reads some rows of a column.
    ///
    /// # Errors
    /// In words: what is wrong with it.
    pub(crate) fn read_rows(&mut self, column: usize, rows: &Range<u64>) -> Result<Values, String> {
        let counts: Vec<u64> = self.groups().collect();
        let (mut numbers, mut texts, mut first) = (Vec::new(), Vec::new(), 0);
        for (group, count) in counts.into_iter().enumerate() {
            let within = rows.start.max(first)..rows.end.min(first + count);
            if !within.is_empty() {
                let part = (within.start - first) as usize..(within.end - first) as usize;
                match self.read(group, column)? {
                    Values::Numbers(own) => {
                        numbers.extend_from_slice(own.get(part).unwrap_or_default());
                    }
                    Values::Texts(own) => texts.extend(sliced(own, part)),
                    Values::Times(_) => {}
                }
            }
            first += count;
        }
        Ok(match self.footer.columns[column].kind {
            Kind::Text => Values::Texts(texts),
            _ => Values::Numbers(numbers),
        })
    }
}

/// The part of an array of several parts.
fn sliced(arrays: Vec<Utf8ViewArray>, part: Range<usize>) -> impl Iterator<Item = Utf8ViewArray> {
    let mut first = 0;
    arrays.into_iter().filter_map(move |array| {
        let (from, to) = (first, first + array.len());
        first = to;
        let (start, end) = (part.start.max(from), part.end.min(to));
        (start < end).then(|| array.sliced(start - from, end - start))
    })
}

fn damaged(reason: &str) -> String {
    format!("a damaged Parquet file: {reason}")
}

fn bytes(from: &mut (impl Read + Seek), place: Range<u64>) -> Result<Vec<u8>, String> {
    let length = place.end - place.start;
    let mut own = Vec::new();
    let mut read = || {
        own.try_reserve_exact(length as usize)?;
        from.seek(SeekFrom::Start(place.start))?;
        from.by_ref().take(length).read_to_end(&mut own)
    };
    read().map_err(|error| error.to_string())?;
    if own.len() as u64 == length {
        Ok(own)
    } else {
        Err(damaged("it ends too early"))
    }
}

/// Decodes the pages of a chunk.
fn decoded(pages: Vec<u8>, chunk: &Chunk, column: &Column, rows: u64, room: u64) -> Result<Values, String> {
    let first_line = |error: &dyn std::fmt::Display| {
        let text = error.to_string();
        damaged(text.lines().next().unwrap_or_default())
    };
    let (physical, dtype) = column.kind.types().ok_or_else(|| damaged("no numbers"))?;
    let mut primitive = PrimitiveType::from_physical(column.name.as_str().into(), physical);
    if !column.optional {
        primitive.field_info.repetition = Repetition::Required;
    }
    let about = PageMetaData::new(
        0,
        rows as i64,
        compression(chunk.codec)?,
        Descriptor {
            primitive_type: primitive.clone(),
            max_def_level: i16::from(column.optional),
            max_rep_level: 0,
        },
    );
    // Pages are counted before one of them is decoded.
    let found = page::count(&pages, rows).map_err(damaged)?;
    if found.values != rows {
        return Err(damaged("its pages have other numbers of rows than its footer"));
    }
    if found.bytes > room {
        let (bytes, room) = (found.bytes, room >> 20);
        return Err(format!(
            "pages of {bytes} bytes from so short a file; expected at most {room} MiB"
        ));
    }
    let longest = pages.len();
    let field = Field::new(column.name.as_str().into(), dtype, column.optional);
    let pages = PageReader::new_with_page_meta(Cursor::new(pages.into()), about, Vec::new(), longest);
    let pages = BasicDecompressor::new(pages, Vec::new());
    let arrays = column_iter_to_arrays(vec![pages], vec![&primitive], field, None);
    let (arrays, _) = arrays.map_err(|error| first_line(&error))?;
    let values = gathered(&arrays, column.kind).filter(|values| values.len() as u64 == rows);
    values.ok_or_else(|| damaged("a page has other values than its column"))
}

fn compression(codec: i64) -> Result<Compression, String> {
    use Compression as C;
    let known = [
        C::Uncompressed,
        C::Snappy,
        C::Gzip,
        C::Lzo,
        C::Brotli,
        C::Lz4,
        C::Zstd,
        C::Lz4Raw,
    ];
    let place = usize::try_from(codec).ok();
    let own = place.and_then(|place| known.get(place).copied());
    own.ok_or_else(|| damaged("a compression of no known kind"))
}

/// The values of the arrays of a column; `None` if they are of another kind.
fn gathered(arrays: &[Box<dyn Array>], kind: Kind) -> Option<Values> {
    fn numbers<T: NativeType>(array: &dyn Array, to: &mut Vec<Option<f64>>, cast: fn(T) -> f64) -> Option<()> {
        let array = array.as_any().downcast_ref::<PrimitiveArray<T>>()?;
        to.extend(array.iter().map(|value| value.copied().map(cast)));
        Some(())
    }
    if kind == Kind::Text {
        let arrays = arrays
            .iter()
            .map(|array| array.as_any().downcast_ref::<Utf8ViewArray>().cloned());
        return arrays.collect::<Option<_>>().map(Values::Texts);
    }
    if matches!(kind, Kind::Time(_)) {
        let mut all = Vec::new();
        for array in arrays {
            let days = array.as_any().downcast_ref::<PrimitiveArray<i32>>();
            let whole = array.as_any().downcast_ref::<PrimitiveArray<i64>>();
            all.extend(days.into_iter().flatten().map(|value| value.copied().map(i64::from)));
            all.extend(whole.into_iter().flatten().map(Option::<&_>::copied));
        }
        return Some(Values::Times(all));
    }
    let mut all = Vec::with_capacity(arrays.iter().map(|array| array.len()).sum());
    for array in arrays {
        let array = &**array;
        match kind {
            Kind::Number(Number::Boolean) => {
                let array = array.as_any().downcast_ref::<BooleanArray>()?;
                all.extend(array.iter().map(|value| value.map(f64::from)));
            }
            Kind::Number(Number::I32) => numbers::<i32>(array, &mut all, f64::from)?,
            Kind::Number(Number::U32) => numbers::<u32>(array, &mut all, f64::from)?,
            Kind::Number(Number::I64) => numbers::<i64>(array, &mut all, |x| x as f64)?,
            Kind::Number(Number::U64) => numbers::<u64>(array, &mut all, |x| x as f64)?,
            Kind::Number(Number::F32) => numbers::<f32>(array, &mut all, f64::from)?,
            Kind::Number(Number::F64) => numbers::<f64>(array, &mut all, |x| x)?,
            Kind::Number(Number::Decimal32(scale)) => {
                let array = array.as_any().downcast_ref::<PrimitiveArray<i32>>()?;
                all.extend(array.iter().map(|value| decimal(i128::from(*value?), scale)));
            }
            Kind::Number(Number::Decimal64(scale)) => {
                let array = array.as_any().downcast_ref::<PrimitiveArray<i64>>()?;
                all.extend(array.iter().map(|value| decimal(i128::from(*value?), scale)));
            }
            Kind::Number(Number::F16) => {
                let array = array.as_any().downcast_ref::<FixedSizeBinaryArray>()?;
                all.extend(array.iter().map(|value| value?.try_into().ok().map(half)));
            }
            Kind::Number(Number::Bytes(Some(_), scale)) => {
                let array = array.as_any().downcast_ref::<FixedSizeBinaryArray>()?;
                all.extend(array.iter().map(|value| whole(value?, scale)));
            }
            Kind::Number(Number::Bytes(None, scale)) => {
                let array = array.as_any().downcast_ref::<BinaryViewArray>()?;
                all.extend(array.iter().map(|value| whole(value?, scale)));
            }
            Kind::Time(_) | Kind::Text | Kind::Other(_) => return None,
        }
    }
    Some(Values::Numbers(all))
}

/// A whole number over a power of ten, rounded once.
fn decimal(number: i128, scale: u8) -> Option<f64> {
    format!("{number}e-{scale}").parse().ok()
}

/// A whole number in bytes, the highest first, over a power of ten; NaN if it has more than 128 bits.
fn whole(bytes: &[u8], scale: u8) -> Option<f64> {
    let is_negative = bytes.first().is_some_and(|byte| *byte > 127);
    let (sign, start) = if is_negative { (255, -1) } else { (0, 0) };
    let (high, low) = bytes.split_at(bytes.len().saturating_sub(16));
    let same = |first: &u8| (*first > 127) == is_negative;
    let fits = high.iter().all(|byte| *byte == sign) && low.first().is_none_or(same);
    let number = low.iter().fold(start, |all: i128, byte| (all << 8) | i128::from(*byte));
    if fits { decimal(number, scale) } else { Some(f64::NAN) }
}

/// A float of 16 bits.
fn half(bytes: [u8; 2]) -> f64 {
    let bits = u16::from_le_bytes(bytes);
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2_f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

impl Values {
    /// The numbers; none of texts.
    pub(crate) fn numbers(&self) -> &[Option<f64>] {
        match self {
            Self::Numbers(numbers) => numbers,
            Self::Texts(_) | Self::Times(_) => &[],
        }
    }

    /// The texts; none of numbers.
    pub(crate) fn texts(&self) -> impl Iterator<Item = Option<&str>> {
        let arrays: &[Utf8ViewArray] = match self {
            Self::Numbers(_) | Self::Times(_) => &[],
            Self::Texts(texts) => texts,
        };
        arrays.iter().flat_map(|array| array.iter())
    }

    /// Whether others are the same, numbers bit for bit.
    pub(crate) fn are(&self, other: &Self) -> bool {
        let bits = |value: &Option<f64>| value.map(f64::to_bits);
        let (own, others) = (self.numbers().iter(), other.numbers().iter());
        self.len() == other.len() && own.map(bits).eq(others.map(bits)) && self.texts().eq(other.texts())
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::Times(times) => times.len(),
            Self::Texts(texts) => texts.iter().map(Array::len).sum(),
        }
    }
}
