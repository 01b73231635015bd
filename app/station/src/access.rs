//! Who is let in: checks of host and origin, limits of rates, tokens. Every request passes here first.

use crate::limits::{Rate, RateLimit};
use crate::problem::Problem;
use crate::shared::Shared;
use crate::tokens::{Scope, Tokens};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Requests of an address: a page asks for some ten when it opens.
const REQUESTS: Rate = Rate { burst: 200.0, per_second: 50.0 };

/// Wrong tokens of an address. No one guesses one anyway; this keeps the log short.
const WRONG_TOKENS: Rate = Rate { burst: 10.0, per_second: 0.2 };

/// Stops of an address that are passed on. The first is enough; the rig's queue of requests must stay free for the
/// operator's own.
const STOPS: Rate = Rate { burst: 8.0, per_second: 5.0 };

/// What stands before a token in the list of a WebSocket's subprotocols: a browser can send no other header with it.
const TOKEN_PROTOCOL: &str = "palpate-token.";

/// The address at the other end of a connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer(pub SocketAddr);

/// Whoever sent a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Caller {
    /// Name of the token, or the address of a program on this computer without one.
    pub name: String,
    pub scopes: Vec<Scope>,
    /// Whether it is known by a token, which may be removed meanwhile.
    pub is_token: bool,
}

impl Caller {
    /// For the session's log and the program's.
    pub fn words(&self, peer: Peer) -> String {
        match self.is_token {
            true => format!("'{}' at {}", self.name, peer.0.ip()),
            false => "a program on this computer".to_owned(),
        }
    }

    pub fn require(&self, scope: Scope) -> Result<(), Problem> {
        match self.scopes.contains(&scope) {
            true => Ok(()),
            false => Err(Problem::new(
                StatusCode::FORBIDDEN,
                format!("this needs a token with the scope '{scope}'; make one at the rig"),
            )),
        }
    }
}

/// What access is decided by.
pub(crate) struct Access {
    /// Whether the socket can be reached from this computer alone.
    is_local: bool,
    is_tls: bool,
    /// Names by which browsers may call the station, beside addresses and localhost.
    names: Vec<String>,
    requests: Mutex<RateLimit<IpAddr>>,
    wrong_tokens: Mutex<RateLimit<IpAddr>>,
    stops: Mutex<RateLimit<IpAddr>>,
}

fn take(limit: &Mutex<RateLimit<IpAddr>>, key: IpAddr, now: Duration) -> bool {
    limit.lock().unwrap_or_else(PoisonError::into_inner).take(key, now)
}

impl Access {
    pub fn new(is_local: bool, is_tls: bool, names: Vec<String>) -> Self {
        Self {
            is_local,
            is_tls,
            names,
            requests: Mutex::new(RateLimit::new(REQUESTS)),
            wrong_tokens: Mutex::new(RateLimit::new(WRONG_TOKENS)),
            stops: Mutex::new(RateLimit::new(STOPS)),
        }
    }

    pub fn take_stop(&self, peer: Peer, now: Duration) -> Result<(), Problem> {
        match take(&self.stops, peer.0.ip(), now) {
            true => Ok(()),
            false => Err(Problem::new(
                StatusCode::TOO_MANY_REQUESTS,
                "so many stops were passed on already; look at the rig".into(),
            )),
        }
    }

    /// Whoever sends a request without a token.
    fn caller_without_token(&self, peer: Peer, now: Duration) -> Result<Caller, Problem> {
        // A person at this computer could press the window's buttons as well. Runs need a token even so.
        if self.is_local && peer.0.ip().is_loopback() {
            return Ok(Caller {
                name: peer.0.ip().to_string(),
                scopes: vec![Scope::Watch, Scope::Stop],
                is_token: false,
            });
        }
        Err(self.unknown(peer, now, "a token is needed; make one at the rig"))
    }

