//! Live values over a WebSocket. Every watcher gets the newest message once it has taken the one before, so that a slow one
//! sees fewer and none makes another wait; nothing is queued.

use crate::access::{Caller, Peer};
use crate::problem::Problem;
use crate::remote::ArmedState;
use crate::shared::Shared;
use crate::tokens::Scope;
use crate::view::{RunPictures, StationState};
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::extract::{Extension, Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use palpate_runner::RunnerSnapshot;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Name of the subprotocol.
const PROTOCOL: &str = "palpate.v1";

/// Watchers at a time.
const WATCHERS_MAX: usize = 64;

/// Messages a second, for a watcher that asks for the most.
pub(crate) const PER_SECOND_MAX: u32 = 10;
const PER_SECOND_USUAL: u32 = 5;

/// A watcher that takes so long for one message has gone.
const SEND_MAX: Duration = Duration::from_secs(10);

/// Watchers only listen: longest message from one, pings included.
const RECEIVED_MAX: usize = 1024;

/// Messages that a watcher may send a second.
const RECEIVED_PER_SECOND: u32 = 20;

/// The same moment twice: with the curve and the events, and without.
pub(crate) struct Published {
    whole: Utf8Bytes,
    short: Utf8Bytes,
    /// Changes when curve or events do.
    content: (u64, usize, bool),
    sequence: u64,
    is_alive: bool,
}

#[derive(Serialize)]
struct LiveMessage<'a> {
    #[serde(flatten)]
    state: &'a StationState,
    armed: Option<&'a ArmedState>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pictures: Option<RunPictures>,
}

impl Published {
    pub fn of(snapshot: &RunnerSnapshot, is_alive: bool, armed: Option<&ArmedState>) -> Self {
        let state = StationState::of(snapshot, is_alive);
        let text = |pictures| {
            let message = LiveMessage { state: &state, armed, pictures };
            Utf8Bytes::from(serde_json::to_string(&message).unwrap_or_else(|_| "{}".into()))
        };
        Self {
            whole: text(Some(RunPictures::of(snapshot))),
            short: text(None),
            content: Self::content(snapshot),
            sequence: snapshot.sequence,
            is_alive,
        }
    }

    fn is_of(&self, snapshot: &RunnerSnapshot, is_alive: bool) -> bool {
        self.sequence == snapshot.sequence && self.is_alive == is_alive
    }

    fn content(snapshot: &RunnerSnapshot) -> (u64, usize, bool) {
        snapshot
            .run
            .as_ref()
            .map_or((0, 0, false), |run| (run.samples, run.events.len(), run.outcome.is_some()))
    }
}

/// Makes the messages of a moment once for all watchers, while there are any.
pub(crate) async fn publish(shared: Arc<Shared>) {
    let mut every = tokio::time::interval(Duration::from_secs(1) / PER_SECOND_MAX);
    every.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        every.tick().await;
        if shared.live.receiver_count() == 0 {
            continue;
        }
        let (snapshot, is_alive) = (shared.runner.snapshot(), shared.runner.is_alive());
        if shared.live.borrow().is_of(&snapshot, is_alive) {
            continue;
        }
        let armed = crate::remote::lock(&shared.desk).armed();
        shared.live.send_replace(Arc::new(Published::of(&snapshot, is_alive, armed.as_ref())));
    }
}

#[derive(Debug, Deserialize)]
pub(crate) struct LiveQuery {
    per_second: Option<u32>,
}

/// Counts a watcher for as long as it lives.
struct WatcherPlace(Arc<Shared>);

impl WatcherPlace {
    fn take(shared: &Arc<Shared>) -> Result<Self, Problem> {
        let taken = shared.watchers.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
            (count < WATCHERS_MAX).then_some(count + 1)
        });
        match taken {
            Ok(_) => Ok(Self(Arc::clone(shared))),
            Err(_) => Err(Problem::new(
                StatusCode::SERVICE_UNAVAILABLE,
                format!("{WATCHERS_MAX} watchers are connected already; close another page"),
            )),
        }
    }
}

impl Drop for WatcherPlace {
    fn drop(&mut self) {
        self.0.watchers.fetch_sub(1, Ordering::Relaxed);
    }
}

pub(crate) async fn live(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    Extension(peer): Extension<Peer>,
    Query(query): Query<LiveQuery>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Problem> {
    caller.require(Scope::Watch)?;
    let per_second = query.per_second.unwrap_or(PER_SECOND_USUAL);
    if !(1..=PER_SECOND_MAX).contains(&per_second) {
        return Err(Problem::wrong(format!("per_second is from 1 to {PER_SECOND_MAX}")));
    }
    let upgrade = upgrade.map_err(|err| Problem::wrong(err.body_text()))?;
    let place = WatcherPlace::take(&shared)?;
    let upgrade = upgrade
        .protocols([PROTOCOL])
        .read_buffer_size(4096)
        .write_buffer_size(0)
        .max_write_buffer_size(256 * 1024)
        .max_message_size(RECEIVED_MAX)
        .max_frame_size(RECEIVED_MAX);
    Ok(upgrade.on_upgrade(move |socket| async move {
        tracing::debug!("{} watches", caller.words(peer));
        watch(&shared, &caller, socket, Duration::from_secs(1) / per_second).await;
        drop(place);
    }))
}

async fn watch(shared: &Shared, caller: &Caller, mut socket: WebSocket, every: Duration) {
    let mut newest = shared.live.subscribe();
    // What was published before may be old; it counts only where nothing newer will come.
    if shared.live.borrow().is_of(&shared.runner.snapshot(), shared.runner.is_alive()) {
        newest.mark_changed();
    }
    let mut shown = None;
    let (mut received, mut second) = (0, shared.now());
    loop {
        tokio::select! {
            changed = newest.changed() => {
                let published = Arc::clone(&newest.borrow_and_update());
                let is_allowed = shared.is_still_allowed(caller, Scope::Watch);
                if changed.is_err() || !is_allowed {
                    break;
                }
                let is_whole = shown != Some(published.content);
                shown = Some(published.content);
                let text = if is_whole { published.whole.clone() } else { published.short.clone() };
                drop(published);
                let sent = tokio::time::timeout(SEND_MAX, socket.send(Message::Text(text))).await;
                if !matches!(sent, Ok(Ok(()))) {
                    return;
                }
                tokio::time::sleep(every).await;
            }
            message = socket.recv() => {
                // A watcher has nothing to say; pings are answered by the library.
                if !matches!(message, Some(Ok(Message::Ping(_) | Message::Pong(_) | Message::Text(_)))) {
                    break;
                }
                if shared.now() >= second + Duration::from_secs(1) {
                    (received, second) = (0, shared.now());
                }
                received += 1;
                if received > RECEIVED_PER_SECOND {
                    break;
                }
            }
        }
    }
    let _ = tokio::time::timeout(Duration::from_secs(1), socket.send(Message::Close(None))).await;
}
