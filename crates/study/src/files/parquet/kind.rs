//! The kinds of columns: numbers, texts, and others, whose values are not read.

use super::thrift::Found;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use polars_arrow::datatypes::{ArrowDataType, TimeUnit};
use polars_arrow_format::ipc::planus::{Error, ReadAsRoot as _};
use polars_arrow_format::ipc::{FieldRef, MessageHeaderRef, MessageRef, TypeRef};
use polars_parquet::parquet::schema::types::PhysicalType;

/// The forms of numbers.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) enum Number {
    Boolean,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
    /// Whole numbers of 32 or 64 bits, divided by so many powers of ten.
    Decimal32(u8),
    Decimal64(u8),
    /// Whole numbers in so many bytes each, the highest first, or in any number.
    Bytes(Option<u8>, u8),
}

/// The unit and origin of times, since 1970 or since midnight.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) struct Clock {
    pub(super) nanoseconds: i64,
    pub(super) of_day: bool,
    physical: i64,
}

/// The kind of the values of a column.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) enum Kind {
    Number(Number),
    Time(Clock),
    Text,
    /// In words.
    Other(&'static str),
}

/// The type of a column in the schema beside its physical type.
#[derive(Default)]
pub(super) struct Annotation {
    /// By the older rule.
    pub(super) converted: Option<i64>,
    /// The number of its kind, and what it says: the bits of whole numbers with whether they have a sign, the scale of
    /// decimals, the unit of times.
    pub(super) logical: Option<(i64, [i64; 2])>,
    /// The bytes of a value, and the scale of decimals by the older rule.
    pub(super) length: i64,
    pub(super) scale: i64,
}

const DAY: i64 = 86_400_000_000_000;
/// Milliseconds, microseconds, nanoseconds.
const UNITS: [i64; 3] = [1_000_000, 1000, 1];

impl Kind {
    /// The kind of a column by its physical type and what the schema says beside it; the numbers are those of
    /// `parquet.thrift`.
    pub(super) fn of(physical: i64, beside: &Annotation) -> Self {
        const WHOLE: i64 = 10;
        let signed = match (beside.logical, beside.converted) {
            (None, None) => None,
            (Some((WHOLE, [_, signed])), _) => Some(signed != 0),
            (None, Some(11..=14)) => Some(false),
            (None, Some(15..=18)) => Some(true),
            (Some((1, _)), _) | (None, Some(0)) if physical == 6 => return Self::Text,
            (Some((5, [scale, _])), _) => return Self::decimal(physical, beside.length, scale),
            (None, Some(5)) => return Self::decimal(physical, beside.length, beside.scale),
            (Some((6, _)), _) | (None, Some(6)) => return Self::time(physical, DAY, false),
            (Some((kind @ (7 | 8), [_, unit @ 1..=3])), _) => {
                return Self::time(physical, UNITS[unit as usize - 1], kind == 7);
            }
            (None, Some(kind @ 7..=10)) => {
                return Self::time(physical, UNITS[1 - kind as usize % 2], kind < 9);
            }
            (Some((15, _)), _) if physical == 7 && beside.length == 2 => {
                return Self::Number(Number::F16);
            }
            _ => return Self::Other("no numbers"),
        };
        Self::Number(match (physical, signed) {
            (0, None) => Number::Boolean,
            (1, Some(false)) => Number::U32,
            (1, _) => Number::I32,
            (2, Some(false)) => Number::U64,
            (2, _) => Number::I64,
            (4, None) => Number::F32,
            (5, None) => Number::F64,
            (3, None) => return Self::time(3, 1, false),
            _ => return Self::Other("no numbers"),
        })
    }

    fn decimal(physical: i64, length: i64, scale: i64) -> Self {
        let Ok(scale) = u8::try_from(scale) else {
            return Self::Other("decimals of no known scale");
        };
        Self::Number(match (physical, length) {
            (1, _) => Number::Decimal32(scale),
            (2, _) => Number::Decimal64(scale),
            (6, _) => Number::Bytes(None, scale),
            (7, 1..=32) => Number::Bytes(Some(length as u8), scale),
            _ => return Self::Other("decimals of no known size"),
        })
    }

