//! The head of a protocol: who it is, what may be changed, what is watched. The steps are read by `procedure`.

use super::args::{Args, STEPS_HINT, check_range};
use super::problem::{Problem, Problems, suggestion};
use super::quantity::{Given, Kind, What};
use super::scope::{Scope, names_in};
use super::tree::{self, Node, Table, Value};
use super::words::{Key, Need, Range};
use super::{ASKABLE, LANGUAGE, Parameter, Protocol};
use crate::plans::{Action, Monitor, PlanLimits, Side, Source};
use palpate_model::units::{Newtons, Seconds};
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
    for entry in root
        .entries
        .iter()
        .filter(|entry| !KEYS.contains(&entry.key.as_str()))
    {
        let hint = match entry.key.as_str() {
            "steps" | "step" => STEPS_HINT.into(),
            key => suggestion(key, &KEYS),
        };
        problems.error(
            entry.line,
            format!("a protocol has no key '{}'; {hint}", entry.key),
        );
    }
    let mut text_of = |key: &str, example: &str| match root.get(key) {
        Some(Node {
            value: Value::Text(text),
            ..
        }) if !text.trim().is_empty() => text.trim().to_owned(),
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
    let version = version(&root, problems);
    let ask = ask(&root, problems);
    let parameters = parameters(&root, problems);
    let procedure = procedure(&root, problems);
    let protocol = Protocol {
        name,
        version,
        title,
        about,
        source,
        ask,
        parameters,
        crc32: format!("{:08x}", crc32fast::hash(text.as_bytes())),
        limits: root.get("limits").cloned(),
        monitors: root.get("monitor").cloned(),
        procedure,
    };
    check_used(&protocol, problems);
    Some(protocol)
}

fn check_language(root: &Table, problems: &mut Problems) -> Option<()> {
    let (line, found) = match root.get("palpate") {
        Some(Node {
            line,
            value: Value::Number(number),
        }) => (*line, number.as_str()),
        Some(node) => (node.line, node.kind()),
        None => {
            let first = format!("palpate = {LANGUAGE}");
            problems.error(1, format!("this does not say that it is a palpate protocol; write {first} on its first line"));
            return None;
        }
    };
    if found == LANGUAGE.to_string() {
        return Some(());
    }
    problems.error(
        line,
        format!("the protocol is written in version {found} of the language, this program reads version {LANGUAGE}; use the palpate it was written for, or write palpate = {LANGUAGE} and check it again"),
    );
    None
}

fn check_name(root: &Table, name: &str, problems: &mut Problems) {
    let is_plain =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
    if !name.is_empty() && !name.chars().all(is_plain) {
        let line = root.get("name").map_or(1, |node| node.line);
        problems.error(
            line,
            format!(
                "the name '{name}' cannot be typed everywhere; use small letters, digits and '-'"
            ),
        );
    }
}

fn version(root: &Table, problems: &mut Problems) -> u32 {
    let message = "the protocol needs its own version, a whole number from 1; write version = 1 and raise it with every change";
    let (line, version) = match root.get("version") {
        Some(node) => match &node.value {
            Value::Number(number) => (node.line, number.parse().unwrap_or(0)),
            _ => (node.line, 0),
        },
        None => (1, 0),
    };
    if version == 0 {
        problems.error(line, message);
    }
    version
}

fn ask(root: &Table, problems: &mut Problems) -> Vec<String> {
    let Some(node) = root.get("ask") else {
        return Vec::new();
    };
    let Value::List(items) = &node.value else {
        problems.error(
            node.line,
            "'ask' must be a list, such as ask = [\"operator\", \"specimen\"]",
        );
        return Vec::new();
    };
    let known: Vec<&str> = ASKABLE.iter().map(|(key, _)| *key).collect();
    let mut ask: Vec<String> = Vec::new();
    for item in items {
        match &item.value {
            Value::Text(key) if known.contains(&key.as_str()) => {
                if !ask.contains(key) {
                    ask.push(key.clone());
                }
            }
            Value::Text(key) => {
                problems.error(
                    item.line,
                    format!("'{key}' cannot be asked for; {}", suggestion(key, &known)),
                );
            }
            _ => problems.error(
                item.line,
                format!(
                    "{} cannot be asked for; write a text in quotes",
                    item.kind()
                ),
            ),
        }
    }
    ask
}

