//! Check of an .xls before `calamine` reads it, which allocates every cell between the first and the last of a sheet, and a
//! few bytes can place the last one anywhere.
//!
//! Compound files are described in \[MS-CFB\], records in \[MS-XLS\] section 2.4.

/// Largest number of cells between first and last, over all sheets: 48 MiB in `calamine`, a sheet with all rows and 32
/// columns.
const AREA_MAX: u64 = 2 << 20;
/// Empty cells that a small file may have. More are allowed in proportion to the file's bytes, of which a cell takes at least
/// six.
const EMPTY_MAX: u64 = 1 << 16;
/// Columns and rows of a sheet in this format ([MS-XLS], 2.5.53 and 2.5.226).
const COLUMNS: u32 = 256;
const ROWS: u32 = 65_536;
/// Sector numbers from here on are special values ([MS-CFB], 2.1).
const NO_SECTOR: u32 = 0xffff_fffa;
/// Streams below this size are in small sectors ([MS-CFB], 2.2).
const SMALL_STREAM: usize = 4096;
const SMALL_SECTOR: usize = 64;

fn damaged() -> String {
    "the workbook's structure is broken; save it again from the program that made it".into()
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u32> {
    let pair = bytes.get(at..at.checked_add(2)?)?;
    Some(u32::from(u16::from_le_bytes(pair.try_into().ok()?)))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

/// Refuses a workbook whose sheets span too many cells.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let stream = workbook_stream(bytes).ok_or_else(damaged)?;
    check_stream(&stream)
}

/// Joins a chain of sectors.
fn chain(sectors: &[u8], size: usize, table: &[u32], start: u32) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    let mut at = start;
    // A circular chain would exceed the number of sectors.
    for _ in 0..=sectors.len() / size {
        if at >= NO_SECTOR {
            return Some(content);
        }
        let from = (at as usize).checked_mul(size)?;
        let sector = sectors.get(from..)?;
        content.extend_from_slice(&sector[..sector.len().min(size)]);
        at = *table.get(at as usize)?;
    }
    None
}

fn numbers(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).filter_map(|four| u32_at(four, 0)).collect()
}

/// The stream named `Workbook`, or `Book` in files before 1997.
fn workbook_stream(bytes: &[u8]) -> Option<Vec<u8>> {
    let size = match u16_at(bytes, 30)? {
        9 => 512,
        12 => 4096,
        _ => return None,
    };
    let sectors = bytes.get(size..)?;
    let mut places = numbers(bytes.get(76..512)?);
    let mut next = u32_at(bytes, 68)?;
    for _ in 0..=sectors.len() / size {
        if next >= NO_SECTOR {
            break;
        }
        let from = (next as usize).checked_mul(size)?;
        let mut more = numbers(sectors.get(from..from.checked_add(size)?)?);
        next = more.pop()?;
        places.extend(more);
    }
    let mut table = Vec::new();
    places.retain(|place| *place < NO_SECTOR);
    // More entries than sectors means that sectors repeat.
    if places.len() > sectors.len() / size {
        return None;
    }
    for place in places {
        let from = (place as usize).checked_mul(size)?;
        table.extend(numbers(sectors.get(from..from.checked_add(size)?)?));
    }
    let folder = chain(sectors, size, &table, u32_at(bytes, 48)?)?;
    let entries: Vec<&[u8]> = folder.chunks_exact(128).collect();
    let is_called = |entry: &&&[u8], name: &str| {
        let length = u16_at(entry, 64).unwrap_or(0).clamp(2, 64) as usize - 2;
        let units = entry[..length].chunks_exact(2).filter_map(|pair| u16_at(pair, 0));
        let units: Vec<u16> = units.map(|unit| unit as u16).collect();
        String::from_utf16_lossy(&units).eq_ignore_ascii_case(name)
    };
    let entry = ["Workbook", "Book"]
        .into_iter()
        .find_map(|name| entries.iter().find(|entry| is_called(entry, name)))?;
    let (start, length) = (u32_at(entry, 116)?, u32_at(entry, 120)? as usize);
    // `calamine` follows these chains if there are small sectors, needed or not.
    let has_small = u32_at(bytes, 64)? > 0;
    let small = match has_small || length < SMALL_STREAM {
        true => Some((
            chain(sectors, size, &table, u32_at(entries.first()?, 116)?)?,
            numbers(&chain(sectors, size, &table, u32_at(bytes, 60)?)?),
        )),
        false => None,
    };
    let mut stream = if length < SMALL_STREAM {
        let (small, table) = small?;
        chain(&small, SMALL_SECTOR, &table, start)?
    } else {
        chain(sectors, size, &table, start)?
    };
    stream.truncate(length);
    Some(stream)
}

