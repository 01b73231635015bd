//! List of the detected and given properties of a file.

use super::formats::ForeignFormat;
use super::options::ImportOptions;
use palpate_sessions::import_origin::ImportReading;

/// Word of the file format for a value that the user gave.
const GIVEN: &str = "told";

#[derive(Clone, Debug, Default)]
pub(super) struct ReadingList(pub Vec<ImportReading>);

impl ReadingList {
    pub fn add_layout(&mut self, format: ForeignFormat, options: &ImportOptions) {
        let option = "--format NAME";
        self.add("layout", format.name(), options.format.is_some(), option);
    }

    pub fn add(&mut self, what: &str, found: impl Into<String>, is_given: bool, option: &str) {
        self.0.push(ImportReading {
            what: what.into(),
            found: found.into(),
            how: if is_given { GIVEN } else { "detected" }.into(),
            option: option.into(),
        });
    }
}
