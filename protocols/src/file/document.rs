//! The head of a protocol: name, parameters, limits and monitors. `procedure` reads the steps.

use super::args::STEPS_HINT;
use super::problem::{Problems, suggestion};
use super::scope::visit_names;
use super::tree::{self, DocumentNode, DocumentTable, DocumentValue};
use super::{LANGUAGE, Protocol, parameter};
use std::collections::BTreeSet;

const KEYS: [&str; 11] = [
    "palpate",
    "name",
    "version",
    "title",
    "about",
    "source",
    "ask",
    "parameters",
    "limits",
    "monitor",
    "procedure",
];

/// Everything but the steps, which are kept as they were written.
pub(super) fn read(text: &str, problems: &mut Problems) -> Option<Protocol> {
    let root = match tree::read(text) {
        Ok(root) => root,
        Err(problem) => {
            problems.push(problem);
            return None;
        }
    };
    check_language(&root, problems)?;
    for entry in root.entries.iter().filter(|entry| !KEYS.contains(&entry.key.as_str())) {
        let hint = match entry.key.as_str() {
            "steps" | "step" => STEPS_HINT.into(),
            key => suggestion(key, &KEYS),
        };
        problems.error(entry.line, format!("a protocol has no key '{}'; {hint}", entry.key));
    }
    let mut text_of = |key: &str, example: &str| match root.get(key) {
        Some(DocumentNode { value: DocumentValue::Text(text), .. }) if !text.trim().is_empty() => {
            text.trim().to_owned()
        }
        Some(node) => {
            problems.error(
                node.line,
                format!("'{key}' must be a text in quotes, such as {key} = \"{example}\""),
            );
            String::new()
        }
        None => {
            problems.error(1, format!("the protocol has no '{key}'; write {key} = \"{example}\" above the first [table]"));
            String::new()
        }
    };
    let name = text_of("name", "my-protocol");
    let title = text_of("title", "What is done, in a few words");
    let about = text_of("about", "What it is for and what it shows.");
    let source = text_of("source", "Fung 1993, section 7.5");
    check_name(&root, &name, problems);
    let version = read_version(&root, problems);
    let ask = read_ask(&root, problems);
    let parameters = parameter::read_parameters(&root, problems);
    let procedure = find_procedure(&root, problems);
    let protocol = Protocol {
        name,
        version,
        title,
        about,
        source,
        ask,
        parameters,
        crc32: text_crc32(text),
        limits: root.get("limits").cloned(),
        monitors: root.get("monitor").cloned(),
        procedure,
    };
    check_used(&protocol, problems);
    Some(protocol)
}

fn check_language(root: &DocumentTable, problems: &mut Problems) -> Option<()> {
    let (line, found) = match root.get("palpate") {
        Some(DocumentNode { line, value: DocumentValue::Number(number) }) => {
            (*line, number.as_str())
        }
        Some(node) => {
            let kind = node.kind();
            problems.error(node.line, format!("'palpate' must be the version of the language, not {kind}; write palpate = {LANGUAGE}"));
            return None;
        }
        None => {
            problems.error(1, format!("the protocol does not name its language version; write palpate = {LANGUAGE} on the first line"));
            return None;
        }
    };
    if found == LANGUAGE.to_string() {
        return Some(());
    }
    problems.error(
        line,
        format!("the protocol is written in version {found} of the language, but this program reads version {LANGUAGE}; use a palpate that reads version {found}, or write palpate = {LANGUAGE} and check the protocol again"),
    );
    None
}

fn check_name(root: &DocumentTable, name: &str, problems: &mut Problems) {
    let is_plain =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
    if !name.is_empty() && !name.chars().all(is_plain) {
        let line = root.get("name").map_or(1, |node| node.line);
        problems.error(
            line,
            format!(
                "the name '{name}' has characters that are not allowed; use lower-case letters, digits and '-'"
            ),
        );
    }
}

