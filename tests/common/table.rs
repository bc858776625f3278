//! Tables in Parquet, read by polars' crate of the format, not by the program's own reader of its footer.

use asobench::files::parquet_of;
use polars_arrow::array::{Array, PrimitiveArray, Utf8ViewArray};
use polars_arrow::compute::concatenate::concatenate;
use polars_arrow::datatypes::ArrowDataType;
use polars_arrow::types::NativeType;
use polars_parquet::read::{BasicDecompressor, PageReader, column_iter_to_arrays, infer_schema, read_metadata};
use std::io::Cursor;
use std::path::Path;

/// Columns with their names.
#[derive(Clone)]
pub struct Table(pub Vec<(String, Box<dyn Array>)>);

impl Table {
    /// Reads every row group of a file.
    pub fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the file");
        let metadata = read_metadata(&mut Cursor::new(&bytes)).expect("a footer");
        let schema = infer_schema(&metadata).expect("types");
        let columns = schema.iter_values().map(|field| {
            let groups = metadata.row_groups.iter().flat_map(|group| {
                let chunk = group
                    .columns_under_root_iter(&field.name)
                    .and_then(|mut found| found.next());
                let chunk = chunk.expect("a chunk of the column");
                let range = chunk.byte_range();
                let pages = bytes[range.start as usize..range.end as usize].to_vec();
                let longest = pages.len();
                let pages = PageReader::new(Cursor::new(pages.into()), chunk, Vec::new(), longest);
                let pages = vec![BasicDecompressor::new(pages, Vec::new())];
                let primitive = &chunk.descriptor().descriptor.primitive_type;
                column_iter_to_arrays(pages, vec![primitive], field.clone(), None)
                    .expect("values")
                    .0
            });
            let groups: Vec<Box<dyn Array>> = groups.collect();
            let groups: Vec<&dyn Array> = groups.iter().map(|group| &**group).collect();
            (field.name.to_string(), concatenate(&groups).expect("one type"))
        });
        Self(columns.collect())
    }

    /// Writes it in place of a file.
    pub fn write(self, path: &Path) {
        std::fs::write(path, parquet_of(self.0).expect("a table")).expect("a file");
    }

    pub fn height(&self) -> usize {
        self.0[0].1.len()
    }

    pub fn column(&self, name: &str) -> &dyn Array {
        let found = self.0.iter().find(|(other, _)| other == name);
        &*found.unwrap_or_else(|| panic!("no column {name}")).1
    }

    pub fn set(&mut self, name: &str, values: Vec<Option<f64>>) {
        let found = self.0.iter_mut().find(|(other, _)| other == name).expect("a column");
        assert_eq!(found.1.len(), values.len());
        found.1 = PrimitiveArray::from(values).boxed();
    }

    /// Returns the names and types of the columns.
    pub fn types(&self) -> Vec<(&str, ArrowDataType)> {
        let columns = self.0.iter();
        columns
            .map(|(name, column)| (name.as_str(), column.dtype().clone()))
            .collect()
    }

    /// Returns a column of numbers of one type.
    pub fn numbers<T: NativeType>(&self, name: &str) -> Vec<Option<T>> {
        let column = self.column(name).as_any().downcast_ref::<PrimitiveArray<T>>();
        column
            .expect("numbers of this type")
            .iter()
            .map(Option::<&T>::copied)
            .collect()
    }

    /// Returns a column of texts.
    pub fn texts(&self, name: &str) -> Vec<Option<&str>> {
        let column = self.column(name).as_any().downcast_ref::<Utf8ViewArray>();
        column.expect("texts").iter().collect()
    }
}
