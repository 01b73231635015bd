//! The routes: read, stop, ask for runs of an armed queue, and the page.

use crate::access::{Caller, Peer, check_caller, check_request};
use crate::live::live;
use crate::problem::Problem;
use crate::remote::{RemoteRefusal, RemoteRequest, RemoteRunState, lock};
use crate::shared::Shared;
use crate::tokens::Scope;
use crate::view::{API_VERSION, Curve, StationState, events};
use axum::extract::rejection::{JsonRejection, PathRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, Extension, Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::{get, post};
use axum::{Json, Router, middleware};
use palpate_analysis::catalog_search::{CatalogSearch, search, update};
use palpate_analysis::progress::NoProgress;
use palpate_runner::{RunView, RunnerRequest, wall_now};
use palpate_sessions::catalog::{CatalogEntry, CatalogQuery};
use palpate_sessions::specimen_queue::SpecimenQueue;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

pub(crate) const STOP: &str = "/api/v1/stop";

/// Longest request: values of a run with a remark.
const REQUEST_BYTES_MAX: usize = 16 * 1024;

/// Sessions in one answer.
const SESSIONS_MAX: usize = 200;
const SESSIONS_USUAL: usize = 20;

/// Longest wait for the end of a run, shorter than what a proxy between us cuts off.
const WAIT_MAX_S: f64 = 25.0;

/// How often a question that waits is looked at.
const WAIT_STEP: Duration = Duration::from_millis(100);

/// What a stop over a network cannot promise.
const BEST_EFFORT: &str =
    "a stop over a network is best effort; the emergency stop at the rig is the one to rely on";

type Answer = Result<Json<Value>, Problem>;
type ReadQuery<T> = Result<Query<T>, QueryRejection>;

pub(crate) fn router(shared: Arc<Shared>) -> Router {
    let api = Router::new()
        .route("/api/v1/state", get(state))
        .route("/api/v1/curve", get(curve))
        .route("/api/v1/events", get(event_lines))
        .route("/api/v1/live", get(live))
        .route("/api/v1/sessions", get(sessions))
        .route("/api/v1/queue", get(queue))
        .route("/api/v1/remote", get(remote))
        .route("/api/v1/remote/runs", post(ask_run))
        .route("/api/v1/remote/runs/{id}", get(remote_run).delete(withdraw_run))
        .route(STOP, post(stop))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), check_caller));
    Router::new()
        .route("/", get(page))
        .route("/station.js", get(script))
        .route("/station.css", get(style))
        .route("/icon.svg", get(icon))
        .route("/api/v1/health", get(health))
        .route("/api/v1/openapi.json", get(openapi))
        .merge(api)
        .fallback(unknown)
        .method_not_allowed_fallback(wrong_method)
        .layer(DefaultBodyLimit::max(REQUEST_BYTES_MAX))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), check_request))
        .with_state(shared)
}

async fn unknown() -> Problem {
    Problem::missing("there is nothing at this address; /api/v1/openapi.json lists what there is")
}

async fn wrong_method() -> Problem {
    Problem::new(
        StatusCode::METHOD_NOT_ALLOWED,
        "this address does not take that method; /api/v1/openapi.json lists the methods".into(),
    )
}

fn file(kind: &'static str, text: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind)], text)
}

async fn page() -> impl IntoResponse {
    file("text/html; charset=utf-8", include_str!("page/index.html"))
}

async fn script() -> impl IntoResponse {
    file("text/javascript; charset=utf-8", include_str!("page/station.js"))
}

async fn style() -> impl IntoResponse {
    file("text/css; charset=utf-8", include_str!("page/station.css"))
}

async fn icon() -> impl IntoResponse {
    file("image/svg+xml", include_str!("../../window/icon.svg"))
}

async fn openapi() -> impl IntoResponse {
    file("application/json", include_str!("openapi.json"))
}