    fn unknown(&self, peer: Peer, now: Duration, sentence: &str) -> Problem {
        if take(&self.wrong_tokens, peer.0.ip(), now) {
            tracing::warn!("a request from {} without a known token was refused", peer.0.ip());
            return Problem::new(StatusCode::UNAUTHORIZED, sentence.to_owned());
        }
        Problem::new(
            StatusCode::TOO_MANY_REQUESTS,
            "too many wrong tokens came from this address; wait a minute".into(),
        )
    }

    /// A page of another site may send a browser here: its requests name that site, or a host that is not ours.
    fn check_site(&self, headers: &HeaderMap) -> Result<(), Problem> {
        let refuse = |sentence: String| Err(Problem::new(StatusCode::FORBIDDEN, sentence));
        let mut hosts = headers.get_all(header::HOST).iter();
        let (Some(host), None) = (hosts.next().and_then(|one| one.to_str().ok()), hosts.next())
        else {
            return refuse("the request names no host; send one Host header".into());
        };
        if !self.is_own_host(host) {
            return refuse(format!(
                "the station is not called '{}'; use its address, or start it with this name",
                short(host)
            ));
        }
        let mut origins = headers.get_all(header::ORIGIN).iter();
        let Some(origin) = origins.next() else { return Ok(()) };
        let scheme = if self.is_tls { "https" } else { "http" };
        let is_own =
            |origin: &HeaderValue| origin.as_bytes() == format!("{scheme}://{host}").as_bytes();
        match is_own(origin) && origins.next().is_none() {
            true => Ok(()),
            false => refuse(
                "the request comes from a page of another site; open the station's own page".into(),
            ),
        }
    }

    /// Names that other sites choose resolve to any address, so only addresses and names given at the rig count.
    fn is_own_host(&self, host: &str) -> bool {
        if host.parse::<SocketAddr>().is_ok() || host.parse::<IpAddr>().is_ok() {
            return true;
        }
        let is_bare_v6 = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        if is_bare_v6.is_some_and(|inner| inner.parse::<IpAddr>().is_ok()) {
            return true;
        }
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "0"));
        let is_port = port.parse::<u16>().is_ok();
        let own = self.names.iter().map(String::as_str).chain(["localhost"]);
        is_port && own.into_iter().any(|one| one.eq_ignore_ascii_case(name))
    }
}

/// The beginning of what a stranger sent, without what would confuse a log.
fn short(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(60).collect()
}

/// The token of a request: a header, or for a WebSocket one of its subprotocols.
fn secret(headers: &HeaderMap) -> Option<&str> {
    if let Some(value) = headers.get(header::AUTHORIZATION) {
        let text = value.to_str().unwrap_or_default();
        return Some(text.strip_prefix("Bearer ").unwrap_or_default().trim());
    }
    let protocols = headers.get(header::SEC_WEBSOCKET_PROTOCOL)?.to_str().ok()?;
    protocols.split(',').find_map(|one| one.trim().strip_prefix(TOKEN_PROTOCOL))
}

async fn caller(shared: &Shared, headers: &HeaderMap, peer: Peer) -> Result<Caller, Problem> {
    let Some(secret) = secret(headers) else {
        return shared.access.caller_without_token(peer, shared.now());
    };
    let known = |tokens: &Tokens| {
        tokens.find(secret).map(|token| Caller {
            name: token.name.clone(),
            scopes: token.scopes.clone(),
            is_token: true,
        })
    };
    if let Some(caller) = known(&shared.library_facts.newest().tokens) {
        return Ok(caller);
    }
    // It may have been made a moment ago.
    known(&shared.library_facts.read_again().await.tokens).ok_or_else(|| {
        let sentence = "this token is not known; make a new one at the rig";
        shared.access.unknown(peer, shared.now(), sentence)
    })
}

/// Checks a request to the API, and adds its caller.
pub(crate) async fn check_caller(
    State(shared): State<Arc<Shared>>,
    mut request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let peer = peer(&request)?;
    let caller = caller(&shared, request.headers(), peer).await?;
    request.extensions_mut().insert(caller);
    Ok(next.run(request).await)
}

