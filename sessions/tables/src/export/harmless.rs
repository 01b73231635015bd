//! Text that no spreadsheet takes for a formula.

use polars_core::prelude::{ChunkApply, Column, DataFrame, DataType, IntoColumn, PolarsResult};
use std::borrow::Cow;

/// A text as it may stand in a cell of a CSV file. Spreadsheets run what begins with `=`, `+`, `-`, `@`, a
/// tab or a carriage return as a formula (OWASP, "CSV injection"); `'` before it says that it is text.
#[must_use]
pub fn harmless(text: &str) -> Cow<'_, str> {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// A frame whose names and texts are harmless; numbers stay numbers.
pub(super) fn harmless_frame(frame: DataFrame) -> PolarsResult<DataFrame> {
    let height = frame.height();
    let columns = frame.columns().iter().map(|column| {
        let mut column = match column.dtype() {
            DataType::String => column.str()?.apply_values(harmless).into_column(),
            _ => column.clone(),
        };
        let name = harmless(column.name()).into_owned();
        column.rename(name.into());
        Ok(column)
    });
    let columns = columns.collect::<PolarsResult<Vec<Column>>>()?;
    DataFrame::new(height, columns)
}
