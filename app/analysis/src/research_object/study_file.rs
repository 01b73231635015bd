//! The file that says what a crate is about, who made it and what it computes.

use super::licences::Licence;
use super::people::{CratePerson, check_orcid};
use super::steps::{CrateStep, check_words};
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::file::problem::{Problems, suggestion};
use palpate_protocols::file::tree::{self, DocumentNode, DocumentTable, DocumentValue};

/// Name of the file in a crate.
pub const STUDY_FILE: &str = "study.toml";
/// Version of the file that is read.
pub const STUDY_VERSION: u32 = 1;

const KEYS: [&str; 7] =
    ["palpate-crate", "title", "description", "licence", "files", "person", "step"];

/// What a crate is about.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrateStudy {
    pub title: String,
    pub description: String,
    pub licence: Option<Licence>,
    /// Further files that go in, from the folder of the study file.
    pub files: Vec<String>,
    pub people: Vec<CratePerson>,
    pub steps: Vec<CrateStep>,
}

impl CrateStudy {
    /// Reads the text of a study file. `check` refuses words of a step that are no command line.
    ///
    /// # Errors
    /// Everything that is wrong with it, each with its line.
    pub fn parse(
        text: &str,
        check: &dyn Fn(&[String]) -> Result<(), String>,
    ) -> Result<Self, Vec<ProtocolProblem>> {
        let root = tree::read(text).map_err(|problem| vec![problem])?;
        let mut reader = Reader { study: Self::default(), problems: Problems::default(), check };
        reader.root(&root);
        match reader.problems.has_errors() {
            true => Err(reader.problems.into_list()),
            false => Ok(reader.study),
        }
    }

    /// The file that reads as this.
    #[must_use]
    pub fn text(&self) -> String {
        let quoted = |text: &str| toml_text(text);
        let list = |words: &[String]| {
            let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
            format!("[{}]", words.join(", "))
        };
        let mut text = format!("palpate-crate = {STUDY_VERSION}\n");
        text += &format!("title = {}\n", quoted(&self.title));
        if !self.description.is_empty() {
            text += &format!("description = {}\n", quoted(&self.description));
        }
        if let Some(licence) = &self.licence {
            text += &format!("licence = {}\n", quoted(&licence.id));
        }
        if !self.files.is_empty() {
            text += &format!("files = {}\n", list(&self.files));
        }
        for person in &self.people {
            text += &format!("\n[[person]]\nname = {}\n", quoted(&person.name));
            let optional = [("orcid", &person.orcid), ("affiliation", &person.affiliation)];
            for (key, value) in optional {
                text += &value
                    .as_ref()
                    .map_or(String::new(), |value| format!("{key} = {}\n", quoted(value)));
            }
        }
        for step in &self.steps {
            text += &format!("\n[[step]]\nname = {}\nrun = ", quoted(&step.name));
            text += &format!("{}\n", list(&step.words));
        }
        text
    }
}

/// A basic string of TOML 1.0.
fn toml_text(text: &str) -> String {
    let mut out = String::from('"');
    for letter in text.chars() {
        match letter {
            '"' | '\\' => out.extend(['\\', letter]),
            letter if letter.is_control() => out += &format!("\\u{:04X}", u32::from(letter)),
            letter => out.push(letter),
        }
    }
    out + "\""
}

struct Reader<'a> {
    study: CrateStudy,
    problems: Problems,
    check: &'a dyn Fn(&[String]) -> Result<(), String>,
}

