//! Names of the code have no place in sentences: a tool that renames `Rig` also renames it in the middle of a help text
//! (`DecimalSign sign: point or comma`), and no compiler sees it.

use palpate_tests::{files_below, workspace};
use std::collections::BTreeSet;
use std::fs;

/// Names outside the code that are written like a type's.
const PROPER_NAMES: [&str; 35] = [
    // Programs, libraries, repositories and formats.
    "AppImage",
    "CarbonFiberData",
    "CycloneDX",
    "DuckDB",
    "GalilConnector",
    "GitHub",
    "JavaScript",
    "LaTeX",
    "MeshLab",
    "ModemManager",
    "JuliaRheology",
    "MiB",
    "NaN",
    "OpenAPI",
    "PlotJuggler",
    "PyO3",
    "PyPI",
    "RenatoC322",
    "RheoJAX",
    "RunEngine",
    "SarahIaquinta",
    "SplitMix64",
    "StephenQiu628",
    "WebGPU",
    "WebSocket",
    "WireGuard",
    "WorkflowHub",
    // Authors.
    "McCulloch",
    // Makers of rheometers and haptic devices.
    "RheoCompass",
    "SensAble",
    "VerseGrip",
    // Gibson's algorithm and the names that his paper gives its parameters.
    "ChainMail",
    "MaxDist",
    "MaxShear",
    "MinDist",
];

/// Names with underscores that neither a document nor a file of ours explains.
const FOREIGN_NAMES: [&str; 10] = [
    "api_key",
    "assert_eq",
    "clock_gettime",
    "crc_hqx",
    "delay_ticks",
    "egui_plot",
    "make_workbooks",
    "motion_control",
    "nuts_bolts",
    "private_key",
];

/// What a person reads of a source file: its comments, and its texts outside the tests.
#[derive(Default)]
struct Prose {
    comments: Vec<(usize, String)>,
    texts: Vec<(usize, String)>,
}

/// Splits Rust into comments and texts. Lines of one comment are one, so that code spans may cross them.
fn prose(source: &str) -> Prose {
    let mut prose = Prose::default();
    let tests = source.find("\n#[cfg(test)]\nmod ").unwrap_or(source.len());
    let bytes = source.as_bytes();
    let (mut at, mut line) = (0, 1);
    while at < bytes.len() {
        let rest = &source[at..];
        let length = if rest.starts_with("//") {
            let length = rest.find('\n').unwrap_or(rest.len());
            let words = rest[..length].trim_start_matches(['/', '!']);
            match prose.comments.last_mut() {
                Some((last, comment)) if *last + comment.matches('\n').count() + 1 == line => {
                    *comment += "\n";
                    *comment += words;
                }
                _ => prose.comments.push((line, words.to_owned())),
            }
            length
        } else if let Some((length, text)) = text(rest) {
            if at < tests {
                prose.texts.push((line, text));
            }
            length
        } else if let Some(length) = character(rest) {
            length
        } else {
            rest.chars().next().map_or(1, char::len_utf8)
        };
        line += source[at..at + length].matches('\n').count();
        at += length;
    }
    prose
}

/// Length and content of the text at the beginning of `rest`.
fn text(rest: &str) -> Option<(usize, String)> {
    if let Some(raw) = rest.strip_prefix('r') {
        let fence = raw.len() - raw.trim_start_matches('#').len();
        if let Some(inside) = raw[fence..].strip_prefix('"') {
            let end = ["\"", &"#".repeat(fence)].concat();
            let length = inside.find(&end)?;
            return Some((2 + fence + length + end.len(), inside[..length].to_owned()));
        }
    }
    let inside = rest.strip_prefix('"')?;
    let mut is_escaped = false;
    let length = inside.find(|letter| {
        let is_end = letter == '"' && !is_escaped;
        is_escaped = letter == '\\' && !is_escaped;
        is_end
    })?;
    Some((length + 2, inside[..length].replace("\\n", " ")))
}

/// Length of the character literal at the beginning of `rest`; a lifetime is none.
fn character(rest: &str) -> Option<usize> {
    let inside = rest.strip_prefix('\'')?;
    let length = match inside.strip_prefix('\\') {
        Some(escaped) => 1 + escaped.chars().next()?.len_utf8(),
        None => inside.chars().next()?.len_utf8(),
    };
    inside[length..].starts_with('\'').then_some(length + 2)
}

/// The words of a comment or a document without its code: blocks, spans and what links point to.
fn without_code(words: &str) -> String {
    let blocks = words.split("```").step_by(2).collect::<Vec<_>>().join(" ");
    let spans = blocks.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let mut links = spans.split("](");
    let first = links.next().unwrap_or_default().to_owned();
    links.fold(first, |all, link| all + " " + link.split_once(')').map_or("", |(_, rest)| rest))
}

/// The words of a text without what is filled in.
fn without_values(text: &str) -> String {
    let mut parts = text.split('{');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| all + " " + part.split_once('}').map_or(part, |(_, rest)| rest))
}

