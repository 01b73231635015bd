//! The station's thread: it listens, bounds connections and serves them. It never touches the rig itself.

use crate::access::Peer;
use crate::live::publish;
use crate::remote::{RemoteBench, RemoteDesk, RemoteQueue, RemoteRefusal, Starter, lock};
use crate::routes::router;
use crate::shared::Shared;
use axum::Router;
use axum::extract::Extension;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use palpate_analysis::station_settings::{StationSettings, TlsFiles};
use palpate_protocols::plans::Plan;
use palpate_runner::{RunnerHandle, wall_now};
use rustls::ServerConfig;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use std::collections::HashMap;
use std::io::{self, ErrorKind};
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio_rustls::TlsAcceptor;

/// Connections at a time.
const CONNECTIONS_MAX: usize = 128;

/// Further ones, only for addresses that have fewer than this many: a flood from one address leaves room for a stop from
/// another.
const CONNECTIONS_RESERVED: usize = 64;
const CONNECTIONS_SMALL: usize = 4;

/// Connections of one address: twenty watchers, and as many requests.
const CONNECTIONS_OF_ONE: usize = 64;

/// Longest time until the head of a request has come, and between two requests.
const HEAD_MAX: Duration = Duration::from_secs(15);

/// Longest TLS handshake.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);

/// Bytes of a request's head that are kept.
const HEAD_BYTES_MAX: usize = 16 * 1024;

/// How often the desk of remote runs is looked at.
const DESK_STEP: Duration = Duration::from_millis(50);

#[derive(Debug, Error)]
pub enum StationError {
    #[error("the station cannot listen on {address} ({error}); choose another address or port")]
    Listen { address: SocketAddr, error: io::Error },
    #[error(
        "{address} can be reached from other computers, so it needs TLS; give a certificate and its key, or allow plain connections where the network is your own"
    )]
    Plain { address: SocketAddr },
    #[error("the {what} {file} cannot be used ({detail}); give a PEM file")]
    Tls { what: &'static str, file: PathBuf, detail: String },
    #[error("the station's thread cannot be started ({0})")]
    Thread(io::Error),
}

/// A station that serves. Dropped, it ends; the rig goes on.
pub struct Station {
    address: SocketAddr,
    is_tls: bool,
    runner: RunnerHandle,
    desk: Arc<Mutex<RemoteDesk>>,
    bench: Arc<Mutex<Option<RemoteBench>>>,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// A station that has its address and does not serve yet.
pub struct BoundStation {
    settings: StationSettings,
    listener: std::net::TcpListener,
    address: SocketAddr,
    tls: Option<Arc<ServerConfig>>,
}

impl BoundStation {
    /// Takes the address and reads the certificate: what can be refused is refused here, before anything moves.
    pub fn bind(settings: &StationSettings) -> Result<Self, StationError> {
        let address = settings.address;
        if !address.ip().is_loopback() && settings.tls.is_none() && !settings.is_plain_allowed {
            return Err(StationError::Plain { address });
        }
        let tls = settings.tls.as_ref().map(tls_config).transpose()?;
        let failed = |error: io::Error| StationError::Listen { address, error };
        let listener = std::net::TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { settings: settings.clone(), listener, address, tls })
    }

    /// Serves on a thread of its own. With a bench, runs of an armed queue can be asked for.
    pub fn serve(
        self,
        runner: RunnerHandle,
        bench: Option<RemoteBench>,
    ) -> Result<Station, StationError> {
        let Self { settings, listener, address, tls } = self;
        let desk = Arc::new(Mutex::new(RemoteDesk::default()));
        let bench = Arc::new(Mutex::new(bench));
        let shared = Shared::new(&settings, runner.clone(), Arc::clone(&desk), Arc::clone(&bench));
        let shared = Arc::new(shared.map_err(StationError::Thread)?);
        let starter = Starter::new(Arc::clone(&desk), runner.clone());
        let (end, ended) = oneshot::channel();
        let is_tls = tls.is_some();
        let own_bench = Arc::clone(&bench);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(2)
            .thread_name("station-work")
            .build()
            .map_err(StationError::Thread)?;
        let serve = move || {
            runtime.block_on(async move {
                tokio::spawn(publish(Arc::clone(&shared)));
                tokio::spawn(turn_desk(starter, own_bench));
                let listener = match TcpListener::from_std(listener) {
                    Ok(listener) => listener,
                    Err(err) => return tracing::error!("the station cannot listen: {err}"),
                };
                tokio::select! {
                    () = accept(listener, tls, router(shared)) => {}
                    _ = ended => {}
                }
            });
            // Work on the library may take longer; the program need not wait for it.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("station".into()).spawn(serve);
        let thread = thread.map_err(StationError::Thread)?;
        Ok(Station { address, is_tls, runner, desk, bench, end: Some(end), thread: Some(thread) })
    }
}

impl Station {
    /// Listens and serves. With a bench, runs of an armed queue can be asked for.
    pub fn start(
        settings: &StationSettings,
        runner: RunnerHandle,
        bench: Option<RemoteBench>,
    ) -> Result<Self, StationError> {
        BoundStation::bind(settings)?.serve(runner, bench)
    }

    /// Where it listens, with the port that was chosen where none was given.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The address of the page, without a token.
    pub fn url(&self) -> String {
        let scheme = if self.is_tls { "https" } else { "http" };
        format!("{scheme}://{}", self.address)
    }

    /// What is armed, and what is asked for.
    pub fn desk(&self) -> &Arc<Mutex<RemoteDesk>> {
        &self.desk
    }

