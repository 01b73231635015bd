//! The object by MQTT. The connection stays open, so that the broker announces an end of palpate that palpate cannot.

mod protocol;

use super::{SILENCE_MAX, SendError};
use crate::notice::Notice;
use crate::target::MqttTarget;
use crate::tls;
use protocol::{Answer, Connect, DISCONNECT, PING, PacketError, Publish};
use rustls::ClientConfig;
use rustls::pki_types::ServerName;
use std::sync::Arc;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;

/// The broker takes a client for lost after one and a half times so long (section 3.1.2.10).
const KEEP_ALIVE_S: u16 = 2 * SILENCE_MAX.as_secs() as u16;

const ONLINE: &str = "online";
const OFFLINE: &str = "offline";

/// A connection, encrypted or not.
trait Stream: AsyncRead + AsyncWrite + Unpin + Send + Sync {}

impl<T: AsyncRead + AsyncWrite + Unpin + Send + Sync> Stream for T {}

pub(crate) struct MqttSender {
    target: MqttTarget,
    config: Option<Arc<ClientConfig>>,
    client: String,
    topic_notice: String,
    topic_state: String,
    connection: Option<Connection>,
    /// Whether the broker has refused the login: tried again and again, it would lock the account.
    is_refused: bool,
}

struct Connection {
    stream: Box<dyn Stream>,
    received: Vec<u8>,
    identifier: u16,
}

impl MqttSender {
    pub fn new(target: &MqttTarget, ca_file: Option<&[u8]>) -> Result<Self, SendError> {
        let config = target.is_encrypted.then(|| tls::client_config(ca_file)).transpose();
        Ok(Self {
            config: config.map_err(SendError::passing)?,
            client: client_name(),
            topic_notice: format!("{}/notice", target.topic),
            topic_state: format!("{}/state", target.topic),
            target: target.clone(),
            connection: None,
            is_refused: false,
        })
    }

    pub async fn send(&mut self, notice: &Notice) -> Result<(), SendError> {
        // A connection may have been lost since the last word of the broker; one more is tried at once.
        let was_connected = self.connection.is_some();
        match self.publish(&notice.json()).await {
            Err(err) if was_connected && !err.is_final => {
                self.connection = None;
                self.publish(&notice.json()).await
            }
            result => result,
        }
    }

    async fn publish(&mut self, text: &str) -> Result<(), SendError> {
        let topic = self.topic_notice.clone();
        let connection = self.connected().await?;
        let result = connection.publish(Publish { topic: &topic, text }).await;
        if result.is_err() {
            self.connection = None;
        }
        result
    }

    /// Tries whether the broker is still there, and connects where it was not. A failure is passed over: the next notice
    /// tries again, and says why it fails.
    pub async fn keep_alive(&mut self) {
        if self.is_refused {
            return;
        }
        let Ok(connection) = self.connected().await else { return };
        if connection.ping().await.is_err() {
            self.connection = None;
            let _ = self.connected().await;
        }
    }

    pub async fn close(&mut self) {
        let Some(mut connection) = self.connection.take() else { return };
        // The broker publishes the will only of who goes without a word.
        let _ = connection.publish(Publish { topic: &self.topic_state, text: OFFLINE }).await;
        let _ = connection.write(&DISCONNECT).await;
        let _ = connection.stream.shutdown().await;
    }

    pub fn disconnect(&mut self) {
        self.connection = None;
    }

    async fn connected(&mut self) -> Result<&mut Connection, SendError> {
        let connection = match self.connection.take() {
            Some(connection) => connection,
            None => {
                let connected = self.connect().await;
                self.is_refused = connected.as_ref().is_err_and(|err| err.is_final);
                connected?
            }
        };
        Ok(self.connection.insert(connection))
    }

