//! How a foreign file was read, for people.

use palpate_sessions::Imported;

/// One line for each thing that was taken for something, with the option that says it otherwise.
pub fn lines(imported: &Imported, rows: &str) -> Vec<String> {
    let line = |what: &str, text: &str| format!("  {what:<13} {text}");
    let mut lines =
        vec![line("file", &format!("{} bytes, CRC-32 {}", imported.bytes, imported.checksum))];
    if !imported.part.is_empty() {
        lines.push(line("part", &format!("{} (--part NAME)", imported.part)));
    }
    let readings = imported.readings.iter();
    lines.extend(readings.map(|one| {
        let told = if one.how == "told" { ", as told" } else { "" };
        line(&one.what, &format!("{}{told} ({})", one.found, one.option))
    }));
    lines.push(line("rows", rows));
    let remarks = imported.remarks.iter();
    lines.extend(remarks.map(|remark| line("remark", remark)));
    lines
}
