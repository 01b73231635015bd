//! Protection against text that a spreadsheet would run as a formula.

use polars_core::prelude::{ChunkApply, Column, DataFrame, DataType, IntoColumn, PolarsResult};
use std::borrow::Cow;

/// Puts `'` before a text that begins with `=`, `+`, `-`, `@`, a tab or a carriage return, which spreadsheets run as a
/// formula (OWASP, "CSV injection").
#[must_use]
pub fn escape_formula(text: &str) -> Cow<'_, str> {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// Escapes the names and texts of a frame; numbers stay numbers.
pub(super) fn escape_frame(frame: DataFrame) -> PolarsResult<DataFrame> {
    let height = frame.height();
    let columns = frame.columns().iter().map(|column| {
        let mut column = match column.dtype() {
            DataType::String => column.str()?.apply_values(escape_formula).into_column(),
            _ => column.clone(),
        };
        let name = escape_formula(column.name()).into_owned();
        column.rename(name.into());
        Ok(column)
    });
    let columns = columns.collect::<PolarsResult<Vec<Column>>>()?;
    DataFrame::new(height, columns)
}