    async fn connect(&self) -> Result<Connection, SendError> {
        let (server, port) = (self.target.server.as_str(), self.target.port);
        let failed = |err: std::io::Error| {
            SendError::passing(format!("no connection to port {port} ({err})"))
        };
        let plain = TcpStream::connect((server, port)).await.map_err(failed)?;
        let stream: Box<dyn Stream> = match &self.config {
            None => Box::new(plain),
            Some(config) => {
                let name = ServerName::try_from(server.to_owned())
                    .map_err(|err| SendError::refused(err.to_string()))?;
                let connector = TlsConnector::from(Arc::clone(config));
                Box::new(connector.connect(name, plain).await.map_err(failed)?)
            }
        };
        let mut connection = Connection { stream, received: Vec::new(), identifier: 0 };
        let will = Publish { topic: &self.topic_state, text: OFFLINE };
        let login = self.target.login.as_ref();
        let login = login.map(|(user, password)| (user.as_str(), password.reveal()));
        let hello = Connect { client: &self.client, keep_alive_s: KEEP_ALIVE_S, will, login };
        connection.write(&protocol::connect(&hello).map_err(unsendable)?).await?;
        match connection.read().await? {
            Answer::Connected(0) => {}
            Answer::Connected(code) => return Err(refusal(code)),
            _ => return Err(SendError::passing(PacketError::NoBroker.to_string())),
        }
        connection.publish(Publish { text: ONLINE, ..will }).await?;
        Ok(connection)
    }
}

impl Connection {
    /// Publishes, and waits until the broker has it.
    async fn publish(&mut self, publish: Publish<'_>) -> Result<(), SendError> {
        // An identifier is not 0 (section 2.3.1).
        self.identifier = self.identifier.checked_add(1).unwrap_or(1);
        let identifier = self.identifier;
        self.write(&protocol::publish(publish, identifier).map_err(unsendable)?).await?;
        self.wait_for(Answer::Taken(identifier)).await
    }

    async fn ping(&mut self) -> Result<(), SendError> {
        self.write(&PING).await?;
        self.wait_for(Answer::Pong).await
    }

    async fn wait_for(&mut self, wanted: Answer) -> Result<(), SendError> {
        while self.read().await? != wanted {}
        Ok(())
    }

    async fn write(&mut self, bytes: &[u8]) -> Result<(), SendError> {
        let written = async {
            self.stream.write_all(bytes).await?;
            self.stream.flush().await
        };
        written.await.map_err(|err| lost(&err))
    }

    async fn read(&mut self) -> Result<Answer, SendError> {
        loop {
            let found = protocol::answer(&self.received);
            if let Some((answer, length)) =
                found.map_err(|err| SendError::passing(err.to_string()))?
            {
                self.received.drain(..length);
                return Ok(answer);
            }
            let mut piece = [0; 256];
            let count = self.stream.read(&mut piece).await.map_err(|err| lost(&err))?;
            if count == 0 {
                return Err(SendError::passing("the broker closed the connection"));
            }
            self.received.extend_from_slice(&piece[..count]);
        }
    }
}

fn lost(err: &std::io::Error) -> SendError {
    SendError::passing(format!("the connection was lost ({err})"))
}

fn unsendable(err: PacketError) -> SendError {
    SendError::refused(err.to_string())
}

/// Table 3.1 of section 3.2.2.3.
fn refusal(code: u8) -> SendError {
    match code {
        3 => SendError::passing("the broker is not available"),
        4 | 5 => SendError::refused("the broker refused user and password; check both"),
        1 => SendError::refused("the broker does not speak MQTT 3.1.1"),
        code => SendError::refused(format!("the broker refused the connection with code {code}")),
    }
}

/// A name that no other client of the broker has, at most 23 letters and digits as every broker takes them (section
/// 3.1.3.1): of two clients with one name the broker keeps only the newer.
fn client_name() -> String {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let since = palpate_runner::wall_now().duration_since(std::time::UNIX_EPOCH);
    let millis = since.map_or(0, |since| since.as_millis() as u64);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    // Processes of two computers may have one number and one time, but hardly both to a millisecond.
    format!(
        "palpate{:05x}{:08x}{:02x}",
        std::process::id() & 0xF_FFFF,
        millis & 0xFFFF_FFFF,
        count & 0xFF
    )
}