fn parameters(root: &Table, problems: &mut Problems) -> Vec<Parameter> {
    let Some(node) = root.get("parameters") else {
        return Vec::new();
    };
    let Value::Table(table) = &node.value else {
        problems.error(
            node.line,
            "'parameters' must be a table; write [parameters] on a line of its own",
        );
        return Vec::new();
    };
    let read = |entry: &tree::Entry| {
        let Value::Table(keys) = &entry.node.value else {
            let name = &entry.key;
            if name == "steps" {
                problems.error(
                    entry.line,
                    format!("[parameters] has no key 'steps'; {STEPS_HINT}"),
                );
                return None;
            }
            problems.error(
                entry.line,
                format!("parameter '{name}' must say more than a value; write {name} = {{ default = \"20 mm\", about = \"...\", source = \"...\" }}"),
            );
            return None;
        };
        parameter(&entry.key, keys, problems)
    };
    table.entries.iter().filter_map(read).collect()
}

const PARAMETER_KEYS: [&str; 6] = ["default", "unit", "min", "max", "about", "source"];

fn parameter(name: &str, keys: &Table, problems: &mut Problems) -> Option<Parameter> {
    let line = keys.line;
    for entry in &keys.entries {
        if !PARAMETER_KEYS.contains(&entry.key.as_str()) {
            let hint = suggestion(&entry.key, &PARAMETER_KEYS);
            problems.error(
                entry.line,
                format!("parameter '{name}' has no key '{}'; {hint}", entry.key),
            );
        }
    }
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
    if name.is_empty() || !name.chars().all(is_plain) {
        problems.error(
            line,
            format!("a parameter cannot be called '{name}'; use letters, digits, '_' and '-'"),
        );
        return None;
    }
    let text_of = |key: &str| match keys.get(key).map(|node| &node.value) {
        Some(Value::Text(text)) => text.trim().to_owned(),
        _ => String::new(),
    };
    let (about, source) = (text_of("about"), text_of("source"));
    if about.is_empty() {
        problems.error(
            line,
            format!("parameter '{name}' does not say what it is; write about = \"...\""),
        );
    }
    let Some(default) = keys.get("default") else {
        problems.error(
            line,
            format!(
                "parameter '{name}' has no default; write default = \"20 mm\" or whatever is usual"
            ),
        );
        return None;
    };
    let default = problems.take(default.line, Given::of_node(default))?;
    let unit = text_of("unit");
    let kind = match (default.kind(), unit.as_str()) {
        (Some(kind), "") => kind,
        (None, "") => {
            problems.error(line, format!("the default of '{name}' does not tell its unit; add unit = \"mm\" or whatever it is"));
            return None;
        }
        (found, unit) => match Kind::of_unit(unit).or((unit == "text").then_some(Kind::Text)) {
            Some(kind) if found.is_none_or(|found| found == kind) => kind,
            Some(kind) => {
                problems.error(
                    line,
                    format!("the default of '{name}' is wrong: {}", default.is_not(kind)),
                );
                return None;
            }
            None => {
                problems.error(line, format!("'{unit}' of '{name}' is no unit; write mm, mm/s, N, s, g, Hz, N/min, V or text"));
                return None;
            }
        },
    };
    let mut bound = |key: &str| {
        let node = keys.get(key)?;
        let number = Given::of_node(node).and_then(|given| given.number(kind));
        problems.take(
            node.line,
            number.map_err(|why| format!("'{key}' of '{name}': {why}")),
        )
    };
    let parameter = Parameter {
        name: name.to_owned(),
        kind,
        is_list: matches!(default.what, What::List(_)),
        min: bound("min"),
        max: bound("max"),
        default,
        about,
        source,
        line,
    };
    if let Err(why) = parameter.check(&parameter.default) {
        problems.error(
            line,
            format!("the default of '{name}' does not pass its own check: {why}"),
        );
    }
    Some(parameter)
}

