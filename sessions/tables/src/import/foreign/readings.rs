//! List of the detected and given properties of a file.

use super::formats::Format;
use super::options::Told;
use palpate_sessions::import_origin::Reading;

/// Word of the file format for a value that the user gave.
const GIVEN: &str = "told";

#[derive(Clone, Debug, Default)]
pub(super) struct ReadingList(pub Vec<Reading>);

impl ReadingList {
    pub fn add_layout(&mut self, format: Format, options: &Told) {
        let option = "--format NAME";
        self.add("layout", format.name(), options.format.is_some(), option);
    }

    pub fn add(&mut self, what: &str, found: impl Into<String>, is_given: bool, option: &str) {
        self.0.push(Reading {
            what: what.into(),
            found: found.into(),
            how: if is_given { GIVEN } else { "detected" }.into(),
            option: option.into(),
        });
    }
}
