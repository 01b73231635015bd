//! JSON messages of a log; a message that would not read back unchanged is refused.

use super::error::{LogError, encode_error};
use crate::record::{EntryMessage, LogEntry};

/// Deepest nesting of an entry; the parser's limit is 128.
const JSON_DEPTH_MAX: usize = 100;

pub(super) fn entry_json(entry: &LogEntry) -> Result<Vec<u8>, LogError> {
    if !is_shallow(&entry.body, JSON_DEPTH_MAX) {
        return Err(LogError::Encode {
            what: "entry",
            reason: format!("it is nested more than {JSON_DEPTH_MAX} levels deep"),
        });
    }
    let message = EntryMessage {
        order: entry.order,
        after_sample: entry.after_sample,
        now_ns: entry.now.0,
        body: &entry.body,
    };
    serde_json::to_vec(&message).map_err(encode_error("entry"))
}

fn is_shallow(value: &serde_json::Value, depth: usize) -> bool {
    use serde_json::Value;
    let Some(below) = depth.checked_sub(1) else {
        return false;
    };
    match value {
        Value::Array(items) => items.iter().all(|item| is_shallow(item, below)),
        Value::Object(items) => items.values().all(|item| is_shallow(item, below)),
        _ => true,
    }
}

/// Refuses a value that does not read back as the same; a non-finite number would read back as null.
pub(super) fn readable_json<T>(what: &'static str, value: &T) -> Result<Vec<u8>, LogError>
where
    T: serde::Serialize + serde::de::DeserializeOwned + PartialEq,
{
    let json = serde_json::to_vec(value).map_err(encode_error(what))?;
    let back: T = serde_json::from_slice(&json).map_err(encode_error(what))?;
    if back == *value {
        Ok(json)
    } else {
        Err(LogError::Encode { what, reason: "it would change when it is read back".into() })
    }
}
