//! Messages of a log that are JSON, refused where they would not be read back as they were.

use super::error::{LogError, json_error};
use crate::record::{Entry, EntryMessage};

/// Deepest nesting of an entry; the JSON parser that reads it back stops at 128.
const JSON_DEPTH_MAX: usize = 100;

/// An entry's message.
pub(super) fn entry_json(entry: &Entry) -> Result<Vec<u8>, LogError> {
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
    serde_json::to_vec(&message).map_err(json_error("entry"))
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

/// JSON that reads back as the same value; a number that is not finite would come back as null.
pub(super) fn readable_json<T>(what: &'static str, value: &T) -> Result<Vec<u8>, LogError>
where
    T: serde::Serialize + serde::de::DeserializeOwned + PartialEq,
{
    let json = serde_json::to_vec(value).map_err(json_error(what))?;
    let back: T = serde_json::from_slice(&json).map_err(json_error(what))?;
    if back == *value {
        Ok(json)
    } else {
        Err(LogError::Encode { what, reason: "it does not read back as it was written".into() })
    }
}
