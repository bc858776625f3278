//! The kinds of columns: numbers, texts, and others, whose values are not read.

use super::thrift::Found;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use polars_arrow::datatypes::ArrowDataType;
use polars_arrow_format::ipc::planus::{Error, ReadAsRoot as _};
use polars_arrow_format::ipc::{FieldRef, MessageHeaderRef, MessageRef, Precision, TypeRef};
use polars_parquet::parquet::schema::types::PhysicalType;

/// The forms of numbers.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) enum Number {
    Boolean,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// What the values of a column are.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) enum Kind {
    Number(Number),
    Text,
    /// In words.
    Other(&'static str),
}

/// What a schema says of a column beside its physical type.
#[derive(Default)]
pub(super) struct Annotation {
    /// By the older rule.
    pub(super) converted: Option<i64>,
    /// The number of its kind, and the bits of whole numbers with whether they have a sign.
    pub(super) logical: Option<(i64, [i64; 2])>,
}

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
            (Some((5, _)), _) | (None, Some(5)) => return Self::Other("a decimal"),
            (Some((6..=8, _)), _) | (None, Some(6..=10)) => return Self::Other("a time or a date"),
            _ => return Self::Other("no number"),
        };
        Self::Number(match (physical, signed) {
            (0, None) => Number::Boolean,
            (1, Some(false)) => Number::U32,
            (1, _) => Number::I32,
            (2, Some(false)) => Number::U64,
            (2, _) => Number::I64,
            (4, None) => Number::F32,
            (5, None) => Number::F64,
            (3, _) => return Self::Other("a time or a date"),
            _ => return Self::Other("no number"),
        })
    }

    /// How its values are stored, and how they are to be read; `None` if they are not read.
    pub(super) fn types(self) -> Option<(PhysicalType, ArrowDataType)> {
        use ArrowDataType as A;
        use PhysicalType as P;
        Some(match self {
            Self::Number(Number::Boolean) => (P::Boolean, A::Boolean),
            Self::Number(Number::I32) => (P::Int32, A::Int32),
            Self::Number(Number::U32) => (P::Int32, A::UInt32),
            Self::Number(Number::I64) => (P::Int64, A::Int64),
            Self::Number(Number::U64) => (P::Int64, A::UInt64),
            Self::Number(Number::F32) => (P::Float, A::Float32),
            Self::Number(Number::F64) => (P::Double, A::Float64),
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
        if let Some(MessageHeaderRef::Schema(schema)) =
            MessageRef::read_as_root(message)?.header()?
        {
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

/// What a column is that is no number.
fn no_number(field: &FieldRef<'_>) -> Result<Option<&'static str>, Error> {
    /// Largest number of words about a column.
    const WORDS: usize = 1000;
    for pair in field.custom_metadata()?.into_iter().flatten().take(WORDS) {
        if pair?.key()? == Some("ARROW:extension:name") {
            return Ok(Some("of another program's own type"));
        }
    }
    Ok(match field.type_()? {
        Some(TypeRef::Int(_) | TypeRef::Bool(_)) => None,
        Some(TypeRef::FloatingPoint(of)) if of.precision()? != Precision::Half => None,
        Some(TypeRef::Duration(_)) => Some("a duration"),
        _ => Some("no number"),
    })
}