fn peer(request: &Request) -> Result<Peer, Problem> {
    let peer = request.extensions().get::<Peer>().copied();
    peer.ok_or_else(|| {
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the connection has no address".into())
    })
}

/// Checks every request: site, rate and time; adds the headers that keep a browser from mischief.
pub(crate) async fn check_request(
    State(shared): State<Arc<Shared>>,
    request: Request,
    next: Next,
) -> Response {
    use axum::response::IntoResponse;
    let mut response = match admit(&shared, request, next).await {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (
            header::CONTENT_SECURITY_POLICY,
            "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
        ),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Longest time for an answer: a question that waits for a run's end waits less.
const ANSWER_MAX: Duration = Duration::from_secs(40);

async fn admit(shared: &Shared, request: Request, next: Next) -> Result<Response, Problem> {
    let peer = peer(&request)?;
    shared.access.check_site(request.headers())?;
    // A stop has its own limit, which requests of other kinds do not use up.
    let is_stop = request.uri().path() == crate::routes::STOP;
    if !is_stop && !take(&shared.access.requests, peer.0.ip(), shared.now()) {
        return Err(Problem::new(
            StatusCode::TOO_MANY_REQUESTS,
            "this address asks too often; wait a second".into(),
        ));
    }
    tokio::time::timeout(ANSWER_MAX, next.run(request)).await.map_err(|_| {
        Problem::new(StatusCode::REQUEST_TIMEOUT, "the request took too long; try again".into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(names: &[&str]) -> Access {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        Access::new(true, false, names)
    }

    fn headers(pairs: &[(header::HeaderName, &str)]) -> HeaderMap {
        pairs
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_str(value).unwrap()))
            .collect()
    }

    #[test]
    fn only_own_hosts_are_answered() {
        let access = access(&["rig.lab.example"]);
        for host in [
            "127.0.0.1:7480",
            "localhost:7480",
            "LOCALHOST",
            "[::1]:7480",
            "[::1]",
            "192.168.1.7:7480",
            "rig.lab.example:7480",
        ] {
            assert!(access.check_site(&headers(&[(header::HOST, host)])).is_ok(), "{host}");
        }
        // A name that a stranger's server resolves to this address.
        for host in [
            "evil.example",
            "localhost.evil.example:7480",
            "rig.lab.example.evil:7480",
            "",
            "localhost:",
            "localhost:x",
            "127.0.0.1.evil.example",
        ] {
            assert!(access.check_site(&headers(&[(header::HOST, host)])).is_err(), "{host}");
        }
        assert!(access.check_site(&HeaderMap::new()).is_err());
    }

    #[test]
    fn only_own_pages_may_ask() {
        let access = access(&[]);
        let host = (header::HOST, "localhost:7480");
        let with = |origin| access.check_site(&headers(&[host.clone(), (header::ORIGIN, origin)]));
        assert!(with("http://localhost:7480").is_ok());
        for origin in [
            "null",
            "https://localhost:7480",
            "http://localhost:7481",
            "http://localhost",
            "http://evil.example",
            "http://localhost:7480.evil.example",
        ] {
            assert!(with(origin).is_err(), "{origin}");
        }
    }

    #[test]
    fn a_token_comes_in_a_header_or_as_a_subprotocol() {
        let of = |name, value| secret(&headers(&[(name, value)])).map(str::to_owned);
        assert_eq!(of(header::AUTHORIZATION, "Bearer abc").as_deref(), Some("abc"));
        // A header that is wrong is a wrong token, not none.
        assert_eq!(of(header::AUTHORIZATION, "Basic abc").as_deref(), Some(""));
        let listed = "palpate.v1, palpate-token.abc";
        assert_eq!(of(header::SEC_WEBSOCKET_PROTOCOL, listed).as_deref(), Some("abc"));
        assert_eq!(of(header::SEC_WEBSOCKET_PROTOCOL, "palpate.v1"), None);
        assert_eq!(secret(&HeaderMap::new()), None);
    }
}
