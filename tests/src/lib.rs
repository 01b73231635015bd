//! Fixtures shared by the tests that cross crates.

pub mod contact_search;
pub mod flow;
pub mod interval_coverage;
pub mod lab;
pub mod planned_runs;
pub mod recorded_runs;
pub mod recorded_study;
pub mod sample_library;
pub mod simulated;

use palpate_protocols::file::built_in;
use palpate_protocols::plans::Plan;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The plan of a built-in protocol with some of its parameters set.
///
/// # Panics
/// If there is no such protocol, or it does not take these values.
#[must_use]
pub fn built_in_plan(name: &str, values: &[(&str, &str)]) -> Plan {
    let values = values.iter().map(|(key, value)| ((*key).into(), (*value).into()));
    let protocol = built_in(name).expect("a sound protocol").expect("a built-in protocol");
    protocol.plan(&values.collect::<BTreeMap<String, String>>()).expect("values that it takes")
}

/// The root of the source tree.
#[must_use]
pub fn workspace() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    root.map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// Every file below a folder with an extension, in order; `target` and hidden folders are left out.
///
/// # Panics
/// If there is none: a rule that is checked on no file would hold whatever is written.
#[must_use]
pub fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    gather(folder, extension, &mut files);
    assert!(!files.is_empty(), "no .{extension} below {}", folder.display());
    files.sort();
    files
}

fn gather(folder: &Path, extension: &str, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder that can be read");
    for entry in entries.flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            gather(&path, extension, files);
        } else if path.extension().is_some_and(|found| found == extension) {
            files.push(path);
        }
    }
}
