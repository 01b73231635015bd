//! A station on a simulated rig, and a plain HTTP client.

use palpate_analysis::station_settings::StationSettings;
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::Limits;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::RampHold;
use palpate_runner::{AfterStop, PromptResponder, RunRequest, Runner, RunnerRequest, TimeScale};
use palpate_station::Station;
use palpate_station::remote::RemoteBench;
use palpate_test_support::wait::PATIENCE;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A station, its runner and its library, dropped in this order.
pub struct Lab {
    pub station: Station,
    pub runner: Runner,
    pub library: TempDir,
}

pub fn rig() -> SimRig {
    SimRig::new(SimSettings::default())
}

/// A ramp and a hold of so many seconds into this folder.
pub fn ramp_hold(out: &Path, hold: f64) -> RunRequest {
    let rig = rig();
    let plan = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(6.0),
        hold: Seconds(hold),
        ..RampHold::default()
    };
    RunRequest {
        plan: plan.plan(),
        calibration: rig.calibration(),
        limits: Limits::for_travel(rig.description().travel),
        out: Some(out.to_path_buf()),
        labels: SessionLabels::default(),
        is_acknowledged: true,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: PromptResponder::Confirm,
        leader: None,
    }
}

impl Lab {
    /// On the loopback, at a free port.
    pub fn new(scale: TimeScale) -> Self {
        Self::at("127.0.0.1:0", scale, false)
    }

    pub fn at(address: &str, scale: TimeScale, is_plain_allowed: bool) -> Self {
        Self::with(address, scale, is_plain_allowed, SimSettings::default())
    }

    pub fn with(
        address: &str,
        scale: TimeScale,
        is_plain_allowed: bool,
        settings: SimSettings,
    ) -> Self {
        let library = tempfile::tempdir().unwrap();
        let rig = SimRig::new(settings);
        let (calibration, limits) =
            (rig.calibration(), Limits::for_travel(rig.description().travel));
        let runner = Runner::start(Box::new(rig), scale, None, || ()).unwrap();
        let settings = StationSettings {
            address: address.parse().unwrap(),
            tls: None,
            is_plain_allowed,
            names: vec!["rig.lab.example".into()],
            library: library.path().to_owned(),
        };
        let bench = RemoteBench {
            calibration,
            limits,
            to_acknowledge: Vec::new(),
            is_virtual: true,
            library: library.path().to_owned(),
        };
        let station = Station::start(&settings, runner.handle(), Some(bench)).unwrap();
        Self { station, runner, library }
    }

    pub fn address(&self) -> SocketAddr {
        let port = self.station.address().port();
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    /// Starts a run and returns its folder.
    pub fn start(&self, hold: f64) -> PathBuf {
        let folder = self.library.path().join("run");
        let (reply, answer) = sync_channel(1);
        let request = RunnerRequest::Run(Box::new(ramp_hold(&folder, hold)), reply);
        self.runner.request(request).unwrap();
        answer.recv().unwrap().unwrap();
        folder
    }

    pub fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[], "")
    }

    /// A request with further header lines.
    pub fn ask(&self, method: &str, path: &str, headers: &[&str], body: &str) -> Answer {
        request(self.address(), method, path, headers, body)
    }

    /// A WebSocket with these subprotocols, or the status of the refusal.
    pub fn watch(&self, path: &str, protocols: &str) -> Result<WebSocket<TcpStream>, u16> {
        let stream = connect(self.address());
        let mut request = format!("ws://{}{path}", self.address()).into_client_request().unwrap();
        if !protocols.is_empty() {
            let value = protocols.parse().unwrap();
            request.headers_mut().insert("sec-websocket-protocol", value);
        }
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(err) => panic!("{err}"),
        }
    }
}

pub fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|err| panic!("{err}: {self:?}"))
    }

    /// The sentence of a refusal.
    pub fn error(&self) -> String {
        self.json()["error"].as_str().unwrap().to_owned()
    }
}

/// One request on a connection of its own.
pub fn request(
    address: SocketAddr,
    method: &str,
    path: &str,
    headers: &[&str],
    body: &str,
) -> Answer {
    let mut lines = vec![format!("{method} {path} HTTP/1.1"), "Connection: close".into()];
    if !headers.iter().any(|line| line.starts_with("Host:")) {
        lines.push(format!("Host: {address}"));
    }
    if !body.is_empty() {
        lines.push("Content-Type: application/json".into());
    }
    lines.push(format!("Content-Length: {}", body.len()));
    lines.extend(headers.iter().map(|&line| line.to_owned()));
    let text = format!("{}\r\n\r\n{body}", lines.join("\r\n"));
    exchange(address, text.as_bytes()).unwrap_or_else(|| panic!("no answer to {text}"))
}

/// Sends bytes and reads until the other side closes; `None` where it closes without an answer.
pub fn exchange(address: SocketAddr, bytes: &[u8]) -> Option<Answer> {
    let mut stream = connect(address);
    // The other side may have closed already.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let text = String::from_utf8_lossy(&answer);
    let (head, body) = text.split_once("\r\n\r\n")?;
    let status = head.split(' ').nth(1)?.parse().ok()?;
    Some(Answer { status, head: head.to_ascii_lowercase(), body: body.to_owned() })
}

/// The next live message.
pub fn next(socket: &mut WebSocket<TcpStream>) -> Option<Value> {
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).unwrap()),
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}
