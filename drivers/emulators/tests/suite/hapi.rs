//! The emulated hAPI board as a state machine: bytes and the time in, bytes out.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::hapi::{EmulatedHapi, HapiBoard, HapiBoardSettings};
use palpate_model::Nanos;

/// The set-up of the 2DIY and a packet with torques of about 0.073 and -0.088 N m, as Haply's package `HaplyHAPI` 1.0.1 writes them.
const SETUP: &str = "0105030101030101000000004041008098450000284300809845";
const TORQUES: &str = "0205807db4bd709a943d";
const ZERO: &str = "02050000000000000000";

fn bytes(hex: &str) -> Vec<u8> {
    let pair = |at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(pair).collect()
}

fn ms(millis: u64) -> Nanos {
    Nanos::from_millis(millis)
}

/// Set up, and with a torque since 1 ms.
fn pushing() -> HapiBoard {
    let mut board = HapiBoard::new(HapiBoardSettings::default()).unwrap();
    board.receive(ms(0), &bytes(SETUP));
    board.receive(ms(1), &bytes(TORQUES));
    board.advance(ms(2));
    board
}

/// Angles of an answer in degrees, in the order of the ports.
fn angles(answer: &[u8]) -> [f32; 2] {
    assert_eq!((answer.len(), answer[0]), (9, 5), "{answer:?}");
    [1, 5].map(|at| f32::from_le_bytes(answer[at..at + 4].try_into().unwrap()))
}

#[test]
fn torques_are_of_the_motor_at_their_port_and_the_answer_has_the_angles_of_home() {
    let mut board = pushing();
    let [one, two] = board.torques();
    // Whole steps of 0.123 N m / 1023.
    assert!((one - 0.07256).abs() < 2e-4 && (two + 0.08813).abs() < 2e-4, "{one} {two}");
    let [at_1, at_2] = angles(&board.transmit());
    // A count of 2440 a turn is 0.15 degrees.
    assert!((at_1 - 12.0).abs() < 0.08 && (at_2 - 168.0).abs() < 0.08, "{at_1} {at_2}");
}

#[test]
fn torque_ends_neither_in_silence_nor_at_a_reset() {
    let mut board = pushing();
    let before = board.torques();
    board.advance(ms(60_000));
    board.receive(ms(60_001), &[0, 0]);
    board.advance(ms(60_010));
    assert_eq!(board.torques(), before);
    // Without a set-up even a zero does not reach the motors, and the answer is the device's number alone.
    board.transmit();
    board.receive(ms(60_020), &bytes(ZERO));
    board.advance(ms(60_030));
    assert_eq!((board.torques(), board.transmit()), (before, vec![5]));
    board.receive(ms(60_040), &bytes(SETUP));
    board.receive(ms(60_041), &bytes(ZERO));
    board.advance(ms(60_050));
    assert_eq!(board.torques(), [0.0; 2]);
}

#[test]
fn rest_of_a_cut_packet_is_waited_for_a_second() {
    let mut board = pushing();
    board.transmit();
    let zero = bytes(ZERO);
    board.receive(ms(10), &zero[..7]);
    board.advance(ms(1009));
    assert!(board.transmit().is_empty() && board.torques()[1] != 0.0);
    board.advance(ms(1011));
    assert_eq!(board.transmit().len(), 9);
    // The second value got a byte of three, and its upper ones are those of before.
    assert_eq!(board.torques()[1], 0.0);
    assert_ne!(board.torques()[0], 0.0);
}

#[test]
fn packet_byte_by_byte_is_not_read_as_one() {
    // The firmware does not wait for the device's number.
    let mut board = pushing();
    let before = board.torques();
    for (at, byte) in bytes(ZERO).into_iter().enumerate() {
        board.receive(ms(10 + at as u64), &[byte]);
    }
    board.advance(ms(30));
    assert_eq!(board.torques(), before);
    assert!(!board.is_set_up());
}

#[test]
fn random_bytes_never_panic_the_board() {
    let mut random = Random::new(3, RandomStream::Fault);
    let (mut device, panel) = EmulatedHapi::new(HapiBoardSettings::default()).unwrap();
    let mut below = |count: usize| (random.unit() * count as f64) as usize;
    for round in 0..20_000_u64 {
        let now = Nanos(round * 100_000);
        // Mostly the firmware's commands.
        let one =
            |below: &mut dyn FnMut(usize) -> usize| below(if round % 2 == 0 { 6 } else { 256 });
        let bytes: Vec<u8> = (0..below(30)).map(|_| one(&mut below) as u8).collect();
        device.receive(now, 0, &bytes);
        device.advance(now);
        device.transmit(0);
        assert!(panel.torques().iter().all(|torque| torque.abs() <= 0.123));
    }
}
