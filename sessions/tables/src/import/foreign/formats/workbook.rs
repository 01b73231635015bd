//! The sheets of a workbook, .xlsx or .xls. What could make the reader of cells take more memory than the
//! file deserves is looked for before it is called.

use super::super::rows::Cell;
use super::{Content, Layout, Sheet, legacy, unzipped};
use calamine::{Data, DataRef, Reader, Xls, Xlsx};
use std::io::Cursor;

pub(super) const LAYOUT: Layout = Layout {
    name: "workbook",
    of: "a workbook (.xlsx, .xls)",
    content: Content::Sheets {
        is_it: |bytes| bytes.starts_with(ZIP) || bytes.starts_with(COMPOUND),
        read: sheets,
    },
    words: &[],
};

/// Largest one read, in bytes: packed, as many cells as are read take about half of it. It is kept in memory.
const BYTES_MAX: usize = 8 << 20;

/// Most cells kept of all sheets, so that the whole import takes less than 64 MiB: 17 MB here, and as much again
/// for the samples made of them.
const CELLS_MAX: usize = 1 << 19;
/// Columns of a sheet of measurements; more is not one.
const COLUMNS_MAX: u32 = 256;

/// First bytes of a zip archive, which an .xlsx is.
const ZIP: &[u8] = b"PK\x03\x04";
/// First bytes of a compound file, which an .xls is ([MS-CFB], section 2.2).
const COMPOUND: &[u8] = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1";

/// Every sheet in order; the error is one sentence.
fn sheets(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    if bytes.len() > BYTES_MAX {
        return Err(format!(
            "the workbook has {} bytes, and {BYTES_MAX} are the most; export the measurement as text",
            bytes.len()
        ));
    }
    if bytes.starts_with(ZIP) {
        unzipped::check(bytes)?;
        modern(bytes)
    } else if bytes.starts_with(COMPOUND) {
        legacy::check(bytes)?;
        // The reader of old cells trusts lengths that damage can change, and stops with a panic.
        palpate_model::contained::contained(|| old(bytes))
            .unwrap_or_else(|_| Err(damaged("its records contradict each other")))
    } else {
        Err("it is no workbook: it begins neither like an .xlsx nor like an .xls".into())
    }
}

fn damaged(err: impl std::fmt::Display) -> String {
    format!("the workbook cannot be read ({err}); save it again from the program that made it")
}

/// Rows in the making, one cell after the other.
#[derive(Default)]
struct Grid {
    rows: Vec<(usize, Vec<Cell>)>,
    cells: usize,
}

impl Grid {
    fn put(&mut self, row: u32, column: u32, cell: Cell) -> Result<(), String> {
        if cell.is_empty() {
            return Ok(());
        }
        if column >= COLUMNS_MAX {
            return Err(format!(
                "row {} has a cell beyond column {COLUMNS_MAX}; keep only the columns of the measurement",
                u64::from(row) + 1
            ));
        }
        let number = row as usize + 1;
        match self.rows.last() {
            Some((last, _)) if *last == number => {}
            Some((last, _)) if *last > number => {
                return Err(damaged(format!("row {number} comes after row {last}")));
            }
            _ => self.rows.push((number, Vec::new())),
        }
        let Some((_, cells)) = self.rows.last_mut() else {
            return Ok(());
        };
        let width = column as usize + 1;
        if cells.len() < width {
            self.cells += width - cells.len();
            cells.resize(width, Cell::Empty);
        }
        if self.cells > CELLS_MAX {
            return Err(format!(
                "it has more than {CELLS_MAX} cells; export the measurement as text"
            ));
        }
        cells[column as usize] = cell;
        Ok(())
    }
}

fn modern(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    let mut book = Xlsx::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut total = 0;
    let names = book.sheet_names();
    let mut sheets = Vec::with_capacity(names.len());
    for name in names {
        let mut grid = Grid { cells: total, ..Grid::default() };
        // A sheet that holds no cells, such as a chart, has no reader.
        if let Ok(mut cells) = book.worksheet_cells_reader(&name) {
            while let Some(cell) = cells.next_cell().map_err(damaged)? {
                let (row, column) = cell.get_position();
                let value = match cell.get_value() {
                    DataRef::Int(number) => Cell::Number(*number as f64),
                    DataRef::Float(number) => Cell::Number(*number),
                    DataRef::String(text) => text_cell(text),
                    DataRef::SharedString(text) => text_cell(text),
                    DataRef::Empty => Cell::Empty,
                    other => text_cell(&Data::from(other.clone()).to_string()),
                };
                grid.put(row, column, value)?;
            }
        }
        total = grid.cells;
        sheets.push((name, grid.rows));
    }
    Ok(sheets)
}

fn old(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    let mut book = Xls::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut total = 0;
    let mut sheets = Vec::new();
    for name in book.sheet_names() {
        let mut grid = Grid { cells: total, ..Grid::default() };
        if let Ok(range) = book.worksheet_range(&name) {
            let (first_row, first_column) = range.start().unwrap_or_default();
            for (row, column, value) in range.used_cells() {
                let cell = match value {
                    Data::Int(number) => Cell::Number(*number as f64),
                    Data::Float(number) => Cell::Number(*number),
                    Data::Empty => Cell::Empty,
                    other => text_cell(&other.to_string()),
                };
                let (row, column) = (row as u32 + first_row, column as u32 + first_column);
                grid.put(row, column, cell)?;
            }
        }
        total = grid.cells;
        sheets.push((name, grid.rows));
    }
    Ok(sheets)
}

fn text_cell(text: &str) -> Cell {
    match text.trim() {
        "" => Cell::Empty,
        text => Cell::Text(text.to_owned()),
    }
}
