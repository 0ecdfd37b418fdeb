//! A table of columns, written as CSV or Parquet.

use std::fs::File as Output;
use std::io;
use std::path::Path as File;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

use super::super::numbers::integer;

/// Values of a column, all of one kind.
pub enum Column {
    Number(Vec<i64>),
    MaybeNumber(Vec<Option<i64>>),
    /// ms since 1970.
    Time(Vec<u64>),
    /// Of metres, degrees and the like, to a thousandth.
    Real(Vec<f64>),
    MaybeReal(Vec<Option<f64>>),
    YesNo(Vec<bool>),
    Text(Vec<String>),
}

/// A table: a file's worth.
pub struct Table {
    pub name: &'static str,
    pub columns: Vec<(&'static str, Column)>,
}

impl Table {
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }

    /// How many texts there are of which `is_it`, by the name of their column, is true.
    pub fn count(&self, is_it: impl Fn(&str, &str) -> bool) -> usize {
        let texts = self.columns.iter().filter_map(|(name, column)| match column {
            Column::Text(texts) => Some(texts.iter().filter(|text| is_it(name, text)).count()),
            _ => None,
        });
        texts.sum()
    }

    pub fn csv(&self, file: &File) -> io::Result<()> {
        let mut out = csv::Writer::from_path(file)?;
        out.write_record(self.columns.iter().map(|(name, _)| *name))?;
        for row in 0..self.rows() {
            out.write_record(self.columns.iter().map(|(_, column)| column.text(row)))?;
        }
        out.flush()
    }

    pub fn parquet(&self, file: &File) -> io::Result<()> {
        let fields: String =
            self.columns.iter().map(|(name, column)| format!("{};", column.field(name))).collect();
        let write = || -> Result<(), ParquetError> {
            let schema = Arc::new(parse_message_type(&format!("message {} {{{fields}}}", self.name))?);
            let settings = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
            let mut out = SerializedFileWriter::new(Output::create(file)?, schema, Arc::new(settings))?;
            let mut group = out.next_row_group()?;
            for (_, column) in &self.columns {
                if let Some(mut to) = group.next_column()? {
                    column.write(&mut to)?;
                    to.close()?;
                }
            }
            group.close()?;
            out.close()?;
            Ok(())
        };
        write().map_err(io::Error::other)
    }
}

impl Column {
    const fn len(&self) -> usize {
        match self {
            Self::Number(values) => values.len(),
            Self::MaybeNumber(values) => values.len(),
            Self::Time(values) => values.len(),
            Self::Real(values) => values.len(),
            Self::MaybeReal(values) => values.len(),
            Self::YesNo(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// A value for people, and for programs that read text; empty if there is none.
    fn text(&self, row: usize) -> String {
        let text = match self {
            Self::Number(values) => values.get(row).map(ToString::to_string),
            Self::MaybeNumber(values) => values.get(row).copied().flatten().map(|value| value.to_string()),
            Self::Time(values) => values.get(row).map(|at_ms| format!("{:.3}", *at_ms as f64 * 1e-3)),
            Self::Real(values) => values.get(row).map(|value| format!("{value:.3}")),
            Self::MaybeReal(values) => values.get(row).copied().flatten().map(|value| format!("{value:.3}")),
            Self::YesNo(values) => values.get(row).map(|value| u8::from(*value).to_string()),
            Self::Text(values) => values.get(row).cloned(),
        };
        text.unwrap_or_default()
    }

    /// As a Parquet schema declares it.
    fn field(&self, name: &str) -> String {
        match self {
            Self::Number(_) => format!("required int64 {name}"),
            Self::MaybeNumber(_) => format!("optional int64 {name}"),
            Self::Time(_) => format!("required int64 {name} (TIMESTAMP(MILLIS,true))"),
            Self::Real(_) => format!("required double {name}"),
            Self::MaybeReal(_) => format!("optional double {name}"),
            Self::YesNo(_) => format!("required boolean {name}"),
            Self::Text(_) => format!("required binary {name} (STRING)"),
        }
    }

    fn write(&self, to: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        match self {
            Self::Number(values) => to.typed::<Int64Type>().write_batch(values, None, None)?,
            Self::MaybeNumber(values) => {
                let (there, values) = there(values);
                to.typed::<Int64Type>().write_batch(&values, Some(&there), None)?
            }
            Self::MaybeReal(values) => {
                let (there, values) = there(values);
                to.typed::<DoubleType>().write_batch(&values, Some(&there), None)?
            }
            Self::Time(values) => {
                let values: Vec<i64> = values.iter().map(|&at_ms| integer(at_ms)).collect();
                to.typed::<Int64Type>().write_batch(&values, None, None)?
            }
            Self::Real(values) => to.typed::<DoubleType>().write_batch(values, None, None)?,
            Self::YesNo(values) => to.typed::<BoolType>().write_batch(values, None, None)?,
            Self::Text(values) => {
                let values: Vec<ByteArray> = values.iter().map(|text| text.as_str().into()).collect();
                to.typed::<ByteArrayType>().write_batch(&values, None, None)?
            }
        };
        Ok(())
    }
}

/// Which there are, as Parquet's definition levels, and those.
fn there<T: Copy>(values: &[Option<T>]) -> (Vec<i16>, Vec<T>) {
    let levels = values.iter().map(|value| i16::from(value.is_some())).collect();
    (levels, values.iter().copied().flatten().collect())
}
