//! The emulated Inverse service as a state machine: bytes and the time in, bytes out.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::inverse::{
    EmulatedInverse, InverseFault, InverseService, InverseServiceSettings,
};
use palpate_model::Nanos;

fn emulated(settings: InverseServiceSettings) -> EmulatedInverse {
    EmulatedInverse::new(settings).unwrap().0
}

fn exchange(device: &mut EmulatedInverse, now: Nanos, channel: usize, bytes: &[u8]) -> String {
    device.receive(now, channel, bytes);
    device.advance(now);
    String::from_utf8_lossy(&device.transmit(channel)).into_owned()
}

const UPGRADE: &str = "GET / HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
    Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

#[test]
fn connection_answers_requests_one_after_the_other_and_byte_by_byte() {
    let mut device = emulated(InverseServiceSettings::default());
    device.connect(Nanos::ZERO, 0);
    let request = b"GET /version HTTP/1.1\r\nHost: x\r\n\r\n";
    for _ in 0..2 {
        let (last, head) = request.split_last().unwrap();
        for byte in head {
            assert_eq!(exchange(&mut device, Nanos(1), 0, &[*byte]), "");
        }
        let answer = exchange(&mut device, Nanos(1), 0, &[*last]);
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
        assert!(answer.contains("\"project_version\":\"3.5.0.0\""), "{answer}");
    }
    let answer = exchange(&mut device, Nanos(1), 0, b"GET /nothing HTTP/1.1\r\n\r\n");
    assert!(answer.starts_with("HTTP/1.1 404 "), "{answer}");
}

#[test]
fn handshake_is_that_of_the_standard_and_the_inventory_follows() {
    let mut device = emulated(InverseServiceSettings::default());
    device.connect(Nanos::ZERO, 3);
    let answer = exchange(&mut device, Nanos(1), 3, UPGRADE.as_bytes());
    // Key and answer are the example of RFC 6455, section 1.3.
    assert!(answer.contains("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), "{answer}");
    assert!(answer.contains("\"session_id\":7") && answer.contains("\"config\""), "{answer}");
}

#[test]
fn delayed_report_leaves_after_its_time() {
    let settings =
        InverseServiceSettings { reply_delay: Nanos(300_000), ..InverseServiceSettings::default() };
    let mut device = emulated(settings);
    device.connect(Nanos::ZERO, 0);
    let handshake = exchange(&mut device, Nanos(1000), 0, UPGRADE.as_bytes());
    assert!(!handshake.contains("session_id"), "{handshake}");
    device.advance(Nanos(300_999));
    assert!(device.transmit(0).is_empty());
    device.advance(Nanos(301_000));
    assert!(String::from_utf8_lossy(&device.transmit(0)).contains("session_id"));
}

#[test]
fn command_ends_by_itself_with_its_session_and_with_another() {
    let push = |z: f64| {
        format!(
            r#"{{"inverse3":[{{"device_id":"049D","commands":{{"set_cursor_force":{{"vector":{{"x":0,"y":0,"z":{z}}}}}}}}}]}}"#
        )
    };
    let ms = Nanos::from_millis;
    let mut service = InverseService::new(InverseServiceSettings::default()).unwrap();
    for channel in 0..2 {
        service.open(ms(0), channel);
        service.receive(ms(1), channel, &push(1.0));
    }
    // The service adds the forces of all sessions.
    assert_eq!(service.force(), [0.0, 0.0, 2.0]);
    service.close(ms(2), 1);
    assert_eq!(service.force(), [0.0, 0.0, 1.0]);
    // A message without a command keeps none alive; it lasts 20 ms.
    service.receive(ms(15), 0, "{}");
    service.advance(ms(21));
    assert_eq!((service.force()[2], service.zero_since()), (1.0, None));
    service.advance(ms(22));
    assert_eq!((service.force()[2], service.zero_since()), (0.0, Some(ms(22))));
    service.receive(ms(23), 0, &push(1.0));
    service.set_fault(ms(24), Some(InverseFault::Stalled));
    assert!(service.receive(ms(25), 0, &push(0.0)).is_empty());
    assert_eq!(service.zero_in_fault(), Some(ms(25)));
}

#[test]
fn random_bytes_never_panic_the_inverse_service() {
    let mut random = Random::new(3, RandomStream::Fault);
    let mut device = emulated(InverseServiceSettings::default());
    let mut below = |count: usize| (random.unit() * count as f64) as usize;
    for round in 0..2000_u64 {
        let now = Nanos(round * 100_000);
        let channel = below(device.channels());
        if below(4) == 0 {
            device.connect(now, channel);
            device.receive(now, channel, UPGRADE.as_bytes());
        }
        let bytes: Vec<u8> = (0..below(200)).map(|_| below(256) as u8).collect();
        device.receive(now, channel, &bytes);
        device.advance(now);
        device.transmit(channel);
        if device.take_hang_up(channel) {
            device.disconnect(now, channel);
        }
    }
}