    /// Arms a queue for a time, if the rig can run every combination of the ends of its ranges.
    pub fn arm(&self, queue: RemoteQueue, time: Duration) -> Result<(), RemoteRefusal> {
        let bench = self.bench.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let rig = &self.runner.snapshot().rig;
        let check = |plan: &Plan| match &bench {
            Some(bench) => bench.check(plan, rig),
            None => Err("the rig has no calibration yet".into()),
        };
        queue.check(check)?;
        lock(&self.desk).arm(queue, wall_now(), time)
    }

    /// Takes another calibration and other limits for runs over the network.
    pub fn set_bench(&self, bench: Option<RemoteBench>) {
        *self.bench.lock().unwrap_or_else(PoisonError::into_inner) = bench;
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        if let Some(end) = self.end.take() {
            let _ = end.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Looks at the desk, as long as the station serves.
async fn turn_desk(mut starter: Starter, bench: Arc<Mutex<Option<RemoteBench>>>) {
    loop {
        tokio::time::sleep(DESK_STEP).await;
        let own = bench.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let turned = tokio::task::spawn_blocking(move || {
            let work = starter.turn(own.as_ref());
            (starter, work)
        });
        let Ok((same, work)) = turned.await else {
            return tracing::error!("the desk of remote runs has failed; no more runs are started");
        };
        starter = same;
        if let Some(work) = work {
            tokio::task::spawn_blocking(move || work.carry_out());
        }
    }
}

/// Connections by address.
#[derive(Debug, Default)]
struct Connections(HashMap<IpAddr, usize>);

impl Connections {
    fn admit(&mut self, address: IpAddr) -> bool {
        let all: usize = self.0.values().sum();
        let own = self.0.get(&address).copied().unwrap_or(0);
        let is_room = all < CONNECTIONS_MAX
            || (own < CONNECTIONS_SMALL && all < CONNECTIONS_MAX + CONNECTIONS_RESERVED);
        let is_admitted = is_room && own < CONNECTIONS_OF_ONE;
        if is_admitted {
            self.0.insert(address, own + 1);
        }
        is_admitted
    }

    fn leave(&mut self, address: IpAddr) {
        if let Some(count) = self.0.get_mut(&address) {
            *count -= 1;
            if *count == 0 {
                self.0.remove(&address);
            }
        }
    }
}

/// A connection that counts for as long as it lives.
struct Admission(Arc<Mutex<Connections>>, IpAddr);

impl Drop for Admission {
    fn drop(&mut self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).leave(self.1);
    }
}

async fn accept(listener: TcpListener, tls: Option<Arc<ServerConfig>>, router: Router) {
    let connections = Arc::new(Mutex::new(Connections::default()));
    let acceptor = tls.map(TlsAcceptor::from);
    loop {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(err) => {
                // A connection that was cut in the queue, or too many open files: others may still come.
                if !matches!(err.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset)
                {
                    tracing::warn!("the station could not take a connection: {err}");
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
                continue;
            }
        };
        let is_admitted =
            connections.lock().unwrap_or_else(PoisonError::into_inner).admit(peer.ip());
        if !is_admitted {
            continue;
        }
        let admission = Admission(Arc::clone(&connections), peer.ip());
        let _ = stream.set_nodelay(true);
        let app = router.clone().layer(Extension(Peer(peer)));
        let acceptor = acceptor.clone();
        tokio::spawn(async move {
            match acceptor {
                None => serve(stream, app).await,
                Some(acceptor) => {
                    let shaken = tokio::time::timeout(HANDSHAKE_MAX, acceptor.accept(stream)).await;
                    if let Ok(Ok(stream)) = shaken {
                        serve(stream, app).await;
                    }
                }
            }
            drop(admission);
        });
    }
}

async fn serve(stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, app: Router) {
    let served = hyper::server::conn::http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_MAX)
        .max_buf_size(HEAD_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app))
        .with_upgrades()
        .await;
    if let Err(err) = served {
        tracing::debug!("a connection ended: {err}");
    }
}

fn tls_config(files: &TlsFiles) -> Result<Arc<ServerConfig>, StationError> {
    let error = |what, file: &Path, detail: String| StationError::Tls {
        what,
        file: file.to_owned(),
        detail,
    };
    let of_certificate = |detail| error("certificate", &files.certificate, detail);
    let of_key = |detail| error("private key", &files.key, detail);
    let chain = CertificateDer::pem_file_iter(&files.certificate)
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(|err| of_certificate(err.to_string()))?;
    if chain.is_empty() {
        return Err(of_certificate("it has no certificate".into()));
    }
    let key = PrivateKeyDer::from_pem_file(&files.key).map_err(|err| of_key(err.to_string()))?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ServerConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|err| of_certificate(err.to_string()))?
        .with_no_client_auth()
        .with_single_cert(chain, key)
        .map_err(|err| of_key(err.to_string()))?;
    Ok(Arc::new(config))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_from_one_address_leaves_room_for_others() {
        let mut connections = Connections::default();
        let address = |last: u8| IpAddr::from([10, 0, 0, last]);
        let flood = (0..1000).filter(|_| connections.admit(address(1))).count();
        assert_eq!(flood, CONNECTIONS_OF_ONE);
        // Many addresses at once: a stranger still gets its few.
        for last in 2..40 {
            for _ in 0..100 {
                connections.admit(address(last));
            }
        }
        let all: usize = connections.0.values().sum();
        assert!(all <= CONNECTIONS_MAX + CONNECTIONS_RESERVED, "{all}");
        assert!(connections.0.len() > 10, "{}", connections.0.len());
        for _ in 0..CONNECTIONS_OF_ONE {
            connections.leave(address(1));
        }
        assert!(connections.admit(address(200)));
        connections.leave(address(200));
        assert!(!connections.0.contains_key(&address(200)), "an address without one is forgotten");
    }
}
