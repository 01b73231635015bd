//! A recorded session on a thread of its own: asked for a moment, it shows the run as it was then.

use palpate_model::Nanos;
use palpate_runner::RunnerSnapshot;
use palpate_runner::replay::Player;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Samples between two pictures on a long way: some tens of milliseconds of work.
const BATCH: usize = 20_000;

/// The thread's near end.
pub struct PlayerThread {
    desk: Arc<Desk>,
    /// Says that something new is wanted; one word says it as well as many.
    bell: SyncSender<()>,
}

/// What both ends see.
struct Desk {
    wanted: Mutex<Option<Nanos>>,
    shown: Mutex<Arc<RunnerSnapshot>>,
}

fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PlayerThread {
    /// Starts it at the beginning of the session. `wake` is called with every new picture.
    pub fn start(mut player: Player, wake: impl Fn() + Send + 'static) -> Result<Self, String> {
        let Some(first) = player.snapshot(0) else {
            return Err("the beginning of the session is missing".into());
        };
        let desk = Arc::new(Desk { wanted: Mutex::new(None), shown: Mutex::new(Arc::new(first)) });
        let (bell, rung) = sync_channel(1);
        let own = Arc::clone(&desk);
        std::thread::Builder::new()
            .name("player".into())
            .spawn(move || play(&mut player, &rung, &own, &wake))
            .map_err(|err| format!("the replay cannot be started ({err}); close other programs"))?;
        Ok(Self { desk, bell })
    }

    /// Asks for the run as it was at this session time. Never waits; a newer wish takes the place of an older.
    pub fn go_to(&self, time: Nanos) {
        *locked(&self.desk.wanted) = Some(time);
        // A bell that still rings will do.
        let _ = self.bell.try_send(());
    }

    /// The newest picture.
    pub fn snapshot(&self) -> Arc<RunnerSnapshot> {
        Arc::clone(&locked(&self.desk.shown))
    }
}

fn play(player: &mut Player, rung: &Receiver<()>, desk: &Desk, wake: &impl Fn()) {
    let (mut sequence, mut time) = (0, Nanos::ZERO);
    while rung.recv().is_ok() {
        let mut is_there = false;
        while !is_there {
            time = locked(&desk.wanted).take().unwrap_or(time);
            is_there = player.go_to(time, BATCH);
            sequence += 1;
            if let Some(snapshot) = player.snapshot(sequence) {
                *locked(&desk.shown) = Arc::new(snapshot);
            }
            wake();
        }
    }
}