/// Whether the station serves and the rig's thread lives: for a monitor that has no token.
async fn health(State(shared): State<Arc<Shared>>) -> Result<impl IntoResponse, Problem> {
    let is_alive = shared.runner.is_alive();
    let status = if is_alive { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    let object = json!({
        "format": API_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "is_runner_alive": is_alive,
        "uptime_s": shared.now().as_secs(),
        "watchers": shared.watchers.load(Ordering::Relaxed),
        "free_bytes": shared.library_facts.newest().free_bytes,
    });
    Ok((status, Json(object)))
}

fn object(value: &impl serde::Serialize) -> Answer {
    serde_json::to_value(value).map(Json).map_err(Problem::unavailable)
}

async fn state(State(shared): State<Arc<Shared>>, Extension(caller): Extension<Caller>) -> Answer {
    caller.require(Scope::Watch)?;
    object(&StationState::of(&shared.runner.snapshot(), shared.runner.is_alive()))
}

async fn curve(State(shared): State<Arc<Shared>>, Extension(caller): Extension<Caller>) -> Answer {
    caller.require(Scope::Watch)?;
    let snapshot = shared.runner.snapshot();
    object(&snapshot.run.as_ref().map_or_else(Curve::default, |run| Curve::of(&run.trace)))
}

#[derive(Debug, Deserialize)]
struct EventsQuery {
    limit: Option<usize>,
}

async fn event_lines(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    query: ReadQuery<EventsQuery>,
) -> Answer {
    caller.require(Scope::Watch)?;
    let limit = read_query(query)?.limit.unwrap_or(RunView::EVENTS_MAX).min(RunView::EVENTS_MAX);
    object(&json!({ "events": events(&shared.runner.snapshot(), limit) }))
}

fn read_query<T>(query: ReadQuery<T>) -> Result<T, Problem> {
    query.map(|Query(query)| query).map_err(|err| Problem::wrong(err.body_text()))
}

#[derive(Debug, Deserialize)]
struct SessionsQuery {
    limit: Option<usize>,
    #[serde(default)]
    skip: usize,
}

/// A session as the list shows it: no names of people but the operator's own words for the specimen.
fn listed(entry: &CatalogEntry) -> Value {
    json!({
        "session_id": entry.session_id,
        "folder": entry.folder,
        "started_at": entry.started_at,
        "specimen": entry.specimen,
        "protocol": entry.protocol,
        "rig": entry.rig,
        "duration_s": entry.duration_s,
        "samples": entry.samples,
        "ending": entry.ending,
        "reason": entry.reason,
        "verdict": entry.verdict,
    })
}

async fn sessions(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    query: ReadQuery<SessionsQuery>,
) -> Answer {
    caller.require(Scope::Watch)?;
    let query = read_query(query)?;
    let limit = query.limit.unwrap_or(SESSIONS_USUAL);
    if !(1..=SESSIONS_MAX).contains(&limit) {
        return Err(Problem::wrong(format!("limit is from 1 to {SESSIONS_MAX}")));
    }
    let library = shared.library.clone();
    let found = in_turn(&shared, move || {
        update(&library, &NoProgress)?;
        let wanted =
            CatalogQuery { skip: query.skip, limit: Some(limit), ..CatalogQuery::default() };
        search(&CatalogSearch { library, query: wanted, page: limit })
    });
    let found = found.await?;
    let list: Vec<Value> = found.first.iter().map(listed).collect();
    object(&json!({ "sessions": list, "remarks": found.remarks }))
}

async fn queue(State(shared): State<Arc<Shared>>, Extension(caller): Extension<Caller>) -> Answer {
    caller.require(Scope::Watch)?;
    let library = shared.library.clone();
    let queue =
        in_turn(&shared, move || SpecimenQueue::read(&library).map_err(|err| err.to_string()));
    let queue = queue.await?;
    let items: Vec<Value> = queue
        .items
        .iter()
        .map(|item| {
            json!({
                "number": item.number,
                "specimen": item.wanted.specimen,
                "protocol": item.wanted.protocol,
                "state": item.state.to_string(),
            })
        })
        .collect();
    object(&json!({ "name": queue.name, "specimens": items }))
}

/// Work that reads the disk, one at a time; with too much of it waiting it is refused.
async fn in_turn<T: Send + 'static>(
    shared: &Shared,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, Problem> {
    let busy = || Problem::unavailable("the library is being searched; try again in some seconds");
    let _waiting = shared.searches_waiting.try_acquire().map_err(|_| busy())?;
    let _turn = shared.searches.acquire().await.map_err(|_| busy())?;
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|_| busy())?.map_err(Problem::unavailable)
}

