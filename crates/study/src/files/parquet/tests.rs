//! Every type of number, decimal and time in Parquet is read as what it is.

use super::{ParquetText, parquet_of};
use asobench_identification::data::csv::{ReadOptions, Table, read_table, uses};
use polars_arrow::array::{Array, FixedSizeBinaryArray, PrimitiveArray, Utf8ViewArray};
use polars_arrow::datatypes::{ArrowDataType, TimeUnit};

fn read(columns: &[(&str, Box<dyn Array>)]) -> Result<Table, String> {
    let named = columns.iter().map(|(name, array)| ((*name).to_owned(), array.clone()));
    let bytes = parquet_of(named.collect()).map_err(|error| error.to_string())?;
    let options = ReadOptions::default();
    let text = ParquetText::open(bytes.as_slice(), |names| uses(names, &options))?;
    read_table(text, &options).map_err(|error| error.to_string())
}

fn numbers<T: polars_arrow::types::NativeType>(values: [T; 3]) -> Box<dyn Array> {
    PrimitiveArray::from_vec(values.to_vec()).boxed()
}

#[test]
fn all_types_of_numbers() {
    let decimal = |dtype: ArrowDataType, values: [i128; 3]| PrimitiveArray::from_vec(values.to_vec()).to(dtype).boxed();
    let expected = [-1.0, 0.0, 100.0];
    let unsigned = [1.0, 0.0, 200.0];
    let hundredths = [-1.25, 0.0, 12345.5];
    for (u, expected) in [
        (numbers([-1_i8, 0, 100]), expected),
        (numbers([-1_i16, 0, 100]), expected),
        (numbers([-1_i32, 0, 100]), expected),
        (numbers([-1_i64, 0, 100]), expected),
        (numbers([1_u8, 0, 200]), unsigned),
        (numbers([1_u16, 0, 200]), unsigned),
        (numbers([1_u32, 0, 200]), unsigned),
        (numbers([1_u64, 0, 200]), unsigned),
        (numbers([-1.0_f32, 0.0, 100.0]), expected),
        (decimal(ArrowDataType::Decimal(8, 2), [-125, 0, 1_234_550]), hundredths),
        (decimal(ArrowDataType::Decimal(16, 2), [-125, 0, 1_234_550]), hundredths),
        (decimal(ArrowDataType::Decimal(38, 2), [-125, 0, 1_234_550]), hundredths),
    ] {
        let dtype = u.dtype().clone();
        let y = numbers([1.5, 2.0, 1e-9]);
        let table = read(&[("u", u), ("y", y)]).unwrap_or_else(|error| panic!("{dtype:?}: {error}"));
        assert_eq!(
            (table.record.u.as_slice(), table.record.y[2]),
            (&expected[..], 1e-9),
            "{dtype:?}"
        );
    }
}

#[test]
fn times_and_texts() {
    let stamps = |unit, scale: i64| {
        let start = 1_764_000_000 * scale;
        let values = [start, start + scale / 2, start + scale];
        PrimitiveArray::from_vec(values.to_vec())
            .to(ArrowDataType::Timestamp(unit, None))
            .boxed()
    };
    let days = PrimitiveArray::from_vec(vec![20_000, 20_001, 20_002]).to(ArrowDataType::Date32);
    let texts =
        Utf8ViewArray::from_slice_values(["24.11.2025 10:00:00,5", "24.11.2025 10:00:01", "24.11.2025 10:00:01,5"]);
    for (times, step) in [
        (stamps(TimeUnit::Millisecond, 1000), 0.5),
        (stamps(TimeUnit::Microsecond, 1_000_000), 0.5),
        (stamps(TimeUnit::Nanosecond, 1_000_000_000), 0.5),
        (days.boxed(), 86_400.0),
        (texts.boxed(), 0.5),
    ] {
        let columns = [("t", times), ("u", numbers([1, 2, 3])), ("y", numbers([1, 0, 1]))];
        assert_eq!(read(&columns).unwrap().times, Some([0.0, step]));
    }
    let words = || Utf8ViewArray::from_slice_values(["a, b", "1", "2"]).boxed();
    let columns =
        |note: &'static str, u: &'static str| [(note, words()), (u, numbers([1, 2, 3])), ("y", numbers([1, 0, 1]))];
    let error = read(&columns("u", "r")).unwrap_err();
    assert!(
        error.contains("line 2, column u: 'a, b' is not a finite number"),
        "{error}"
    );
    // Columns that are not used are not decoded.
    let bytes = FixedSizeBinaryArray::new(ArrowDataType::FixedSizeBinary(3), vec![0; 9].into(), None);
    let all = [
        ("k", numbers([0, 1, 2])),
        ("u", bytes.boxed()),
        ("y", numbers([1, 0, 1])),
    ];
    let error = read(&all).unwrap_err();
    assert!(error.contains("column 'u' has no numbers"), "{error}");
}