fn procedure(root: &Table, problems: &mut Problems) -> Node {
    let nothing = Node {
        line: 1,
        value: Value::List(Vec::new()),
    };
    let has_steps =
        |node: &Node| matches!(&node.value, Value::Table(table) if table.get("steps").is_some());
    let is_misplaced = root
        .entries
        .iter()
        .any(|entry| entry.key == "steps" || has_steps(&entry.node));
    let Some(node) = root.get("procedure") else {
        // Steps that stand elsewhere are told there.
        if is_misplaced {
            return nothing;
        }
        problems.error(1, "the protocol does nothing; write [procedure] and below it steps = [ { do = \"self-test\" }, ... ]");
        return nothing;
    };
    let steps = match &node.value {
        Value::Table(table) => {
            for entry in table.entries.iter().filter(|entry| entry.key != "steps") {
                problems.error(
                    entry.line,
                    format!("[procedure] has only the key 'steps', not '{}'", entry.key),
                );
            }
            table.get("steps")
        }
        _ => None,
    };
    match steps {
        Some(Node {
            line,
            value: Value::List(items),
        }) if items.is_empty() => {
            problems.error(*line, "the protocol has no steps; write { do = \"self-test\" } and so on between the brackets");
            nothing
        }
        Some(
            steps @ Node {
                value: Value::List(_),
                ..
            },
        ) => steps.clone(),
        _ => {
            problems.error(node.line, "[procedure] has no list of steps; write steps = [ { do = \"self-test\" }, ... ] below it");
            nothing
        }
    }
}

/// A parameter that nothing uses promises something that will not happen.
fn check_used(protocol: &Protocol, problems: &mut Problems) {
    let mut used = BTreeSet::new();
    let parts = [
        Some(&protocol.procedure),
        protocol.limits.as_ref(),
        protocol.monitors.as_ref(),
    ];
    for part in parts.into_iter().flatten() {
        part.each_text(&mut |text| {
            names_in(text, &mut |name| {
                used.insert(name.to_owned());
            })
        });
    }
    for parameter in protocol
        .parameters
        .iter()
        .filter(|parameter| !used.contains(&parameter.name))
    {
        let name = &parameter.name;
        problems.error(
            parameter.line,
            format!("parameter '{name}' is not used by any step; write \"${name}\" where its value belongs or take it out"),
        );
    }
}

const LIMIT_KEYS: [Key; 1] = [Key {
    name: "force_max",
    kind: Kind::Force,
    range: Range::Above0,
    need: Need::Optional,
    about: "highest force above tare; the rig's own limit holds too",
}];

/// The limits of a plan for given values.
pub(super) fn limits(node: Option<&Node>, scope: &Scope, problems: &mut Problems) -> PlanLimits {
    match node {
        None => PlanLimits::default(),
        Some(Node {
            value: Value::Table(table),
            ..
        }) => {
            let args = Args::read(table, "[limits]", &[&LIMIT_KEYS], &[], scope, problems);
            PlanLimits {
                force_max: args.maybe("force_max").map(Newtons),
            }
        }
        Some(node) => {
            problems.error(
                node.line,
                "'limits' must be a table; write [limits] on a line of its own",
            );
            PlanLimits::default()
        }
    }
}

const fn monitor_key(name: &'static str, range: Range, need: Need, about: &'static str) -> Key {
    Key {
        name,
        kind: Kind::Text,
        range,
        need,
        about,
    }
}

