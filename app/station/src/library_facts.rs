//! What the station must know from the library's disk, read on a thread of its own: a disk that does not answer must not make a
//! stop wait. Until it answers, what was read last counts.

use crate::tokens::Tokens;
use palpate_sessions::folder::free_bytes;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;
use tokio::sync::watch;

/// It is read again after this time, so that a removed token is of no use soon.
const EVERY: Duration = Duration::from_secs(1);

/// How long a request with a token that is not known waits for a reading.
const UNKNOWN_MAX: Duration = Duration::from_secs(2);

#[derive(Debug, Default)]
pub(crate) struct Facts {
    /// None where the file cannot be read: no one is let in.
    pub tokens: Tokens,
    pub free_bytes: Option<u64>,
    /// Which reading it was, from 1.
    number: u64,
}

impl Facts {
    fn read(library: &Path, number: u64) -> Self {
        let tokens = Tokens::read(library).unwrap_or_else(|err| {
            tracing::error!("{err}");
            Tokens::default()
        });
        Self { tokens, free_bytes: free_bytes(library).ok(), number }
    }
}

pub(crate) struct LibraryFacts {
    newest: watch::Receiver<Arc<Facts>>,
    /// Asks for a reading at once.
    wake: SyncSender<()>,
    /// Readings that were begun.
    begun: Arc<AtomicU64>,
}

impl LibraryFacts {
    /// Begins to read; the thread ends with this value.
    pub fn of(library: PathBuf) -> std::io::Result<Self> {
        let (publish, newest) = watch::channel(Arc::new(Facts::default()));
        let (wake, woken) = sync_channel(1);
        let begun = Arc::new(AtomicU64::new(0));
        let own = Arc::clone(&begun);
        let read = move || {
            loop {
                let number = own.fetch_add(1, Ordering::SeqCst) + 1;
                publish.send_replace(Arc::new(Facts::read(&library, number)));
                if woken.recv_timeout(EVERY) == Err(RecvTimeoutError::Disconnected) {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("station-library".into()).spawn(read)?;
        Ok(Self { newest, wake, begun })
    }

    /// What was read last, at most a second ago while the disk answers.
    pub fn newest(&self) -> Arc<Facts> {
        Arc::clone(&self.newest.borrow())
    }

    /// What is read from now on, or what was read last if the disk does not answer soon.
    pub async fn read_again(&self) -> Arc<Facts> {
        let before = self.begun.load(Ordering::SeqCst);
        // A full channel holds a wish already, which is served by a reading that begins later.
        let _ = self.wake.try_send(());
        let mut newest = self.newest.clone();
        let later = newest.wait_for(|facts| facts.number > before);
        match tokio::time::timeout(UNKNOWN_MAX, later).await {
            Ok(Ok(facts)) => Arc::clone(&facts),
            _ => self.newest(),
        }
    }
}
