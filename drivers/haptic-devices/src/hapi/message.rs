//! Packets of the board: bytes out, angles in. Numbers are of single precision, the lowest byte first.
//!
//! To the board: a command, the device's number, and its values in the order of the board's ports. Command 0 forgets the set-up, 1 is
//! a set-up, 2 has torques in N m and is the only one with an answer: the device's number and the angles in degrees.

/// Number of the device on the board. Any but zero; as in Haply's examples.
pub const DEVICE: u8 = 5;
const SETUP: u8 = 1;
const TORQUES: u8 = 2;
/// A command that no firmware knows and every one passes over. As the upper bytes of a number it is less than 1e-36.
const PADDING: u8 = 3;
/// Bytes of an answer.
pub const ANSWER: usize = 9;
/// Values of a packet with torques: as many bytes can be missing of one that was cut.
const VALUES: usize = 8;
/// Values at the end of a set-up.
const SETUP_VALUES: usize = 16;
/// Largest torque of a motor in N m: `MAX_TORQUE` of the firmware, which cuts each motor off there, alone and so into another
/// direction.
pub const TORQUE_MAX_N_M: f64 = 0.123;
/// Angles of motors 1 and 2 in the home position, in degrees.
const HOME_DEGREES: [f64; 2] = [168.0, 12.0];

/// How two motors and their encoders are connected: motor 1 to port 2 and motor 2 to port 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardSetup {
    /// Angles of motors 1 and 2 in the home position, in degrees.
    pub home_degrees: [f64; 2],
    /// Counts a turn.
    pub counts: f64,
}

impl Default for BoardSetup {
    /// The 2DIY of plastic, as in the example of `HaplyHAPI` 1.0.1.
    fn default() -> Self {
        Self { home_degrees: HOME_DEGREES, counts: 4880.0 }
    }
}

/// Motors in the order of the board's ports, and back.
fn swapped([one, two]: [f64; 2]) -> [f64; 2] {
    [two, one]
}

/// The set-up. The firmware reads its first bytes without waiting, so it must be written at once.
pub fn write_setup(packet: &mut Vec<u8>, setup: &BoardSetup) {
    const PORTS_1_AND_2: u8 = 0b11;
    const COUNTER_CLOCKWISE: u8 = 1;
    let part = [PORTS_1_AND_2, COUNTER_CLOCKWISE, COUNTER_CLOCKWISE];
    packet.extend([SETUP, DEVICE]);
    packet.extend(part);
    packet.extend(part);
    // No sensors, no pulses.
    packet.extend([0, 0]);
    for home in swapped(setup.home_degrees) {
        packet.extend((home as f32).to_le_bytes());
        packet.extend((setup.counts as f32).to_le_bytes());
    }
}

/// Torques of motors 1 and 2 in N m. What is no number is none: the firmware's arithmetic would make any torque of it.
pub fn write_torques(packet: &mut Vec<u8>, torques: [f64; 2]) {
    packet.extend([TORQUES, DEVICE]);
    for torque in swapped(torques) {
        let torque = if torque.is_finite() { torque } else { 0.0 };
        packet.extend((torque as f32).to_le_bytes());
    }
}

/// Zero torque for a board that may be in the middle of a packet: padding completes a cut one with numbers that make no torque,
/// and a board that waits for a command passes over it.
pub fn write_zero(packet: &mut Vec<u8>) {
    packet.extend([PADDING; VALUES]);
    write_torques(packet, [0.0; 2]);
}

/// Completes whatever was cut, a set-up included, then sets up and sends zero.
pub fn write_first(packet: &mut Vec<u8>, setup: &BoardSetup) {
    packet.extend([PADDING; SETUP_VALUES]);
    write_setup(packet, setup);
    write_torques(packet, [0.0; 2]);
}

/// Angles of motors 1 and 2 in degrees; `None` if the answer is that of another device.
#[must_use]
pub fn parse_angles(answer: &[u8; ANSWER]) -> Option<[f64; 2]> {
    let [device, a, b, c, d, e, f, g, h] = *answer;
    let angles = [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])];
    (device == DEVICE).then(|| swapped(angles.map(f64::from)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of a packet with torques.
    const EXCHANGE: usize = 10;

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn packets_are_those_of_haplys_package() {
        // Written by `HaplyHAPI` 1.0.1 on a port that keeps its bytes.
        let mut packet = Vec::new();
        write_setup(&mut packet, &BoardSetup::default());
        assert_eq!(hex(&packet), "0105030101030101000000004041008098450000284300809845");
        let cases = [
            ([0.0725601921212649, -0.08812999890794403], "0205807db4bd709a943d"),
            ([0.02503582247020369, -0.08506807523189366], "02052c38aebded17cd3c"),
        ];
        for (torques, expected) in cases {
            packet.clear();
            write_torques(&mut packet, torques);
            assert_eq!(hex(&packet), expected);
            assert_eq!(packet.len(), EXCHANGE);
        }
    }

    #[test]
    fn torque_at_no_number_is_none() {
        for torques in [[f64::NAN, 0.0], [0.0, f64::INFINITY], [f64::NEG_INFINITY, f64::NAN]] {
            let mut packet = Vec::new();
            write_torques(&mut packet, torques);
            assert_eq!(packet[2..], [0; VALUES]);
        }
    }

    #[test]
    fn padding_completes_any_cut_packet_without_a_torque() {
        let mut whole = Vec::new();
        write_torques(&mut whole, [0.1, -0.12]);
        for kept in 2..EXCHANGE {
            let mut bytes = whole[..kept].to_vec();
            write_zero(&mut bytes);
            for value in bytes[2..EXCHANGE].chunks(4).zip(whole[2..].chunks(4)) {
                let torque = |four: &[u8]| f32::from_le_bytes([four[0], four[1], four[2], four[3]]);
                let (found, before) = (torque(value.0), torque(value.1));
                assert!(found == before || found.abs() < 1e-30, "{kept}: {found}");
            }
            // Then commands that are none, and the zero.
            let rest = &bytes[EXCHANGE..];
            let is_zero = rest.strip_prefix(&[PADDING; VALUES][..kept - 2]);
            assert_eq!(is_zero, Some(&[TORQUES, DEVICE, 0, 0, 0, 0, 0, 0, 0, 0][..]));
        }
    }

    #[test]
    fn answer_has_the_angles_of_its_device() {
        let mut answer = [0_u8; ANSWER];
        answer[0] = DEVICE;
        answer[1..5].copy_from_slice(&12.5_f32.to_le_bytes());
        answer[5..].copy_from_slice(&(-168.0_f32).to_le_bytes());
        assert_eq!(parse_angles(&answer), Some([-168.0, 12.5]));
        answer[0] = 4;
        assert_eq!(parse_angles(&answer), None);
    }
}
