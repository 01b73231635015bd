//! What changed from one version to the next, as the changelog says it: the reason why an older crate gives other numbers.

use serde::Serialize;

const CHANGELOG: &str = include_str!("../../../../CHANGELOG.md");

/// One entry of the changelog.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChangelogEntry {
    /// The version that brought it, or `Unreleased`.
    pub version: String,
    /// Its heading, such as `Fixed`.
    pub section: String,
    /// Its words, without marks of the text format.
    pub text: String,
}

/// Entries of all versions above `version` that change what earlier versions did.
#[must_use]
pub fn changes_since(version: &str) -> Vec<ChangelogEntry> {
    since(CHANGELOG, version)
}

fn since(changelog: &str, version: &str) -> Vec<ChangelogEntry> {
    let limit = version_numbers(version);
    let mut entries: Vec<ChangelogEntry> = Vec::new();
    let (mut current, mut section, mut is_entry) = (String::new(), String::new(), false);
    for line in changelog.lines() {
        if let Some(heading) = line.strip_prefix("## ") {
            current = heading.split(' ').next().unwrap_or_default().to_owned();
            is_entry = false;
            let is_older = version_numbers(&current).is_some_and(|own| Some(own) <= limit);
            if is_older && limit.is_some() {
                break;
            }
        } else if let Some(heading) = line.strip_prefix("### ") {
            section = heading.to_owned();
            is_entry = false;
        } else if let Some(text) = line.strip_prefix("* ") {
            // What is only added changes no number that was there.
            is_entry = section.starts_with("Changed") || section.starts_with("Fixed");
            if is_entry {
                let (version, section) = (current.clone(), section.clone());
                entries.push(ChangelogEntry { version, section, text: text.to_owned() });
            }
        } else if is_entry && let (Some(last), false) = (entries.last_mut(), line.trim().is_empty())
        {
            last.text += " ";
            last.text += line.trim();
        }
    }
    entries.iter_mut().for_each(|entry| entry.text = plain(&entry.text));
    entries
}

/// Major, minor and patch of a version; `None` for a word.
pub(super) fn version_numbers(version: &str) -> Option<[u64; 3]> {
    let mut parts = version.split('.').map(|part| part.parse::<u64>().ok());
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(Some(major)), Some(Some(minor)), Some(Some(patch)), None) => {
            Some([major, minor, patch])
        }
        _ => None,
    }
}

/// Without bold marks, and links as their words.
fn plain(text: &str) -> String {
    let text = text.replace("**", "");
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some((before, link)) = rest.split_once('[') {
        out += before;
        match link.split_once("](") {
            Some((words, target)) if !words.contains('[') => {
                out += words;
                rest = target.split_once(')').map_or("", |(_, after)| after);
            }
            _ => {
                out.push('[');
                rest = link;
            }
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Changelog\n\n## Unreleased\n\n### Changed\n\n* **Fits** take the\n  [zero](docs/zero.md) too.\n\n### Added\n\n* A command.\n\n## 0.2.0 (2026-11-25)\n\n### Fixed\n\n* A sign.\n\n## 0.1.0 (2026-11-23)\n\n### Fixed\n\n* First.\n";

    #[test]
    fn entries_above_a_version_are_those_that_change_something() {
        let words = |version: &str| -> Vec<String> {
            let entries = since(TEXT, version).into_iter();
            entries.map(|one| format!("{} {}: {}", one.version, one.section, one.text)).collect()
        };
        assert_eq!(words("0.2.0"), ["Unreleased Changed: Fits take the zero too."]);
        let all = ["Unreleased Changed: Fits take the zero too.", "0.2.0 Fixed: A sign."];
        assert_eq!(words("0.1.0"), all);
        assert_eq!(words("0.1.7"), all);
        assert_eq!(words("0.0.9").len(), 3);
    }

    #[test]
    fn own_changelog_has_entries_since_the_first_version() {
        let entries = changes_since("0.1.0");
        assert!(entries.len() > 10, "{entries:?}");
        assert!(entries.iter().all(|one| !one.text.contains("**") && !one.text.contains("](")));
        let numbers = version_numbers(env!("CARGO_PKG_VERSION"));
        assert!(numbers.is_some());
    }
}
