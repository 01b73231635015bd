//! Licences of data, by their identifiers in the SPDX licence list.

/// A licence of a crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Licence {
    /// As it was given.
    pub id: String,
    pub name: String,
    /// The page with its text.
    pub url: String,
}

/// Identifier and name of licences that data are published under (<https://spdx.org/licenses/>).
const KNOWN: [(&str, &str); 11] = [
    ("CC0-1.0", "Creative Commons Zero v1.0 Universal"),
    ("CC-BY-4.0", "Creative Commons Attribution 4.0 International"),
    ("CC-BY-SA-4.0", "Creative Commons Attribution Share Alike 4.0 International"),
    ("CC-BY-NC-4.0", "Creative Commons Attribution Non Commercial 4.0 International"),
    (
        "CC-BY-NC-SA-4.0",
        "Creative Commons Attribution Non Commercial Share Alike 4.0 International",
    ),
    ("ODbL-1.0", "Open Data Commons Open Database License v1.0"),
    ("ODC-By-1.0", "Open Data Commons Attribution License v1.0"),
    ("PDDL-1.0", "Open Data Commons Public Domain Dedication & License 1.0"),
    ("CDLA-Permissive-2.0", "Community Data License Agreement Permissive 2.0"),
    ("MIT", "MIT License"),
    ("Apache-2.0", "Apache License 2.0"),
];

impl Licence {
    /// By identifier, or by the address of its text.
    pub(super) fn of(id: &str) -> Result<Self, String> {
        if id.starts_with("https://") && !id.contains(char::is_whitespace) {
            return Ok(Self { id: id.to_owned(), name: id.to_owned(), url: id.to_owned() });
        }
        match KNOWN.iter().find(|(known, _)| *known == id) {
            Some((id, name)) => Ok(Self {
                id: (*id).to_owned(),
                name: (*name).to_owned(),
                url: format!("https://spdx.org/licenses/{id}"),
            }),
            None => Err(format!(
                "'{id}' is not a licence that is known here; choose from {}, or give the https address of its text",
                KNOWN.map(|(id, _)| id).join(", ")
            )),
        }
    }
}
