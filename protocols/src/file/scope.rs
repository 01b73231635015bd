//! The names a value may use: parameters, and what the loops around it run through.

use super::problem::suggestion;
use super::quantity::{ProtocolValue, QuantityKind, ValueContent};
use super::tree::{DocumentNode, DocumentValue};

#[derive(Debug, Default)]
pub(super) struct Scope(Vec<(String, ProtocolValue)>);

impl Scope {
    pub fn push(&mut self, name: &str, value: ProtocolValue) {
        self.0.push((name.to_owned(), value));
    }

    pub fn shorten(&mut self, len: usize) {
        self.0.truncate(len);
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(known, _)| known == name)
    }

    fn get(&self, name: &str) -> Result<&ProtocolValue, String> {
        let found = self.0.iter().rev().find(|(known, _)| known == name);
        found.map(|(_, given)| given).ok_or_else(|| {
            let known: Vec<&str> = self.0.iter().map(|(known, _)| known.as_str()).collect();
            let hint = suggestion(name, &known);
            format!("no parameter or loop is called '{name}'; {hint}")
        })
    }

    /// The value of a node for a key of a kind: `$name` stands for a value, `{name}` in a text for its words.
    pub fn value(&self, node: &DocumentNode, kind: QuantityKind) -> Result<ProtocolValue, String> {
        match &node.value {
            DocumentValue::Text(text) => match text.strip_prefix('$') {
                Some(name) => {
                    let given = self.get(name.trim())?.clone();
                    // The message of an unfit value has the name that it came by.
                    let fits = matches!(kind, QuantityKind::Text | QuantityKind::Flag)
                        || given.content == ValueContent::None
                        || given.kind() == Some(kind)
                            && !matches!(given.content, ValueContent::List(_));
                    if fits {
                        Ok(given)
                    } else {
                        Err(format!("{text} does not fit: {}", given.is_not(kind)))
                    }
                }
                None if kind == QuantityKind::Text => {
                    let text = self.filled_in(text)?;
                    Ok(ProtocolValue {
                        content: if text == "none" {
                            ValueContent::None
                        } else {
                            ValueContent::Text
                        },
                        text,
                    })
                }
                None => Ok(ProtocolValue::of_text(text)),
            },
            _ if kind == QuantityKind::Text => {
                Err(format!("{} is not a text; write it in quotes", node.kind()))
            }
            _ => ProtocolValue::of_node(node),
        }
    }

    pub fn list(&self, node: &DocumentNode) -> Result<Vec<ProtocolValue>, String> {
        let given = match &node.value {
            DocumentValue::Text(text) => match text.strip_prefix('$') {
                Some(name) => self.get(name.trim())?.clone(),
                None => ProtocolValue::of_text(text),
            },
            DocumentValue::List(items) => {
                let items = items.iter().map(|item| match &item.value {
                    DocumentValue::Text(text) if text.starts_with('$') => {
                        self.get(text[1..].trim()).cloned()
                    }
                    _ => ProtocolValue::of_node(item),
                });
                ProtocolValue::of_list(items.collect::<Result<_, String>>()?)
            }
            _ => ProtocolValue::of_node(node)?,
        };
        match given.content {
            ValueContent::List(items) if items.is_empty() => {
                Err("the list is empty; write at least one value".into())
            }
            ValueContent::List(ref items) if given.kind().is_none() => {
                let texts: Vec<&str> = items.iter().map(|item| item.text.as_str()).collect();
                Err(format!(
                    "[{}] has values of different kinds; give all of them units of one kind",
                    texts.join(", ")
                ))
            }
            ValueContent::List(items) => Ok(items),
            _ => Err(format!(
                "'{}' is one value, not a list; write [\"{}\"]",
                given.text, given.text
            )),
        }
    }

    /// A text with `{name}` replaced by the words of the value.
    fn filled_in(&self, text: &str) -> Result<String, String> {
        let mut filled = String::with_capacity(text.len());
        let mut rest = text;
        while let Some((before, behind)) = rest.split_once('{') {
            let Some((name, after)) = behind.split_once('}') else {
                return Err(
                    "an opening brace has no closing brace; write {name} for the value of a name"
                        .into(),
                );
            };
            filled.push_str(before);
            filled.push_str(&self.get(name.trim())?.text);
            rest = after;
        }
        filled.push_str(rest);
        Ok(filled)
    }
}

/// Calls `see` with every name that a text uses.
pub(super) fn visit_names(text: &str, see: &mut impl FnMut(&str)) {
    if let Some(name) = text.strip_prefix('$') {
        see(name.trim());
    }
    let mut rest = text;
    while let Some((_, behind)) = rest.split_once('{') {
        let (name, after) = behind.split_once('}').unwrap_or((behind, ""));
        see(name.trim());
        rest = after;
    }
}
