//! The controller on a pseudo-terminal and on a TCP port, in real time.

use palpate_emulators::galil::{EmulatedGalilSettings, GalilEmulator};
use palpate_emulators::serve::{EmulatorAddress, ServeEvent, ServeOptions, serve};
use palpate_model::Nanos;
use palpate_test_support::skip;
use palpate_test_support::wait::{PATIENCE, until};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

struct Served {
    address: String,
    orders: SyncSender<String>,
    printed: Receiver<ServeEvent>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

fn start(place: EmulatorAddress, is_serial: bool) -> Served {
    let (orders, received) = sync_channel(16);
    let (sender, printed) = sync_channel(64);
    let stop = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&stop);
    let thread = std::thread::Builder::new()
        .name("emulator".into())
        .spawn(move || {
            let mut device = GalilEmulator::new(EmulatedGalilSettings {
                is_serial,
                ..EmulatedGalilSettings::default()
            });
            let options = ServeOptions {
                address: place,
                baud: None,
                latency: Nanos::ZERO,
                faults: Vec::new(),
                seed: 1,
            };
            let mut tell = |printed| sender.try_send(printed).expect("room for what is printed");
            serve(&mut device, &options, &received, &is_over, &mut tell).expect("it is served");
        })
        .expect("a thread");
    let Ok(ServeEvent::Ready(address)) = printed.recv_timeout(PATIENCE) else {
        panic!("it did not start");
    };
    Served { address, orders, printed, stop, thread: Some(thread) }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let result = thread.join();
            assert!(result.is_ok() || std::thread::panicking());
        }
    }
}

/// Reads until so many prompts have come.
fn read_prompts(port: &mut impl Read, prompts: usize) -> String {
    let mut all = Vec::new();
    let mut part = [0_u8; 256];
    while all.iter().filter(|byte| matches!(byte, b':' | b'?')).count() < prompts {
        match port.read(&mut part) {
            Ok(0) => break,
            Ok(count) => all.extend_from_slice(&part[..count]),
            Err(err) if err.kind() == ErrorKind::Interrupted => {}
            Err(err) => panic!("{err} after {:?}", String::from_utf8_lossy(&all)),
        }
    }
    String::from_utf8_lossy(&all).into_owned()
}

#[test]
fn a_serial_client_talks_to_it_over_a_pseudo_terminal() {
    if skip::lacks_terminals() {
        return;
    }
    let folder = std::env::temp_dir().join(format!("palpate-galil-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let link = folder.join("galil");
    let served = start(EmulatorAddress::Pty(Some(link.clone())), true);
    assert_eq!(served.address, link.display().to_string());
    let open = || {
        let attempt = || {
            let port = serialport::new(link.display().to_string(), 115_200).timeout(PATIENCE);
            port.open().ok()
        };
        until(attempt, || format!("no port at {}", link.display()))
    };
    let mut port = open();
    port.write_all(b"EO 0\r").unwrap();
    assert_eq!(read_prompts(&mut port, 1), ":");
    port.write_all(b"SHA;JGA=500;BGA;MG _BGA\r").unwrap();
    assert_eq!(read_prompts(&mut port, 4), "::: 1.0000\r\n:");
    // The last words of a client that goes away are heard.
    port.write_all(b"STA\r").unwrap();
    drop(port);
    let mut port = open();
    port.write_all(b"MG _SCA\r").unwrap();
    let answer = read_prompts(&mut port, 2);
    // The prompt of ST may have been lost with the client.
    assert!(answer.ends_with(" 4.0000\r\n:"), "{answer:?}");
    // Pulled out and put back: the old port is dead, a new one answers.
    served.orders.send("disconnect:0.3".into()).unwrap();
    let mut byte = [0_u8; 1];
    assert!(port.read_exact(&mut byte).is_err());
    drop(port);
    let mut port = open();
    port.write_all(b"MG 2\r").unwrap();
    assert_eq!(read_prompts(&mut port, 1), " 2.0000\r\n:");
    drop(port);
    assert_eq!(served.printed.try_iter().count(), 2);
    drop(served);
    assert!(!link.exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn eight_clients_connect_and_the_ninth_is_reset() {
    let served = start(EmulatorAddress::Tcp(([127, 0, 0, 1], 0).into()), false);
    let connect = || {
        let stream = TcpStream::connect(&served.address).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    };
    let mut clients: Vec<TcpStream> = (0..8)
        .map(|at| {
            let mut stream = connect();
            stream.write_all(b"WH\r").unwrap();
            let letter = char::from(b'A' + at);
            assert_eq!(read_prompts(&mut stream, 1), format!("IH{letter}\r\n:"));
            stream
        })
        .collect();
    let mut ninth = connect();
    let refused = ninth.read(&mut [0_u8; 8]).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::ConnectionReset);
    // A simple client reads text and prompt at once.
    clients[3].write_all(b"MG TIME\r").unwrap();
    let mut once = [0_u8; 64];
    let count = clients[3].read(&mut once).unwrap();
    assert!(once[..count].ends_with(b"\r\n:"));
    drop(clients.pop());
    // The handle is free once the controller has seen its client go.
    let attempt = || {
        let mut again = connect();
        again.write_all(b"WH\r").ok()?;
        let mut answer = [0_u8; 6];
        again.read_exact(&mut answer).ok()?;
        assert_eq!(&answer, b"IHH\r\n:");
        Some(again)
    };
    let mut again = until(attempt, || "its answer to another client".into());
    again.write_all(b"RS\r").unwrap();
    assert_eq!(again.read(&mut once).unwrap(), 0);
}
