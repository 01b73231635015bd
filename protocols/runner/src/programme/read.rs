//! Reads the text of a programme and reports every mistake with its line.

use super::consistency::find_contradictions;
use super::document::{ModelReference, Programme, ProgrammeError, ProgrammeTask};
use super::labels::LabelSettings;
use palpate_model::metadata::SessionLabels;
use palpate_model::units::Seconds;
use palpate_protocols::file::problem::{Problems, nearest, suggestion};
use palpate_protocols::file::tree::{
    self, DocumentEntry, DocumentNode, DocumentTable, DocumentValue,
};
use palpate_protocols::file::{Protocol, built_in};
use std::collections::BTreeMap;
use std::str::FromStr;

/// Version of the language that is read.
const LANGUAGE: &str = "1";

/// Most repeats of a task: more is a mistake of the keyboard.
const REPEATS_MAX: u64 = 1000;

/// Longest rest in s: a day is longer than any specimen lasts.
const REST_MAX_S: f64 = 86_400.0;

/// Keys of a programme, the required ones first.
const KEYS: [&str; 10] = [
    "palpate-programme",
    "name",
    "title",
    "task",
    "purpose",
    "operator",
    "about",
    "specimen",
    "acknowledge",
    "simulated",
];

/// Settings of a simulated rig that a programme may give.
const SIMULATED: [&str; 3] = ["preconditioning", "rate", "softening"];

/// How each of the required [`KEYS`] is written.
const NEEDED: [&str; 4] = [
    "palpate-programme = 1 on its first line",
    "name = \"my-day\"",
    "title = \"What is done, in a few words\"",
    "[[task]], then the lines name = \"press\" and protocol = \"ramp-hold\"",
];

/// Keys of a task, the required ones first.
const TASK_KEYS: [&str; 8] =
    ["name", "protocol", "set", "specimen", "repeats", "rest_s", "calibrates", "validates"];

/// The same of a task.
const TASK_NEEDED: [&str; 2] = ["name = \"press\"", "protocol = \"ramp-hold\""];

const WHOLE: &str = "a whole number without quotes, such as 2";

const PLAIN: &str = "use only letters, digits and hyphens, because a folder gets this name";

impl Programme {
    /// Reads a programme. `other` gives the text of a protocol that is not built in, by the name the programme calls
    /// it. The error holds every problem.
    pub fn read(
        text: &str,
        other: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, ProgrammeError> {
        let root = tree::read(text).map_err(|problem| ProgrammeError(vec![problem]))?;
        let mut reader = Reader::default();
        let whole = reader.programme(&root, other);
        if reader.problems.has_errors() {
            return Err(ProgrammeError(reader.problems.into_list()));
        }
        Ok(whole)
    }
}

#[derive(Default)]
struct Reader {
    problems: Problems,
}

impl Reader {
    fn programme(
        &mut self,
        root: &DocumentTable,
        other: &dyn Fn(&str) -> Result<String, String>,
    ) -> Programme {
        self.check_keys(root, 1, "a programme", &KEYS, &NEEDED);
        self.check_language(root);
        let name = self.text(root, "name").unwrap_or_default();
        // A name that is not a text has its own message.
        if let Some(DocumentNode { line, value: DocumentValue::Text(_) }) = root.get("name")
            && !is_plain(&name)
        {
            let message = format!("a programme cannot be called '{name}'; {PLAIN}");
            self.problems.error(*line, message);
        }
        let mut tasks = Tasks::default();
        for table in self.tables(root) {
            self.task(table, &mut tasks, other);
        }
        let operator = self.text(root, "operator").unwrap_or_default();
        let label_settings = LabelSettings::read(root, &operator, &mut self.problems);
        let whole = Programme {
            name,
            title: self.text(root, "title").unwrap_or_default(),
            purpose: self.text(root, "purpose").unwrap_or_default(),
            default_labels: SessionLabels::default(),
            is_acknowledged: self.flag(root, "acknowledge").unwrap_or_default(),
            simulated: self.simulated(root),
            tasks: tasks.read,
            label_settings,
        };
        let unused = whole.label_settings.specimens();
        let unused = unused.filter(|(number, _)| !tasks.specimens.contains(&Some(*number)));
        // One that cannot be read may be any of them.
        let unused = unused.filter(|_| !tasks.specimens.contains(&None));
        for (number, line) in unused {
            self.problems.error(line, format!(
                "[specimen.{number}] describes a specimen that no task uses; add specimen = {number} to the task that should use it, or remove the table"
            ));
        }
        whole
    }

