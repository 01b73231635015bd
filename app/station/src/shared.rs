//! What all connections share.

use crate::access::{Access, Caller};
use crate::library_facts::LibraryFacts;
use crate::live::Published;
use crate::remote::{RemoteBench, RemoteDesk};
use crate::tokens::{Scope, StoredToken};
use palpate_analysis::station_settings::StationSettings;
use palpate_runner::{RunnerHandle, Stopwatch};
use std::path::PathBuf;
use std::sync::atomic::AtomicUsize;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{Semaphore, watch};

pub(crate) struct Shared {
    pub runner: RunnerHandle,
    pub access: Access,
    pub desk: Arc<Mutex<RemoteDesk>>,
    /// What runs over the network are made with; without it none is asked for.
    pub bench: Arc<Mutex<Option<RemoteBench>>>,
    pub library: PathBuf,
    pub library_facts: LibraryFacts,
    /// Since the station was started.
    watch: Stopwatch,
    pub watchers: AtomicUsize,
    /// The newest live messages.
    pub live: watch::Sender<Arc<Published>>,
    /// Searches of the library: one at a time, and a few that wait.
    pub searches: Semaphore,
    pub searches_waiting: Semaphore,
}

/// Searches that may wait for the one in progress.
const SEARCHES_WAITING: usize = 8;

impl Shared {
    pub fn new(
        settings: &StationSettings,
        runner: RunnerHandle,
        desk: Arc<Mutex<RemoteDesk>>,
        bench: Arc<Mutex<Option<RemoteBench>>>,
    ) -> std::io::Result<Self> {
        let is_local = settings.address.ip().is_loopback();
        let access = Access::new(is_local, settings.tls.is_some(), settings.names.clone());
        let (live, _) = watch::channel(Arc::new(Published::of(&runner.snapshot(), true, None)));
        Ok(Self {
            runner,
            access,
            desk,
            bench,
            library: settings.library.clone(),
            library_facts: LibraryFacts::of(settings.library.clone())?,
            watch: Stopwatch::start(),
            watchers: AtomicUsize::new(0),
            live,
            searches: Semaphore::new(1),
            searches_waiting: Semaphore::new(SEARCHES_WAITING),
        })
    }

    /// Whether a caller may still do something: a token may have been removed.
    pub fn is_still_allowed(&self, caller: &Caller, scope: Scope) -> bool {
        let is_there =
            |token: &StoredToken| token.name == caller.name && token.scopes.contains(&scope);
        !caller.is_token || self.library_facts.newest().tokens.all().iter().any(is_there)
    }

    /// Time since the station was started.
    pub fn now(&self) -> Duration {
        Duration::from_secs_f64(self.watch.seconds())
    }
}
