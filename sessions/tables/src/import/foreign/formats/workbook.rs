//! The sheets of a workbook, .xlsx or .xls. Checks before reading keep a small file from taking much memory.

use super::super::rows::Cell;
use super::{Content, Layout, Sheet, legacy, unzipped};
use calamine::{Data, DataRef, Reader, Xls, Xlsx};
use std::io::Cursor;

pub(super) const LAYOUT: Layout = Layout {
    name: "workbook",
    source: "a workbook (.xlsx, .xls)",
    content: Content::Sheets {
        is_it: |bytes| bytes.starts_with(ZIP) || bytes.starts_with(COMPOUND),
        read: sheets,
    },
    words: &[],
};

/// Largest size in bytes: about twice what the allowed number of cells takes when packed.
const BYTES_MAX: usize = 8 << 20;

/// Largest number of cells over all sheets, so that an import takes less than 64 MiB: 17 MB here, and as much again for the
/// samples.
const CELLS_MAX: usize = 1 << 19;
/// Largest number of columns of a sheet of measurements.
const COLUMNS_MAX: u32 = 256;

/// First bytes of a zip archive, which an .xlsx is.
const ZIP: &[u8] = b"PK\x03\x04";
/// First bytes of a compound file, which an .xls is ([MS-CFB], section 2.2).
const COMPOUND: &[u8] = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1";

/// Every sheet in order; the error is one sentence.
fn sheets(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    if bytes.len() > BYTES_MAX {
        return Err(format!(
            "the workbook has {} bytes, more than {BYTES_MAX}; export the measurement as text",
            bytes.len()
        ));
    }
    if bytes.starts_with(ZIP) {
        unzipped::check(bytes)?;
        read_xlsx(bytes)
    } else if bytes.starts_with(COMPOUND) {
        legacy::check(bytes)?;
        // `calamine` trusts lengths in an .xls, and panics if damage has changed them.
        palpate_model::panics::catch_panic(|| read_xls(bytes))
            .unwrap_or_else(|_| Err(damaged("the records of the workbook contradict each other")))
    } else {
        Err("the file is not a workbook: it begins neither like an .xlsx nor like an .xls".into())
    }
}

fn damaged(err: impl std::fmt::Display) -> String {
    format!("the workbook cannot be read ({err}); save it again from the program that made it")
}

/// Rows being filled, cell by cell.
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
                return Err(damaged(format!(
                    "its rows are not in order: row {number} follows row {last}"
                )));
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

fn read_xlsx(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    let mut book = Xlsx::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut total = 0;
    let names = book.sheet_names();
    let mut sheets = Vec::with_capacity(names.len());
    for name in names {
        let mut grid = Grid { cells: total, ..Grid::default() };
        // A sheet without cells, such as a chart, has no reader.
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
        sheets.push(Sheet { name, facts: Vec::new(), rows: grid.rows });
    }
    Ok(sheets)
}

fn read_xls(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
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
        sheets.push(Sheet { name, facts: Vec::new(), rows: grid.rows });
    }
    Ok(sheets)
}

fn text_cell(text: &str) -> Cell {
    match text.trim() {
        "" => Cell::Empty,
        text => Cell::Text(text.to_owned()),
    }
}