    fn time(physical: i64, nanoseconds: i64, of_day: bool) -> Self {
        match physical {
            1..=3 => Self::Time(Clock {
                nanoseconds,
                of_day,
                physical,
            }),
            _ => Self::Other("times of no known size"),
        }
    }

    /// How its values are stored, and how they are to be read; `None` if they are not read.
    pub(super) fn types(self) -> Option<(PhysicalType, ArrowDataType)> {
        use ArrowDataType as A;
        use PhysicalType as P;
        Some(match self {
            Self::Number(Number::Boolean) => (P::Boolean, A::Boolean),
            Self::Number(Number::I32 | Number::Decimal32(_)) => (P::Int32, A::Int32),
            Self::Number(Number::U32) => (P::Int32, A::UInt32),
            Self::Number(Number::I64 | Number::Decimal64(_)) => (P::Int64, A::Int64),
            Self::Number(Number::U64) => (P::Int64, A::UInt64),
            Self::Number(Number::F32) => (P::Float, A::Float32),
            Self::Number(Number::F64) => (P::Double, A::Float64),
            Self::Number(Number::F16) => (P::FixedLenByteArray(2), A::FixedSizeBinary(2)),
            Self::Number(Number::Bytes(None, _)) => (P::ByteArray, A::BinaryView),
            Self::Number(Number::Bytes(Some(length), _)) => {
                let length = usize::from(length);
                (P::FixedLenByteArray(length), A::FixedSizeBinary(length))
            }
            Self::Time(clock) => match clock.physical {
                1 => (P::Int32, A::Int32),
                2 => (P::Int64, A::Int64),
                _ => (P::Int96, A::Timestamp(TimeUnit::Nanosecond, None)),
            },
            Self::Text => (P::ByteArray, A::Utf8View),
            Self::Other(_) => return None,
        })
    }
}

/// The columns that are no numbers by the schema of Arrow, which Parquet's own has no words for: durations, extensions.
/// Of nested columns nothing is read.
pub(super) fn no_numbers(schema: &[u8], most: usize) -> Found<Vec<(String, &'static str)>> {
    const WRONG: &str = "its schema of Arrow cannot be read";
    let bytes = STANDARD.decode(schema).map_err(|_| WRONG)?;
    let message = match bytes.split_at_checked(8) {
        Some((head, rest)) if head.starts_with(&[0xff; 4]) => rest,
        _ => &bytes,
    };
    let names = || -> Result<_, Error> {
        let mut names = Vec::new();
        if let Some(MessageHeaderRef::Schema(schema)) = MessageRef::read_as_root(message)?.header()? {
            for field in schema.fields()?.into_iter().flatten().take(most) {
                let field = field?;
                let what = no_number(&field)?;
                names.extend(what.and_then(|what| Some((name(&field)?, what))));
            }
        }
        Ok(names)
    };
    names().map_err(|_| WRONG)
}

fn name(field: &FieldRef<'_>) -> Option<String> {
    field.name().ok().flatten().map(str::to_owned)
}

/// Names of columns that are no numbers.
fn no_number(field: &FieldRef<'_>) -> Result<Option<&'static str>, Error> {
    /// Largest number of words about a column.
    const WORDS: usize = 1000;
    for pair in field.custom_metadata()?.into_iter().flatten().take(WORDS) {
        if pair?.key()? == Some("ARROW:extension:name") {
            return Ok(Some("another program's own type"));
        }
    }
    Ok(match field.type_()? {
        Some(TypeRef::Int(_) | TypeRef::Bool(_) | TypeRef::FloatingPoint(_) | TypeRef::Decimal(_)) => None,
        Some(TypeRef::Duration(_)) => Some("durations"),
        _ => Some("no numbers"),
    })
}
