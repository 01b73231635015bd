//! The text of a protocol as a tree of nodes with line numbers.

use super::problem::ProtocolProblem;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

#[derive(Clone, Debug, PartialEq)]
pub struct DocumentNode {
    pub line: u32,
    pub value: DocumentValue,
}

#[derive(Clone, Debug, PartialEq)]
pub enum DocumentValue {
    Text(String),
    /// A number without a unit, as it was written.
    Number(String),
    Flag(bool),
    List(Vec<DocumentNode>),
    Table(DocumentTable),
}

/// Keys and values in the order of the text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DocumentTable {
    pub line: u32,
    pub entries: Vec<DocumentEntry>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct DocumentEntry {
    pub key: String,
    pub line: u32,
    pub node: DocumentNode,
}

impl DocumentTable {
    pub fn get(&self, key: &str) -> Option<&DocumentNode> {
        let found = self.entries.iter().find(|entry| entry.key == key);
        found.map(|entry| &entry.node)
    }
}

impl DocumentNode {
    pub fn kind(&self) -> &'static str {
        match self.value {
            DocumentValue::Text(_) => "a text",
            DocumentValue::Number(_) => "a bare number",
            DocumentValue::Flag(_) => "true or false",
            DocumentValue::List(_) => "a list",
            DocumentValue::Table(_) => "a table in braces",
        }
    }

    /// Calls `see` with every text in it.
    pub fn visit_texts(&self, see: &mut impl FnMut(&str)) {
        match &self.value {
            DocumentValue::Text(text) => see(text),
            DocumentValue::List(items) => items.iter().for_each(|item| item.visit_texts(see)),
            DocumentValue::Table(table) => {
                let nodes = table.entries.iter().map(|entry| &entry.node);
                nodes.for_each(|node| node.visit_texts(see));
            }
            DocumentValue::Number(_) | DocumentValue::Flag(_) => {}
        }
    }
}

/// Reads a text. After a syntax error everything behind it is doubtful, so only the first is reported.
pub fn read(text: &str) -> Result<DocumentTable, ProtocolProblem> {
    let lines = Lines::of(text);
    match DeTable::parse(text) {
        Ok(document) => Ok(lines.table(document.get_ref(), 0)),
        Err(err) => {
            let line = err.span().map_or(0, |span| lines.at(&span));
            let message = format!(
                "this is not TOML: {}; look for a missing quote, comma, '=' or bracket here or just above",
                err.message().trim().replace('\n', ", ")
            );
            Err(ProtocolProblem::error(line, message))
        }
    }
}

struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let starts = std::iter::once(0).chain(breaks.map(|(offset, _)| offset + 1));
        Self(starts.collect())
    }

    /// The line of a place, from 1.
    fn at(&self, span: &Range<usize>) -> u32 {
        let before = self.0.partition_point(|start| *start <= span.start);
        u32::try_from(before).unwrap_or(u32::MAX)
    }

    fn table(&self, table: &DeTable<'_>, line: u32) -> DocumentTable {
        let mut entries: Vec<(usize, DocumentEntry)> = table
            .iter()
            .map(|(key, value)| {
                let line = self.at(&key.span());
                let entry = DocumentEntry {
                    key: key.get_ref().to_string(),
                    line,
                    node: self.node(value, line),
                };
                (key.span().start, entry)
            })
            .collect();
        // The parser sorts by name; people read by place.
        entries.sort_by_key(|(place, _)| *place);
        let entries = entries.into_iter().map(|(_, entry)| entry).collect();
        DocumentTable { line, entries }
    }

    /// A value; `at_least` is the line of its key, because tables in several pieces have no place of their own.
    fn node(&self, value: &Spanned<DeValue<'_>>, at_least: u32) -> DocumentNode {
        let line = self.at(&value.span()).max(at_least);
        let value = match value.get_ref() {
            DeValue::String(text) => DocumentValue::Text(text.to_string()),
            DeValue::Integer(number) => DocumentValue::Number(number.to_string()),
            DeValue::Float(number) => DocumentValue::Number(number.to_string()),
            DeValue::Boolean(flag) => DocumentValue::Flag(*flag),
            DeValue::Datetime(date) => DocumentValue::Text(date.to_string()),
            DeValue::Array(items) => {
                let items = items.iter().map(|item| self.node(item, at_least));
                DocumentValue::List(items.collect())
            }
            DeValue::Table(table) => DocumentValue::Table(self.table(table, line)),
        };
        DocumentNode { line, value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_knows_its_line_and_order() {
        let text = "b = 1\na = 'x'\n\n[t]\nz = [\n  { k = 'v' },\n  2.5,\n]\n[[m]]\nq = true\n[[m]]\nq = 2\n";
        let tree = read(text).unwrap();
        let keys: Vec<(&str, u32)> =
            tree.entries.iter().map(|entry| (entry.key.as_str(), entry.line)).collect();
        assert_eq!(keys, [("b", 1), ("a", 2), ("t", 4), ("m", 9)]);
        let DocumentValue::Table(t) = &tree.get("t").unwrap().value else {
            panic!("t is a table");
        };
        let DocumentValue::List(items) = &t.get("z").unwrap().value else {
            panic!("z is a list");
        };
        assert_eq!((items[0].line, items[1].line), (6, 7));
        assert_eq!(items[1].value, DocumentValue::Number("2.5".into()));
        let DocumentValue::List(monitors) = &tree.get("m").unwrap().value else {
            panic!("m is a list");
        };
        let lines: Vec<u32> = monitors.iter().map(|node| node.line).collect();
        assert_eq!(lines, [9, 11]);
    }

    #[test]
    fn syntax_error_names_its_line() {
        for (text, line) in [
            ("a = 1\nb = \"open\nc = 2\n", 2),
            ("a = 1\n\nb 2\n", 3),
            ("a = [1,\n2\n", 2),
            ("a = 1\na = 2\n", 2),
        ] {
            let problem = read(text).unwrap_err();
            assert!(problem.line.abs_diff(line) <= 1, "{problem}");
            assert!(problem.message.contains("TOML"), "{problem}");
        }
    }
}