    fn simulated(&mut self, root: &DocumentTable) -> BTreeMap<String, String> {
        if let Some(DocumentValue::Table(table)) = root.get("simulated").map(|node| &node.value) {
            for DocumentEntry { key, line, .. } in &table.entries {
                if !SIMULATED.contains(&key.as_str()) {
                    let [first, second, third] = SIMULATED;
                    let message = format!(
                        "[simulated] has no setting '{key}'; its settings are {first}, {second} and {third}"
                    );
                    self.problems.error(*line, message);
                }
            }
        }
        self.values(root, "simulated")
    }

    fn check_language(&mut self, root: &DocumentTable) {
        let Some(node) = root.get("palpate-programme") else {
            return;
        };
        let message = match &node.value {
            DocumentValue::Number(found) if found == LANGUAGE => return,
            DocumentValue::Number(found) => format!(
                "the programme is written in version {found} of the language, but this palpate reads version {LANGUAGE}; use a newer palpate"
            ),
            _ => wrong("palpate-programme", node, "the number 1, without quotes"),
        };
        self.problems.error(node.line, message);
    }

    /// Reports unknown keys and missing ones; the first of `known` are required, `needed` says how each is written.
    fn check_keys(
        &mut self,
        table: &DocumentTable,
        line: u32,
        what: &str,
        known: &[&str],
        needed: &[&str],
    ) {
        // A misspelt key is reported as unknown, not as missing too.
        let mut near_misses = Vec::new();
        for entry in &table.entries {
            let key = entry.key.as_str();
            if !known.contains(&key) {
                near_misses.extend(nearest(key, known.iter().copied()));
                let hint = suggestion(key, known);
                let message = format!("{what} has no key '{key}'; {hint}");
                self.problems.error(entry.line, message);
            }
        }
        for (key, example) in known.iter().zip(needed) {
            if table.get(key).is_none() && !near_misses.contains(key) {
                let message = format!("{what} needs '{key}'; write {example}");
                self.problems.error(line, message);
            }
        }
    }

