//! Words of a single field, as typed: `specimen:pig`, `operator:ada`, `tag:pilot`.

use super::condition::ConditionError;
use super::entry::CatalogEntry;
use super::search::words;
use std::fmt;

palpate_model::named! {
    /// A field of a session whose words a query can name. The index has a column of the same name for each.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SearchField {
        Specimen = "specimen",
        Operator = "operator",
        Protocol = "protocol",
        Rig = "rig",
        /// Serial number of the load cell.
        Cell = "cell",
        Tag = "tag",
    }
}

impl SearchField {
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|field| field.name() == name)
    }

    /// Text of the field; several tags are on lines of their own.
    pub fn text_of(self, entry: &CatalogEntry) -> String {
        match self {
            Self::Specimen => entry.specimen.clone(),
            Self::Operator => entry.operator.clone(),
            Self::Protocol => entry.protocol.clone(),
            Self::Rig => entry.rig.clone(),
            Self::Cell => entry.cell.clone(),
            Self::Tag => entry.tags.join("\n"),
        }
    }
}

/// Words of which each must begin a word of one field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldWords {
    pub field: SearchField,
    pub words: String,
}

impl FieldWords {
    /// Parses a piece such as `specimen:pig 7`; `None` if it is words of any field, such as `14:30`.
    pub(super) fn parse(piece: &str) -> Option<Result<Self, ConditionError>> {
        let (name, rest) = piece.split_once(':')?;
        if name.is_empty() || !name.chars().all(char::is_alphabetic) {
            return None;
        }
        let Some(field) = SearchField::of_name(name) else {
            let names: Vec<&str> = SearchField::ALL.into_iter().map(SearchField::name).collect();
            return Some(Err(ConditionError::Field {
                text: piece.to_owned(),
                name: name.to_owned(),
                known: names.join(", "),
            }));
        };
        if words(rest).next().is_none() {
            return Some(Err(ConditionError::NoWords { text: piece.to_owned() }));
        }
        Some(Ok(Self { field, words: rest.to_owned() }))
    }
}

impl fmt::Display for FieldWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.field, self.words)
    }
}