/// Kind and content of the records from offset `from`.
fn records(stream: &[u8], from: usize) -> impl Iterator<Item = (u32, &[u8])> {
    let mut at = from;
    std::iter::from_fn(move || {
        let (kind, length) = (u16_at(stream, at)?, u16_at(stream, at + 2)? as usize);
        let content = stream.get(at + 4..at + 4 + length)?;
        at += 4 + length;
        Some((kind, content))
    })
}

const BEGIN: u32 = 0x0809;
const END: u32 = 0x000a;
const SHEET: u32 = 0x0085;
const DIMENSIONS: u32 = 0x0200;
const MANY_NUMBERS: u32 = 0x00bd;
/// Number, label, boolean, short number, shared label, rich label and formula.
const CELLS: [u32; 7] = [0x0203, 0x0204, 0x0205, 0x027e, 0x00fd, 0x00d6, 0x0006];

fn check_stream(stream: &[u8]) -> Result<(), String> {
    let sheets = records(stream, 0)
        .take_while(|(kind, _)| *kind != END)
        .filter(|(kind, _)| *kind == SHEET)
        .filter_map(|(_, content)| u32_at(content, 0));
    let most = AREA_MAX.min(EMPTY_MAX + stream.len() as u64);
    let mut area = 0u64;
    for start in sheets {
        area = area.saturating_add(area_of(stream, start as usize)?);
        if area > most {
            return Err(format!(
                "its sheets span more than {most} cells; export the measurement as text"
            ));
        }
    }
    Ok(())
}

/// Cells between the first and the last of a sheet.
fn area_of(stream: &[u8], start: usize) -> Result<u64, String> {
    let (mut depth, mut is_begun) = (0u32, false);
    let (mut rows, mut columns) = ([u32::MAX, 0], [u32::MAX, 0]);
    for (kind, content) in records(stream, start) {
        match kind {
            BEGIN if is_begun => depth += 1,
            BEGIN => is_begun = true,
            END if depth > 0 => depth -= 1,
            END => break,
            _ if depth > 0 => {}
            DIMENSIONS => check_dimensions(content)?,
            kind if kind == MANY_NUMBERS || CELLS.contains(&kind) => {
                let row = u16_at(content, 0).ok_or_else(damaged)?;
                let first = u16_at(content, 2).ok_or_else(damaged)?;
                let last = match kind {
                    MANY_NUMBERS => u16_at(content, content.len() - 2).ok_or_else(damaged)?,
                    _ => first,
                };
                if first > last || last >= COLUMNS {
                    return Err(damaged());
                }
                rows = [rows[0].min(row), rows[1].max(row)];
                columns = [columns[0].min(first), columns[1].max(last)];
            }
            _ => {}
        }
    }
    let span = |[first, last]: [u32; 2]| u64::from((last + 1).saturating_sub(first));
    Ok(span(rows) * span(columns))
}

fn check_dimensions(content: &[u8]) -> Result<(), String> {
    let is_old = content.len() == 10;
    let read = |at: usize, is_wide: bool| match is_wide {
        true => u32_at(content, at),
        false => u16_at(content, at),
    };
    let ends = if is_old {
        [read(0, false), read(2, false), read(4, false), read(6, false)]
    } else {
        [read(0, true), read(4, true), read(8, false), read(10, false)]
    };
    let [Some(row), Some(rows), Some(column), Some(columns)] = ends else {
        return Err(damaged());
    };
    if row > rows || rows > ROWS || column > columns || columns > COLUMNS {
        return Err(damaged());
    }
    Ok(())
}