    fn tables<'a>(&mut self, root: &'a DocumentTable) -> Vec<&'a DocumentTable> {
        let Some(node) = root.get("task") else {
            return Vec::new();
        };
        let items = match &node.value {
            DocumentValue::List(items) if !items.is_empty() => items.as_slice(),
            _ => std::slice::from_ref(node),
        };
        let mut tables = Vec::new();
        for item in items {
            match &item.value {
                DocumentValue::Table(table) if item != node => tables.push(table),
                _ => {
                    let message =
                        wrong("task", item, "tables, each under [[task]] in double brackets");
                    self.problems.error(item.line, message);
                }
            }
        }
        tables
    }

    /// Adds a task to `tasks` if it has no mistake, and its name and specimen in any case.
    fn task(
        &mut self,
        table: &DocumentTable,
        tasks: &mut Tasks,
        other: &dyn Fn(&str) -> Result<String, String>,
    ) {
        let before = self.problems.count();
        self.check_keys(table, table.line, "a task", &TASK_KEYS, &TASK_NEEDED);
        let line = |key: &str| table.get(key).map_or(table.line, |node| node.line);
        let name = self.text(table, "name").map(|name| name.trim().to_owned());
        if let Some(name) = &name {
            if !is_plain(name) {
                let message = format!("a task cannot be called '{name}'; {PLAIN}");
                self.problems.error(line("name"), message);
            }
            if tasks.names.contains(name) {
                let message =
                    format!("the programme already has a task '{name}'; choose another name");
                self.problems.error(line("name"), message);
            }
        }
        let repeats: u64 = self.number(table, "repeats", WHOLE).unwrap_or(1);
        if !(1..=REPEATS_MAX).contains(&repeats) {
            let message = format!("{repeats} repeats are not possible; give 1 to {REPEATS_MAX}");
            self.problems.error(line("repeats"), message);
        }
        let number = "a number without quotes, such as 2.5";
        let rest_s = self.number(table, "rest_s", number).unwrap_or(0.0);
        if !(0.0..=REST_MAX_S).contains(&rest_s) {
            let message = format!("a rest of {rest_s} s is not possible; give 0 to {REST_MAX_S} s");
            self.problems.error(line("rest_s"), message);
        }
        let validates = self.text(table, "validates");
        if let Some(model) = validates.as_ref().filter(|one| !tasks.names.contains(*one)) {
            let message = format!(
                "no task before this one is called '{model}'; 'validates' must name an earlier task"
            );
            self.problems.error(line("validates"), message);
        }
        let number = format!("{WHOLE}, and write the name of the specimen as name in [specimen.2]");
        let specimen: Option<u64> = self.number(table, "specimen", &number);
        let values = self.values(table, "set");
        let calibrates = self.flag(table, "calibrates").unwrap_or_default();
        let called = self.text(table, "protocol");
        let protocol = called.and_then(|called| self.protocol(&called, line("protocol"), other));
        let wrong = protocol.as_ref().map(|one| one.plan(&values));
        for problem in wrong.and_then(Result::err).into_iter().flatten() {
            self.problems.error(line("set"), problem.to_string());
        }
        tasks.names.extend(name.clone());
        tasks.specimens.extend(table.get("specimen").map(|_| specimen));
        let (Some(name), Some(protocol)) = (name, protocol) else {
            return;
        };
        if self.problems.count() > before {
            return;
        }
        let task = ProgrammeTask {
            name,
            protocol,
            values,
            specimen,
            repeats: repeats as u32, // At most a thousand.
            rest: Seconds(rest_s),
            calibrates,
            validates: validates.map(|task| ModelReference { task }),
            line: table.line,
        };
        for doubt in find_contradictions(&task, &tasks.read) {
            self.problems.error(task.line, doubt);
        }
        tasks.read.push(task);
    }

    /// A protocol that is built in or given by `other`; its own mistakes stand at `line` with its name.
    fn protocol(
        &mut self,
        called: &str,
        line: u32,
        other: &dyn Fn(&str) -> Result<String, String>,
    ) -> Option<Protocol> {
        let found =
            built_in(called).map_or_else(|| other(called).map(|text| Protocol::read(&text)), Ok);
        match self.problems.take(line, found)? {
            Ok(protocol) => Some(protocol),
            Err(wrong) => {
                for problem in wrong {
                    let message = format!("protocol '{called}': {problem}");
                    self.problems.error(line, message);
                }
                None
            }
        }
    }

    /// `None` where the key is missing or `read` refuses its value, which is a problem.
    fn value<T>(
        &mut self,
        table: &DocumentTable,
        key: &str,
        wanted: &str,
        read: impl Fn(&DocumentValue) -> Option<T>,
    ) -> Option<T> {
        let node = table.get(key)?;
        let value = read(&node.value).ok_or_else(|| wrong(key, node, wanted));
        self.problems.take(node.line, value)
    }

    fn text(&mut self, table: &DocumentTable, key: &str) -> Option<String> {
        self.value(table, key, "a text in quotes", |value| match value {
            DocumentValue::Text(text) => Some(text.clone()),
            _ => None,
        })
    }

    fn flag(&mut self, table: &DocumentTable, key: &str) -> Option<bool> {
        let wanted = "true or false, without quotes";
        self.value(table, key, wanted, |value| match value {
            DocumentValue::Flag(flag) => Some(*flag),
            _ => None,
        })
    }

    fn number<T: FromStr>(&mut self, table: &DocumentTable, key: &str, wanted: &str) -> Option<T> {
        self.value(table, key, wanted, |value| match value {
            DocumentValue::Number(number) => number.parse().ok(),
            _ => None,
        })
    }

    /// Values as a protocol's parameters are given: a text, or a number without a unit; a list with commas. Whether
    /// that is a value, the protocol says.
    fn values(&mut self, table: &DocumentTable, key: &str) -> BTreeMap<String, String> {
        let wanted = "values in braces, as in { depth = \"20 mm\" }";
        let entries = self.value(table, key, wanted, |value| match value {
            DocumentValue::Table(table) => Some(table.entries.clone()),
            _ => None,
        });
        let mut values = BTreeMap::new();
        for DocumentEntry { key, line, node } in entries.unwrap_or_default() {
            let text = as_text(&node).ok_or_else(|| wrong(&key, &node, "a text in quotes"));
            values.extend(self.problems.take(line, text).map(|text| (key, text)));
        }
        values
    }
}

#[derive(Default)]
struct Tasks {
    read: Vec<ProgrammeTask>,
    names: Vec<String>,
    /// Specimens of all tasks that clip one in; `None` for one that is not a number.
    specimens: Vec<Option<u64>>,
}

fn wrong(key: &str, node: &DocumentNode, wanted: &str) -> String {
    let found = match &node.value {
        DocumentValue::Text(text) => format!("\"{text}\""),
        DocumentValue::Number(number) => number.clone(),
        DocumentValue::Flag(flag) => flag.to_string(),
        DocumentValue::List(_) | DocumentValue::Table(_) => node.kind().to_owned(),
    };
    format!("{key} cannot be {found}; give {wanted}")
}

fn as_text(node: &DocumentNode) -> Option<String> {
    match &node.value {
        DocumentValue::Text(text) | DocumentValue::Number(text) => Some(text.clone()),
        DocumentValue::Flag(flag) => Some(flag.to_string()),
        DocumentValue::List(items) => {
            let items: Option<Vec<String>> = items.iter().map(as_text).collect();
            Some(items?.join(", "))
        }
        DocumentValue::Table(_) => None,
    }
}

/// Whether a name can be that of a folder anywhere.
fn is_plain(name: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    !name.is_empty() && name.chars().all(is_plain)
}