impl Reader<'_> {
    fn root(&mut self, root: &DocumentTable) {
        let version = root.get(KEYS[0]);
        let known = DocumentValue::Number(STUDY_VERSION.to_string());
        if version.map(|node| &node.value) != Some(&known) {
            let line = version.map_or(1, |node| node.line);
            let message = format!(
                "the study file of a crate says palpate-crate = {STUDY_VERSION} on its first line; add that, or use a palpate that reads its version"
            );
            self.problems.error(line, message);
        }
        self.unknown_keys(root, &KEYS, "the study file of a crate");
        match self.text(root, "title") {
            Some(title) => self.study.title = title,
            None => self.problems.error(1, "the study file has no title; add title = \"...\""),
        }
        self.study.description = self.text(root, "description").unwrap_or_default();
        if let Some(id) = self.text(root, "licence") {
            let line = root.get("licence").map_or(1, |node| node.line);
            self.study.licence = self.problems.take(line, Licence::of(&id));
        }
        if let Some(node) = root.get("files") {
            self.study.files = self.words(node, "files").unwrap_or_default();
        }
        for table in self.tables(root, "person") {
            self.person(&table);
        }
        for table in self.tables(root, "step") {
            self.step(&table);
        }
    }

    fn unknown_keys(&mut self, table: &DocumentTable, known: &[&str], what: &str) {
        for entry in &table.entries {
            if !known.contains(&entry.key.as_str()) {
                let hint = suggestion(&entry.key, known);
                let message = format!("{what} has no key '{}'; {hint}", entry.key);
                self.problems.error(entry.line, message);
            }
        }
    }

    /// The text of a key; one line, not empty.
    fn text(&mut self, table: &DocumentTable, key: &str) -> Option<String> {
        let node = table.get(key)?;
        match &node.value {
            DocumentValue::Text(text) if !text.trim().is_empty() => Some(text.trim().to_owned()),
            _ => {
                let message = format!("{key} is {}; give some words in quotes", node.kind());
                self.problems.error(node.line, message);
                None
            }
        }
    }

    fn words(&mut self, node: &DocumentNode, key: &str) -> Option<Vec<String>> {
        let wrong = format!("{key} is not a list of texts; write {key} = [\"...\", \"...\"]");
        let DocumentValue::List(items) = &node.value else {
            self.problems.error(node.line, wrong);
            return None;
        };
        let word = |item: &DocumentNode| match &item.value {
            DocumentValue::Text(word) => Some(word.clone()),
            _ => None,
        };
        let words: Option<Vec<String>> = items.iter().map(word).collect();
        if words.is_none() {
            self.problems.error(node.line, wrong);
        }
        words
    }

    /// The tables of a key that may be there several times.
    fn tables(&mut self, root: &DocumentTable, key: &str) -> Vec<DocumentTable> {
        let Some(node) = root.get(key) else { return Vec::new() };
        let wrong = format!("'{key}' is not a list of tables; write each under [[{key}]]");
        let DocumentValue::List(items) = &node.value else {
            self.problems.error(node.line, wrong);
            return Vec::new();
        };
        let mut tables = Vec::new();
        for item in items {
            match &item.value {
                DocumentValue::Table(table) => {
                    tables.push(DocumentTable { line: item.line, ..table.clone() });
                }
                _ => self.problems.error(item.line, wrong.clone()),
            }
        }
        tables
    }

    fn person(&mut self, table: &DocumentTable) {
        self.unknown_keys(table, &["name", "orcid", "affiliation"], "a person");
        let Some(name) = self.text(table, "name") else {
            return self.problems.error(table.line, "a person has no name; add name = \"...\"");
        };
        let line = table.get("orcid").map_or(table.line, |node| node.line);
        let orcid = self.text(table, "orcid").map(|orcid| check_orcid(&orcid));
        let orcid = orcid.and_then(|orcid| self.problems.take(line, orcid));
        let affiliation = self.text(table, "affiliation");
        self.study.people.push(CratePerson { name, orcid, affiliation });
    }

    fn step(&mut self, table: &DocumentTable) {
        self.unknown_keys(table, &["name", "run"], "a step");
        let Some(name) = self.text(table, "name") else {
            return self.problems.error(table.line, "a step has no name; add name = \"...\"");
        };
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_');
        if !name.chars().all(is_plain) {
            let message = format!(
                "the name '{name}' of a step is not a name of a folder; use letters of ASCII, digits, '-' and '_'"
            );
            return self.problems.error(table.line, message);
        }
        let is_same = |step: &CrateStep| step.name.eq_ignore_ascii_case(&name);
        if self.study.steps.iter().any(is_same) {
            let message = format!("two steps have the name '{name}'; rename one of them");
            return self.problems.error(table.line, message);
        }
        let Some(node) = table.get("run") else {
            let message = format!("the step '{name}' has nothing to run; add run = [\"fit\", ...]");
            return self.problems.error(table.line, message);
        };
        let Some(words) = self.words(node, "run") else { return };
        let checked = check_words(&words).map_err(|err| err.to_string());
        let checked = checked.and_then(|()| (self.check)(&words));
        self.problems.take(node.line, checked.map_err(|err| format!("step '{name}': {err}")));
        self.study.steps.push(CrateStep { name, words });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STUDY: &str = r#"palpate-crate = 1
title = "Stiffness of pig liver"
description = "Two \"specimens\"."
licence = "CC-BY-4.0"
files = ["compliance.json"]

[[person]]
name = "Josiah Carberry"
orcid = "0000-0002-1825-0097"
affiliation = "Brown University"

[[step]]
name = "fit-1"
run = ["fit", "sessions/liver 1", "--json"]
"#;

    fn parse(text: &str) -> Result<CrateStudy, Vec<ProtocolProblem>> {
        CrateStudy::parse(text, &|_| Ok(()))
    }

    #[test]
    fn study_reads_as_it_is_written() {
        let study = parse(STUDY).unwrap();
        assert_eq!(study.text(), STUDY);
        assert_eq!(study.people[0].orcid.as_deref(), Some("0000-0002-1825-0097"));
        assert_eq!(study.steps[0].folder(), "results/fit-1");
    }

    #[test]
    fn mistakes_name_their_lines() {
        let head = "palpate-crate = 1\ntitle = \"t\"\n";
        for (text, line) in [
            ("title = \"t\"\n".to_owned(), 1),
            ("palpate-crate = 2\ntitle = \"t\"\n".to_owned(), 1),
            (format!("{head}colour = 1\n"), 3),
            (format!("{head}licence = \"mine\"\n"), 3),
            (format!("{head}files = \"a\"\n"), 3),
            (format!("{head}[[person]]\nname = \"a\"\norcid = \"0000-0002-1825-0098\"\n"), 5),
            (format!("{head}[[person]]\norcid = \"0000-0002-1825-0097\"\n"), 3),
            (format!("{head}[[step]]\nname = \"a/b\"\nrun = [\"fit\"]\n"), 3),
            (format!("{head}[[step]]\nname = \"a\"\nrun = [\"run\", \"x\"]\n"), 5),
            (format!("{head}[[step]]\nname = \"a\"\nrun = \"fit\"\n"), 5),
            (format!("{head}[[step]]\nname = \"a\"\nrun = [\"fit\", \"../x\"]\n"), 5),
            (format!("{head}[[step]]\nname = \"a\"\nwalk = 1\nrun = [\"fit\"]\n"), 5),
        ] {
            let found = parse(&text).unwrap_err();
            assert_eq!(found[0].line, line, "{text}: {found:?}");
        }
        let refused = CrateStudy::parse(STUDY, &|_| Err("no such option".to_owned())).unwrap_err();
        assert_eq!(refused[0].line, 14, "{refused:?}");
    }
}