/// Stops the rig. The stop is passed on before anything else is done.
async fn stop(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    Extension(peer): Extension<Peer>,
) -> Answer {
    caller.require(Scope::Stop)?;
    shared.access.take_stop(peer, shared.now())?;
    let words = format!("stop over the network by {}", caller.words(peer));
    let passed = shared.runner.request(RunnerRequest::RemoteStop(words.clone()));
    tracing::warn!("{words}");
    let must_repeat = lock(&shared.desk).disarm_for_stop(&words);
    let passed = match must_repeat {
        true => shared.runner.request(RunnerRequest::RemoteStop(words)),
        false => passed,
    };
    passed.map_err(Problem::unavailable)?;
    object(&json!({ "is_passed_on": true, "remark": BEST_EFFORT }))
}

async fn remote(State(shared): State<Arc<Shared>>, Extension(caller): Extension<Caller>) -> Answer {
    caller.require(Scope::Watch)?;
    object(&lock(&shared.desk).state(50))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RunRequestBody {
    queue: String,
    #[serde(default)]
    values: BTreeMap<String, String>,
    #[serde(default)]
    remark: String,
}

fn refused(refusal: RemoteRefusal) -> Problem {
    match refusal {
        RemoteRefusal::Values(_) | RemoteRefusal::Time => Problem::wrong(refusal),
        RemoteRefusal::Unknown(_) => Problem::missing(refusal),
        RemoteRefusal::Full => Problem::new(StatusCode::TOO_MANY_REQUESTS, refusal.to_string()),
        _ => Problem::conflict(refusal),
    }
}

async fn ask_run(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    body: Result<Json<RunRequestBody>, JsonRejection>,
) -> Result<impl IntoResponse, Problem> {
    caller.require(Scope::Run)?;
    let Json(body) = body.map_err(|err| Problem::new(err.status(), err.body_text()))?;
    let request = RemoteRequest { queue: body.queue, values: body.values, remark: body.remark };
    let bench = shared.bench.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let bench = bench.ok_or_else(|| {
        Problem::conflict(
            "this station starts nothing; serve the rig from a window or with 'palpate serve'",
        )
    })?;
    let snapshot = shared.runner.snapshot();
    let mut desk = lock(&shared.desk);
    let run = desk
        .ask(request, &caller.name, wall_now(), |plan| bench.check(plan, &snapshot.rig))
        .map_err(refused)?;
    Ok((StatusCode::CREATED, object(run)?))
}

#[derive(Debug, Deserialize)]
struct WaitQuery {
    /// Waits until the run is over and fitted, at most so long.
    wait_s: Option<f64>,
}

fn number(id: Result<Path<u64>, PathRejection>) -> Result<u64, Problem> {
    id.map(|Path(id)| id).map_err(|err| Problem::wrong(err.body_text()))
}

async fn remote_run(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    id: Result<Path<u64>, PathRejection>,
    query: ReadQuery<WaitQuery>,
) -> Answer {
    caller.require(Scope::Watch)?;
    let id = number(id)?;
    let wait = read_query(query)?.wait_s.unwrap_or(0.0);
    if !(0.0..=WAIT_MAX_S).contains(&wait) {
        return Err(Problem::wrong(format!("wait_s is from 0 to {WAIT_MAX_S}")));
    }
    let until = shared.now() + Duration::from_secs_f64(wait);
    loop {
        {
            let desk = lock(&shared.desk);
            let run = desk.run(id).map_err(refused)?;
            let is_over = match run.state {
                RemoteRunState::Waiting | RemoteRunState::Running => false,
                RemoteRunState::Ended => run.fit.is_some(),
                RemoteRunState::Refused | RemoteRunState::Withdrawn => true,
            };
            if is_over || shared.now() >= until {
                return object(run);
            }
        }
        tokio::time::sleep(WAIT_STEP).await;
    }
}

async fn withdraw_run(
    State(shared): State<Arc<Shared>>,
    Extension(caller): Extension<Caller>,
    id: Result<Path<u64>, PathRejection>,
) -> Answer {
    caller.require(Scope::Run)?;
    let id = number(id)?;
    let mut desk = lock(&shared.desk);
    desk.withdraw(id, &caller.name).map_err(refused)?;
    object(desk.run(id).map_err(refused)?)
}
