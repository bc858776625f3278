//! Tables as Parquet: groups of rows, which any thread encodes and one appends in order.

use polars_arrow::array::{Array, PrimitiveArray, Utf8ViewArray};
use polars_arrow::bitmap::Bitmap;
use polars_arrow::datatypes::{ArrowDataType, ArrowSchema, Field};
use polars_arrow::types::NativeType;
use polars_error::{PolarsError, PolarsResult, polars_ensure};
use polars_parquet::read::ParquetError;
use polars_parquet::write::{
    CompressedPage, CompressionOptions, Compressor, DynIter, DynStreamingIterator, Encoding, FileWriter, ParquetType,
    StatisticsOptions, Version, WriteOptions, ZstdLevel, array_to_columns, fallible_streaming_iterator,
    to_parquet_schema,
};
use polars_utils::pl_str::PlSmallStr;
use std::io::Write;

/// Numbers hardly compress, so the fastest level does nearly as well as the others.
const ZSTD_LEVEL: i32 = 1;

/// A column of a group with its encoding.
pub(crate) type EncodedAs = (Box<dyn Array>, Encoding);

/// A column with its name.
pub type Named = (String, Box<dyn Array>);

/// The names and types of the columns of a table, and how they are encoded.
pub(crate) struct Schema {
    columns: ArrowSchema,
    types: Vec<ParquetType>,
    options: WriteOptions,
}

/// A group of rows in the form of the file: the pages of every column.
pub(crate) struct Group {
    rows: usize,
    columns: Vec<Vec<CompressedPage>>,
}

/// A file to which groups are appended.
pub(crate) struct TableWriter<W: Write>(FileWriter<W>);

impl Schema {
    /// Returns the schema of columns with these names and types, all of which may have nulls.
    ///
    /// # Errors
    /// If two columns have one name.
    pub(crate) fn new(fields: &[(&str, ArrowDataType)]) -> PolarsResult<Self> {
        let named = fields.iter().map(|(name, dtype)| {
            let name = PlSmallStr::from(*name);
            (name.clone(), Field::new(name, dtype.clone(), true))
        });
        let columns: ArrowSchema = named.collect();
        polars_ensure!(columns.len() == fields.len(), Duplicate: "two columns have one name");
        Ok(Self {
            types: to_parquet_schema(&columns)?.fields().to_vec(),
            columns,
            options: WriteOptions {
                statistics: StatisticsOptions::default(),
                version: Version::V1,
                compression: CompressionOptions::Zstd(Some(ZstdLevel::try_new(ZSTD_LEVEL)?)),
                data_page_size: None,
            },
        })
    }

    /// Returns the schema of these columns.
    ///
    /// # Errors
    /// If two have one name.
    pub(crate) fn of(named: &[Named]) -> PolarsResult<Self> {
        let fields = named.iter().map(|(name, array)| (name.as_str(), array.dtype().clone()));
        Self::new(&fields.collect::<Vec<_>>())
    }

    /// Encodes and compresses a group, whose columns are in the order of the fields.
    ///
    /// # Errors
    /// If columns differ in length.
    pub(crate) fn encode(&self, group: &[EncodedAs]) -> PolarsResult<Group> {
        let rows = group.first().map_or(0, |(array, _)| array.len());
        let alike = group.iter().all(|(array, _)| array.len() == rows);
        polars_ensure!(alike, ShapeMismatch: "columns of different lengths");
        let columns = group.iter().zip(&self.types).map(|((array, encoding), type_)| {
            // Ranges of numbers help no reader, and take time.
            let ranges = !matches!(array.dtype(), ArrowDataType::Float64);
            let mut options = self.options;
            options.statistics.min_value = ranges;
            options.statistics.max_value = ranges;
            let pages = array_to_columns(array, type_.clone(), options, &[*encoding])?;
            let pages = pages
                .into_iter()
                .flatten()
                .map(|page| page.map_err(|error| ParquetError::FeatureNotSupported(error.to_string())));
            let pages = Compressor::new(pages, self.options.compression, Vec::new());
            Ok(pages.collect::<Result<_, _>>()?)
        });
        Ok(Group {
            rows,
            columns: columns.collect::<PolarsResult<_>>()?,
        })
    }

    /// Begins a table.
    pub(crate) fn begin<W: Write>(&self, to: W) -> PolarsResult<TableWriter<W>> {
        FileWriter::try_new(to, self.columns.clone(), self.options).map(TableWriter)
    }

    /// Returns the bytes of a complete file with one group.
    pub(crate) fn file_of(&self, group: &[EncodedAs]) -> PolarsResult<Vec<u8>> {
        let mut writer = self.begin(Vec::new())?;
        writer.append(&self.encode(group)?)?;
        writer.end()
    }
}

impl<W: Write> TableWriter<W> {
    /// Appends a group.
    pub(crate) fn append(&mut self, group: &Group) -> PolarsResult<()> {
        let columns = group.columns.iter().map(|pages| {
            let pages = pages.iter().map(PolarsResult::Ok);
            let pages = fallible_streaming_iterator::convert(pages);
            Ok::<_, PolarsError>(DynStreamingIterator::new(pages))
        });
        self.0.write(group.rows as u64, DynIter::new(columns))
    }

    /// Completes the table.
    pub(crate) fn end(mut self) -> PolarsResult<W> {
        self.0.end(None)?;
        Ok(self.0.into_inner())
    }
}

/// Returns numbers without nulls.
pub(crate) fn numbers<T: NativeType>(values: Vec<T>) -> Box<dyn Array> {
    PrimitiveArray::from_vec(values).boxed()
}

/// Returns numbers with null for NaN.
pub(crate) fn defined_numbers(values: Vec<f64>) -> Box<dyn Array> {
    let defined = |x: &f64| !x.is_nan();
    let validity = (!values.iter().all(defined)).then(|| values.iter().map(defined).collect::<Bitmap>());
    PrimitiveArray::new(ArrowDataType::Float64, values.into(), validity).boxed()
}

/// Returns texts without nulls.
pub(crate) fn texts<T: AsRef<str>>(values: &[T]) -> Box<dyn Array> {
    Utf8ViewArray::from_slice_values(values).boxed()
}

/// Returns a group of columns without encodings of their own.
pub(crate) fn plain(named: Vec<Named>) -> Vec<EncodedAs> {
    let group = named.into_iter().map(|(_, array)| (array, Encoding::Plain));
    group.collect()
}

/// Returns a table of some columns.
///
/// # Errors
/// If two columns have one name, or differ in length.
pub fn parquet_of(named: Vec<Named>) -> PolarsResult<Vec<u8>> {
    Schema::of(&named)?.file_of(&plain(named))
}

/// Returns a table of columns of numbers, with null for NaN.
///
/// # Errors
/// If two columns have one name, or differ in length.
pub fn numbers_as_parquet(columns: Vec<(String, Vec<f64>)>) -> std::io::Result<Vec<u8>> {
    let named = columns
        .into_iter()
        .map(|(name, values)| (name, defined_numbers(values)));
    parquet_of(named.collect()).map_err(std::io::Error::other)
}
