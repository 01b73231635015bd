//! What was taken for what, to be shown and kept.

use super::formats::Format;
use super::told::Told;
use palpate_sessions::imported::Reading;

/// How a part was read, in the order it was found out.
#[derive(Clone, Debug, Default)]
pub(super) struct Said(pub Vec<Reading>);

impl Said {
    pub fn layout(&mut self, format: Format, told: &Told) {
        let option = "--format NAME";
        self.say("layout", format.name(), told.format.is_some(), option);
    }

    pub fn say(&mut self, what: &str, found: impl Into<String>, is_told: bool, option: &str) {
        self.0.push(Reading {
            what: what.into(),
            found: found.into(),
            how: if is_told { "told" } else { "detected" }.into(),
            option: option.into(),
        });
    }
}
