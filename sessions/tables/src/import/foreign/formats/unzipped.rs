//! What an .xlsx would unpack to: looked at before anything of it is kept in memory.

use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Most bytes that all files of the archive may unpack to: XML of twice as many cells as are kept. They pass by.
const UNPACKED_MAX: u64 = 64 << 20;
/// Most bytes of a list, such as that of texts: it is kept whole, and takes three times as much in memory.
const KEPT_MAX: u64 = 4 << 20;
/// Where the sheets are, which are read cell by cell (ECMA-376, part 1, 12.3.24, as every program names them).
const SHEETS: &str = "xl/worksheets/sheet";
/// So much is looked at together.
const BLOCK_BYTES: u64 = 1 << 16;
/// Most files in the archive; a workbook has a dozen and one for each sheet.
const FILES_MAX: usize = 4096;
/// The attribute by which a table of texts tells how many there are: room is made for as many.
const COUNT: &[u8] = b"uniqueCount";

/// Refuses an archive that unpacks to too much or claims more texts than it has bytes.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let damaged = |err: &dyn std::fmt::Display| {
        format!(
            "the workbook cannot be unpacked ({err}); save it again from the program that made it"
        )
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|err| damaged(&err))?;
    if archive.len() > FILES_MAX {
        return Err(format!(
            "the workbook has {} files inside, and {FILES_MAX} are the most; it is none of a tester",
            archive.len()
        ));
    }
    let mut left = UNPACKED_MAX;
    for index in 0..archive.len() {
        let file = archive.by_index(index).map_err(|err| damaged(&err))?;
        let name = file.name().map_err(|err| damaged(&err))?.into_owned();
        let is_xml = name.ends_with(".xml") || name.ends_with(".rels");
        let is_kept = is_xml && !name.starts_with(SHEETS);
        let mut most = if is_kept { left.min(KEPT_MAX) } else { left };
        let mut file = file.take(most + 1);
        let mut content = Vec::new();
        loop {
            let room = if is_kept { most + 1 } else { BLOCK_BYTES };
            let read = (&mut file).take(room).read_to_end(&mut content);
            let read = read.map_err(|err| damaged(&err))? as u64;
            if read > most {
                let (what, max) = match left > most {
                    true => ("a list in the workbook", KEPT_MAX),
                    false => ("the workbook", UNPACKED_MAX),
                };
                return Err(format!(
                    "{what} unpacks to more than {max} bytes; export the measurement as text"
                ));
            }
            (most, left) = (most - read, left - read);
            if is_kept && claims_too_many(&content) {
                return Err(damaged(&"it claims more texts than it has bytes"));
            }
            content.clear();
            if read == 0 || is_kept {
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
    fn claims_are_compared_with_what_is_there() {
        assert!(!claims_too_many(b"<sst count=\"2\" uniqueCount=\"2\"><si/><si/></sst>"));
        assert!(claims_too_many(b"<sst uniqueCount = '99999999999999999999'></sst>"));
    }
}