/// What a monitor can look at, with its kind.
const SOURCES: [(&str, Source, Kind); 4] = [
    ("force", Source::Force, Kind::Force),
    ("depth", Source::Depth, Kind::Length),
    ("signal", Source::Volts, Kind::Voltage),
    ("position", Source::Position, Kind::Length),
];

const ACTIONS: [(&str, Action); 5] = [
    ("note", Action::Note),
    ("pause", Action::Pause),
    ("stop", Action::Stop),
    ("retract", Action::Retract),
    ("halt", Action::Halt),
];

/// Keys of a monitor beside the values, whose unit depends on what is watched.
pub(super) const MONITOR_KEYS: [Key; 4] = [
    monitor_key(
        "watch",
        Range::OneOf(&["force", "depth", "signal", "position"]),
        Need::Required,
        "`force`, `depth`, `signal` or `position`",
    ),
    Key {
        name: "settle",
        kind: Kind::Time,
        range: Range::From0,
        need: Need::Usual("1 s"),
        about: "how long it must be past before a paused run goes on",
    },
    monitor_key(
        "action",
        Range::OneOf(&["note", "pause", "stop", "retract", "halt"]),
        Need::Required,
        "`note`, `pause`, `stop`, `retract` or `halt`",
    ),
    monitor_key(
        "message",
        Range::Any,
        Need::Required,
        "what the operator reads",
    ),
];

/// The monitors of a plan for given values.
pub(super) fn monitors(
    node: Option<&Node>,
    scope: &Scope,
    problems: &mut Problems,
) -> Vec<Monitor> {
    let Some(node) = node else {
        return Vec::new();
    };
    let Value::List(items) = &node.value else {
        problems.error(
            node.line,
            "write [[monitor]] in double brackets, once for each monitor",
        );
        return Vec::new();
    };
    let tables = items.iter().filter_map(|item| match &item.value {
        Value::Table(table) => Some(table),
        _ => None,
    });
    tables
        .filter_map(|table| monitor(table, scope, problems))
        .collect()
}

fn monitor(table: &Table, scope: &Scope, problems: &mut Problems) -> Option<Monitor> {
    let besides = ["above", "below", "resume"];
    let args = Args::read(
        table,
        "a monitor",
        &[&MONITOR_KEYS],
        &besides,
        scope,
        problems,
    );
    let watch = args.text("watch").ok()?;
    let (_, source, kind) = *SOURCES.iter().find(|(name, ..)| *name == watch)?;
    let mut value = |key: &str| {
        let node = table.get(key)?;
        let number = scope.value(node, kind).and_then(|given| {
            let number = given.number(kind)?;
            check_range(kind, Range::Any, number).map(|()| number)
        });
        problems.take(
            node.line,
            number.map_err(|why| format!("'{key}' of a monitor: {why}")),
        )
    };
    let (above, below, resume) = (value("above"), value("below"), value("resume"));
    let (side, threshold) = match (table.get("above").is_some(), table.get("below").is_some()) {
        (true, false) => (Side::Above, above?),
        (false, true) => (Side::Below, below?),
        _ => {
            problems.error(
                table.line,
                "a monitor needs one threshold: write above = \"6 N\" or below = \"6 N\"",
            );
            return None;
        }
    };
    let monitor = Monitor {
        source,
        side,
        threshold,
        // Without a value of its own it is past as soon as it no longer trips.
        resume: if table.get("resume").is_some() {
            resume?
        } else {
            threshold
        },
        settle: Seconds(args.number("settle").ok()?),
        action: ACTIONS
            .iter()
            .find(|(name, _)| args.text("action") == Ok(name))?
            .1,
        message: args.text("message").ok()?.to_owned(),
    };
    if let Err(why) = monitor.check() {
        let line = table.get("resume").map_or(table.line, |node| node.line);
        problems.push(Problem::error(
            line,
            format!("{why}; give a 'resume' on the other side of the threshold"),
        ));
    }
    Some(monitor)
}