/// Whether a text is read by a person: at least five words, and neither a table of keys nor of a database.
fn is_sentence(text: &str) -> bool {
    let is_word = |word: &&str| word.len() > 1 && word.chars().all(|one| one.is_ascii_lowercase());
    text.split(|one: char| !one.is_ascii_alphanumeric() && one != '_').filter(is_word).count() >= 5
        && !text.starts_with("{\"")
        && !text.contains("CREATE ")
        && !text.starts_with('<')
}

fn words(prose: &str) -> impl Iterator<Item = &str> {
    // Of a path, an address and a name with a point, no part is a word.
    prose
        .split(|one: char| one.is_whitespace() || "\"'()[],;=+|".contains(one))
        .map(|word| word.trim_matches(['.', ':', '!', '?', '*', '-', '<', '>', '&', '#', '/']))
        .filter(|word| word.chars().all(|one| one.is_ascii_alphanumeric() || one == '_'))
}

/// Written like a type: two capitals that begin words, or an abbreviation after one.
fn is_type_name(word: &str) -> bool {
    let mut letters = word.chars();
    let begins = letters.next().is_some_and(|one| one.is_ascii_uppercase())
        && letters.next().is_some_and(|one| one.is_ascii_lowercase());
    begins && letters.any(|one| one.is_ascii_uppercase())
}

/// Written like a function or a field: words of three letters or more, joined by underscores.
fn is_field_name(word: &str) -> bool {
    let is_part = |part: &str| part.len() > 2 && part.chars().all(|one| one.is_ascii_lowercase());
    word.contains('_') && word.split('_').all(is_part)
}

/// Keys that a person types or reads elsewhere: all that a document, a rig file, a protocol or a table of ours has.
fn known_keys() -> BTreeSet<String> {
    let of = |extension| files_below(&workspace(), extension);
    ["md", "toml", "py", "json"]
        .into_iter()
        .flat_map(of)
        .filter_map(|file| fs::read_to_string(file).ok())
        .flat_map(|text| {
            let words = text.split(|one: char| !one.is_ascii_alphanumeric() && one != '_');
            words.filter(|word| is_field_name(word)).map(str::to_owned).collect::<Vec<_>>()
        })
        .collect()
}

fn is_allowed(word: &str, keys: &BTreeSet<String>) -> bool {
    let is_proper = || PROPER_NAMES.contains(&word);
    (!is_type_name(word) || is_proper())
        && (!is_field_name(word) || keys.contains(word) || FOREIGN_NAMES.contains(&word))
}

#[test]
fn no_sentence_help_or_comment_has_a_name_of_the_code() {
    let keys = known_keys();
    let tops = ["app", "drivers", "model", "protocols", "sessions", "tests"];
    let mut found = Vec::new();
    let mut looked_at = 0;
    for file in tops.into_iter().flat_map(|top| files_below(&workspace().join(top), "rs")) {
        let source = fs::read_to_string(&file).unwrap();
        let Prose { comments, texts } = prose(&source);
        let is_product = file.components().any(|part| part.as_os_str() == "src")
            && !file.starts_with(workspace().join("tests"))
            && !file.to_string_lossy().ends_with("tests.rs");
        let texts = texts.iter().filter(|(_, text)| is_product && is_sentence(text));
        let texts = texts.map(|(line, text)| (*line, without_values(text)));
        let comments = comments.iter().map(|(line, comment)| (*line, without_code(comment)));
        for (line, prose) in texts.chain(comments) {
            looked_at += 1;
            for word in words(&prose).filter(|word| !is_allowed(word, &keys)) {
                found.push(format!("{}:{line}: {word}", file.display()));
            }
        }
    }
    for file in files_below(&workspace(), "md") {
        let prose = without_code(&fs::read_to_string(&file).unwrap());
        looked_at += 1;
        for word in words(&prose).filter(|word| !is_allowed(word, &keys)) {
            found.push(format!("{}: {word}", file.display()));
        }
    }
    assert!(
        found.is_empty(),
        "write the thing in words, its name in backticks, or a proper name into {}:\n{}",
        file!(),
        found.join("\n")
    );
    assert!(looked_at > 5000, "only {looked_at} looked at");
}

#[test]
fn a_renamed_word_in_a_sentence_is_seen() {
    let source = r#"
/// DecimalSign sign: point or comma
fn sign() -> char {
    // Only what can be done is decimals_kept, and so it is done.
    let quote = '"';
    // In `FitReport` and [one](super::FitReport) this is code.
    error("the SimulatedMasterSlave rig of {report:FitReport} is not connected; open it again")
}
"#;
    let Prose { comments, texts } = prose(source);
    let keys = BTreeSet::new();
    let prose = comments.iter().map(|(line, comment)| (*line, without_code(comment)));
    let texts = texts.iter().filter(|(_, text)| is_sentence(text));
    let prose = prose.chain(texts.map(|(line, text)| (*line, without_values(text))));
    let seen: Vec<(usize, String)> = prose
        .flat_map(|(line, prose)| {
            let bad: Vec<String> =
                words(&prose).filter(|word| !is_allowed(word, &keys)).map(str::to_owned).collect();
            bad.into_iter().map(move |word| (line, word))
        })
        .collect();
    let expected = [(2, "DecimalSign"), (4, "decimals_kept"), (7, "SimulatedMasterSlave")];
    assert_eq!(seen, expected.map(|(line, word)| (line, word.to_owned())));
}
