//! What can go wrong with a store.

use palpate_sessions::catalog::CatalogError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum StoreError {
    #[error("{url} is not the address of a store; give s3://BUCKET/FOLDER or file:///FOLDER")]
    Address { url: String },
    #[error("{url} cannot be opened: {source}")]
    Open { url: String, source: object_store::Error },
    #[error("there is no table of sessions at {url}; check the address, or push a session")]
    NoTable { url: String },
    #[error(
        "the store cannot be read or written at {path} ({source}); check the address, the network and the credentials"
    )]
    Object { path: String, source: object_store::Error },
    #[error(
        "the store {url} lets two writers have one name, so that rigs would overwrite each other; use a store that keeps to If-None-Match"
    )]
    Unconditional { url: String },
    #[error("{path} in the store is not what palpate wrote: {reason}")]
    Bad { path: String, reason: String },
    #[error("the store is of version {version}, which a newer palpate made; update palpate")]
    Newer { version: String },
    #[error("the store's table needs {what}, which palpate does not know; update palpate")]
    Unknown { what: String },
    #[error("{} cannot be read or written ({source}); check the path and the disk", path.display())]
    File { path: PathBuf, source: io::Error },
    #[error("the system refuses what requests need ({0}); end other programs")]
    Runtime(io::Error),
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(
        "{} has another {file} than the store; move it away, or give another folder", folder.display()
    )]
    Different { folder: PathBuf, file: String },
    #[error("no session {id} is in the store")]
    NoSession { id: String },
    #[error("other writers were faster {tries} times in a row; try later")]
    Crowded { tries: usize },
    #[error("ended on request; what is stored stays, and the same command goes on from there")]
    Ended,
}

impl StoreError {
    pub(crate) fn object(
        path: &object_store::path::Path,
    ) -> impl Fn(object_store::Error) -> Self + use<> {
        let path = path.to_string();
        move |source| Self::Object { path: path.clone(), source }
    }

    pub(crate) fn file(path: &std::path::Path) -> impl Fn(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::File { path: path.clone(), source }
    }

    pub(crate) fn bad(path: &object_store::path::Path, reason: impl ToString) -> Self {
        Self::Bad { path: path.to_string(), reason: reason.to_string() }
    }
}