fn read_version(root: &DocumentTable, problems: &mut Problems) -> u32 {
    let message = "the protocol needs its own version, a whole number from 1; write version = 1 and raise it with every change";
    let node = root.get("version");
    let version = match node.map(|node| &node.value) {
        Some(DocumentValue::Number(number)) => number.parse().unwrap_or(0),
        _ => 0,
    };
    if version == 0 {
        problems.error(node.map_or(1, |node| node.line), message);
    }
    version
}

fn read_ask(root: &DocumentTable, problems: &mut Problems) -> Vec<String> {
    let Some(node) = root.get("ask") else {
        return Vec::new();
    };
    let DocumentValue::List(items) = &node.value else {
        problems
            .error(node.line, "'ask' must be a list, such as ask = [\"operator\", \"specimen\"]");
        return Vec::new();
    };
    let known: Vec<&str> =
        palpate_model::metadata::METADATA_KEYS.iter().map(|key| key.name).collect();
    let mut ask: Vec<String> = Vec::new();
    for item in items {
        match &item.value {
            DocumentValue::Text(key) if ask.contains(key) => {}
            DocumentValue::Text(key) if known.contains(&key.as_str()) => ask.push(key.clone()),
            DocumentValue::Text(key) => {
                let hint = suggestion(key, &known);
                problems.error(item.line, format!("'ask' has no key '{key}'; {hint}"));
            }
            _ => {
                let kind = item.kind();
                let message =
                    format!("'ask' takes keys in quotes, not {kind}; write ask = [\"operator\"]");
                problems.error(item.line, message);
            }
        }
    }
    ask
}

fn find_procedure(root: &DocumentTable, problems: &mut Problems) -> DocumentNode {
    let nothing = DocumentNode { line: 1, value: DocumentValue::List(Vec::new()) };
    let has_steps = |node: &DocumentNode| matches!(&node.value, DocumentValue::Table(table) if table.get("steps").is_some());
    let is_misplaced =
        root.entries.iter().any(|entry| entry.key == "steps" || has_steps(&entry.node));
    let Some(node) = root.get("procedure") else {
        // Steps in the wrong table are reported there.
        if !is_misplaced {
            problems.error(1, "the protocol has no steps; write [procedure] and, on the next line, steps = [ { do = \"self-test\" }, ... ]");
        }
        return nothing;
    };
    let steps = match &node.value {
        DocumentValue::Table(table) => {
            for entry in table.entries.iter().filter(|entry| entry.key != "steps") {
                let message =
                    format!("[procedure] has no key '{}'; write only 'steps' in it", entry.key);
                problems.error(entry.line, message);
            }
            table.get("steps")
        }
        _ => None,
    };
    match steps {
        Some(DocumentNode { line, value: DocumentValue::List(items) }) if items.is_empty() => {
            problems.error(*line, "the list of steps is empty; write steps such as { do = \"self-test\" } between the brackets");
            nothing
        }
        Some(steps @ DocumentNode { value: DocumentValue::List(_), .. }) => steps.clone(),
        _ => {
            problems.error(node.line, "[procedure] has no list of steps; write steps = [ { do = \"self-test\" }, ... ] below it");
            nothing
        }
    }
}

/// An unused parameter would have no effect.
fn check_used(protocol: &Protocol, problems: &mut Problems) {
    let mut used = BTreeSet::new();
    let parts = [Some(&protocol.procedure), protocol.limits.as_ref(), protocol.monitors.as_ref()];
    for part in parts.into_iter().flatten() {
        part.visit_texts(&mut |text| {
            visit_names(text, &mut |name| {
                used.insert(name.to_owned());
            })
        });
    }
    for parameter in protocol.parameters.iter().filter(|parameter| !used.contains(&parameter.name))
    {
        let name = &parameter.name;
        problems.error(
            parameter.line,
            format!("parameter '{name}' is not used; write \"${name}\" where its value belongs, or remove the parameter"),
        );
    }
}

/// CRC-32 of a protocol's text, eight hexadecimal digits.
pub(super) fn text_crc32(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}
