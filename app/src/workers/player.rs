//! A recorded session on a thread of its own: asked for a moment, it shows the run as it was then.

use palpate_model::Nanos;
use palpate_protocols::replay::Player;
use palpate_protocols::runner::Snapshot;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Samples between two pictures on a long way: some tens of milliseconds of work.
const BATCH: usize = 20_000;

/// The thread's near end.
pub struct PlayerThread {
    wanted: Sender<Nanos>,
    shown: Arc<Mutex<Arc<Snapshot>>>,
}

impl PlayerThread {
    /// Starts it at the beginning of the session. `wake` is called with every new picture.
    pub fn start(mut player: Player, wake: impl Fn() + Send + 'static) -> Result<Self, String> {
        let Some(first) = player.snapshot(0) else {
            return Err("the session has no beginning".into());
        };
        let shown = Arc::new(Mutex::new(Arc::new(first)));
        let (wanted, asked) = channel();
        let own = Arc::clone(&shown);
        std::thread::Builder::new()
            .name("player".into())
            .spawn(move || play(&mut player, &asked, &own, &wake))
            .map_err(|err| format!("the player's thread cannot be started: {err}"))?;
        Ok(Self { wanted, shown })
    }

    /// Asks for the run as it was at this session time. Never waits; a newer wish takes the place of an older.
    pub fn go_to(&self, time: Nanos) {
        // The thread lives as long as this end of it.
        let _ = self.wanted.send(time);
    }

    /// The newest picture.
    #[must_use]
    pub fn snapshot(&self) -> Arc<Snapshot> {
        let shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(&shown)
    }
}

fn play(
    player: &mut Player,
    asked: &Receiver<Nanos>,
    shown: &Mutex<Arc<Snapshot>>,
    wake: &impl Fn(),
) {
    let mut sequence = 0;
    while let Ok(mut time) = asked.recv() {
        let mut is_there = false;
        while !is_there {
            time = asked.try_iter().last().unwrap_or(time);
            is_there = player.go_to(time, BATCH);
            sequence += 1;
            if let Some(snapshot) = player.snapshot(sequence) {
                *shown.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(snapshot);
            }
            wake();
        }
    }
}
