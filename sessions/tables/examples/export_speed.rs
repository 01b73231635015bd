//! Speed of exporting a session to Parquet, from its log and from memory. `scripts/measure export` compares it with pyarrow.
//!
//! `cargo run --release -p palpate-tables --example export_speed -- SESSION FOLDER`
//! prints one JSON object, times in s; the tables stay in FOLDER.
#![expect(clippy::print_stdout, reason = "a program that prints")]

use palpate_sessions::{SampleBlock, Session};
use palpate_tables::export::{ExtraColumns, RowFeed, SampleSelection, TableExport, TableFormat};
use std::path::Path;
use std::time::Instant;

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn timed(
    table: &TableExport,
    path: &Path,
    feed: RowFeed,
) -> Result<f64, Box<dyn std::error::Error>> {
    let start = Instant::now();
    table.write(TableFormat::Parquet, path, feed)?;
    Ok(start.elapsed().as_secs_f64())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args_os().skip(1);
    let (Some(session), Some(folder)) = (words.next(), words.next()) else {
        return Err("usage: export_speed SESSION FOLDER".into());
    };
    let (session, folder) = (Path::new(&session), Path::new(&folder));
    let whole = Session::open(session)?;
    let table = TableExport {
        manifest: &whole.manifest,
        notes: &whole.notes,
        extra: &ExtraColumns::default(),
        selection: &SampleSelection::default(),
    };
    let from_log = timed(&table, &folder.join("from_log.parquet"), &mut |take| {
        let mut rows = Vec::new();
        let mut each = |block: &SampleBlock| {
            rows.clear();
            rows.extend(block.rows());
            take(&rows);
        };
        Session::scan(session, &mut each).map(|_| ())
    })?;
    let from_memory = timed(&table, &folder.join("from_memory.parquet"), &mut |take| {
        take(&whole.rows);
        Ok(())
    })?;
    let rows = whole.rows.len();
    println!("{{\"rows\":{rows},\"from_log_s\":{from_log},\"from_memory_s\":{from_memory}}}");
    Ok(())
}
