//! The locked protocols of a library, in `locked-protocols/`: a protocol's text with the values of its parameters, which
//! whoever runs it cannot change.

use crate::document_store::{self, Document};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the document. A reader refuses a higher one.
pub const LOCKED_PROTOCOL_FORMAT: u32 = 1;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LockedProtocol {
    pub format: u32,
    /// Under which it is run.
    pub name: String,
    /// RFC 3339.
    pub locked_at: String,
    pub by: String,
    /// The protocol's file as it was. A session records its CRC-32 and the values in `plan.source`.
    pub text: String,
    /// Of every parameter that does not have its usual value.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub values: BTreeMap<String, String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supersedes: Option<String>,
}

pub type StoredLockedProtocol = document_store::StoredDocument<LockedProtocol>;

pub type LockedProtocolStore = document_store::DocumentStore<LockedProtocol>;

impl Document for LockedProtocol {
    const KIND: &'static str = "locked protocol";
    const FOLDER: &'static str = "locked-protocols";
    const RENEW: &'static str = "lock it again";

    fn name(&self) -> &str {
        &self.name
    }

    /// It belongs to no rig.
    fn rig(&self) -> &str {
        ""
    }

    fn taken_at(&self) -> Option<&str> {
        Some(&self.locked_at)
    }

    fn supersedes(&self) -> Option<&str> {
        self.supersedes.as_deref()
    }

    fn superseding(self, id: String) -> Self {
        Self { supersedes: Some(id), ..self }
    }

    fn check(&self) -> Result<(), String> {
        if self.format > LOCKED_PROTOCOL_FORMAT {
            return Err("a later palpate locked it; update palpate to run it".into());
        }
        match self.name.trim().is_empty() || self.text.trim().is_empty() {
            true => Err("it has no name or no text".into()),
            false => Ok(()),
        }
    }
}
