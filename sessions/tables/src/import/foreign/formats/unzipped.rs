//! Check of an .xlsx archive before it is read into memory.

use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Largest unpacked size of all files: XML of twice the allowed number of cells. It is not held in memory.
const UNPACKED_MAX: u64 = 64 << 20;
/// Largest unpacked size of a list, such as the table of texts, which takes three times as much in memory.
const LIST_MAX: u64 = 4 << 20;
/// Path of the sheets, which are read cell by cell (ECMA-376, part 1, 12.3.24).
const SHEETS: &str = "xl/worksheets/sheet";
/// Bytes per read.
const BLOCK_BYTES: u64 = 1 << 16;
/// Largest number of files in the archive; a workbook has a dozen and one for each sheet.
const FILES_MAX: usize = 4096;
/// Attribute with the number of texts, for which `calamine` allocates memory.
const COUNT: &[u8] = b"uniqueCount";

/// Refuses an archive that unpacks to too many bytes, or claims more texts than it has bytes.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let damaged = |err: &dyn std::fmt::Display| {
        format!(
            "the workbook cannot be unpacked ({err}); save it again from the program that made it"
        )
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|err| damaged(&err))?;
    if archive.len() > FILES_MAX {
        return Err(format!(
            "the workbook contains {} files, more than {FILES_MAX}; export the measurement as text",
            archive.len()
        ));
    }
    let mut remaining = UNPACKED_MAX;
    for index in 0..archive.len() {
        let file = archive.by_index(index).map_err(|err| damaged(&err))?;
        let name = file.name().map_err(|err| damaged(&err))?.into_owned();
        let is_xml = name.ends_with(".xml") || name.ends_with(".rels");
        let is_list = is_xml && !name.starts_with(SHEETS);
        let mut most = if is_list { remaining.min(LIST_MAX) } else { remaining };
        let mut file = file.take(most + 1);
        let mut content = Vec::new();
        loop {
            let room = if is_list { most + 1 } else { BLOCK_BYTES };
            let read = (&mut file).take(room).read_to_end(&mut content);
            let read = read.map_err(|err| damaged(&err))? as u64;
            if read > most {
                let (what, max) = match remaining > most {
                    true => ("a list in the workbook", LIST_MAX),
                    false => ("the workbook", UNPACKED_MAX),
                };
                return Err(format!(
                    "{what} unpacks to more than {max} bytes; export the measurement as text"
                ));
            }
            (most, remaining) = (most - read, remaining - read);
            if is_list && claims_too_many(&content) {
                return Err(damaged(&"the file declares more text entries than it has bytes"));
            }
            content.clear();
            if read == 0 || is_list {
                break;
            }
        }
    }
    Ok(())
}

fn claims_too_many(content: &[u8]) -> bool {
    let mut rest = content;
    while let Some(place) = rest.windows(COUNT.len()).position(|window| window == COUNT) {
        rest = &rest[place + COUNT.len()..];
        let after = rest.iter().skip_while(|byte| !byte.is_ascii_digit()).take(20);
        let claimed = after
            .take_while(|byte| byte.is_ascii_digit())
            .fold(0u64, |sum, byte| sum.saturating_mul(10).saturating_add(u64::from(byte - b'0')));
        if claimed > content.len() as u64 {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claimed_number_of_texts_is_compared_with_the_size() {
        assert!(!claims_too_many(b"<sst count=\"2\" uniqueCount=\"2\"><si/><si/></sst>"));
        assert!(claims_too_many(b"<sst uniqueCount = '99999999999999999999'></sst>"));
    }
}
