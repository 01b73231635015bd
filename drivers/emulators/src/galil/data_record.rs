//! Data records: `QR`, `DR`, `QZ`. Little-endian, packed.
//!
//! Layouts of `gclib_record.h` for the 4000 and 2103 series, bits as `GalilController.cpp` of EPICS reads them.

use super::axis::{AxisMotion, GalilAxis};
use super::model::GalilModel;
use super::settings::AxisSetting;

/// Content of a record apart from its axes.
#[derive(Clone, Copy, Debug, Default)]
pub struct GeneralBlock {
    /// Samples since the reset, of which 16 bits are sent.
    pub sample: u64,
    pub outputs: u16,
    /// Number of the last error.
    pub error: u8,
    /// Threads that run, one bit each.
    pub threads: u8,
    /// Whether statements are echoed.
    pub has_echo: bool,
    /// Segments done in the contour mode, and free.
    pub contour: (u32, u16),
    /// Whether an axis is in the contour mode.
    pub contouring: u8,
    /// Open connections, one bit each.
    pub handles: u8,
}

/// Bytes before the first axis: header and the general blocks.
const fn head(model: GalilModel) -> usize {
    if model.is_21x3() { 44 } else { 82 }
}

/// Bytes of an axis.
const fn axis_length(model: GalilModel) -> usize {
    if model.is_21x3() { 28 } else { 36 }
}

/// `QZ`: axes, bytes of the general block, of the coordinate block, of an axis.
pub fn lengths(model: GalilModel) -> String {
    let (general, coordinate) = if model.is_21x3() { (24, 16) } else { (52, 26) };
    format!("{}, {general}, {coordinate}, {}", model.axes(), axis_length(model))
}

/// One record: every block is present. `analog` holds the 16-bit reading that goes with an axis.
pub fn build_record(
    model: GalilModel,
    general: &GeneralBlock,
    axes: &[GalilAxis],
    analog: &[u16],
) -> Vec<u8> {
    let size = head(model) + axis_length(model) * axes.len();
    let mut bytes = vec![0_u8; size];
    let mut put = |at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    // Axes A to H, then S, T and inputs-and-outputs: bits 0-7 of the high byte, 0-2 of the low one.
    let axes_present = ((1_u16 << axes.len()) - 1) as u8;
    put(0, &[0b1000_0111, axes_present]);
    put(2, &(size as u16).to_le_bytes());
    // 16 bits, wrapping after 64 s.
    put(4, &(general.sample as u16).to_le_bytes());
    // Inputs are pulled up and open.
    put(6, &[0xff, 0xff]);
    put(16, &general.outputs.to_le_bytes());
    if model.is_21x3() {
        put(26, &[general.error]);
        let status = u8::from(general.threads != 0) << 7 | u8::from(general.has_echo);
        put(27, &[status]);
    } else {
        let handles: [u8; 8] = std::array::from_fn(|at| general.handles >> at & 1);
        put(42, &handles);
        put(50, &[general.error, general.threads]);
        put(56, &general.contour.0.to_le_bytes());
        put(60, &general.contour.1.to_le_bytes());
    }
    for (index, axis) in axes.iter().enumerate() {
        let at = head(model) + axis_length(model) * index;
        let is_contouring = general.contouring >> index & 1 == 1;
        put(at, &status(axis, is_contouring, model).to_le_bytes());
        put(at + 2, &[switches(axis), axis.stop_code]);
        let counts = |value: f64| (value as i32).to_le_bytes();
        put(at + 4, &counts(axis.reference()));
        put(at + 8, &counts(axis.encoder_position()));
        put(at + 12, &counts(0.0));
        put(at + 16, &counts(axis.pulses()));
        // 64 times TV.
        put(at + 20, &counts(64.0 * axis.profile.velocity));
        let analog = analog.get(index).copied().unwrap_or(0).to_le_bytes();
        // Torque stays zero: nothing holds a load.
        put(at + if model.is_21x3() { 26 } else { 28 }, &analog);
        if !model.is_21x3() {
            let user = axis.settings.get(AxisSetting::UserVariable);
            put(at + 32, &counts(user));
        }
    }
    bytes
}

/// The status word of an axis.
fn status(axis: &GalilAxis, is_contouring: bool, model: GalilModel) -> u16 {
    let is = |bit: u32, is_set: bool| u16::from(is_set) << bit;
    let velocity = axis.profile.velocity;
    let speed = match axis.motion {
        AxisMotion::Jog(speed) => speed.abs(),
        _ => axis.settings.get(AxisSetting::Speed),
    };
    let is_edge = |homing: bool| matches!(axis.motion, AxisMotion::Edge { is_homing, .. } if is_homing == homing);
    let is_back = matches!(axis.motion, AxisMotion::Back { .. });
    let is_target = matches!(axis.motion, AxisMotion::Target(_));
    let is_off_on_error = axis.settings.get(AxisSetting::OffOnError) > 0.0;
    is(15, axis.is_running())
        | is(14, is_target)
        | is(13, is_target)
        | is(12, is_edge(false))
        | is(11, is_edge(true) || is_back)
        | is(10, is_back)
        | is(7, velocity < 0.0)
        | is(6, is_contouring)
        | is(5, velocity != 0.0 && velocity.abs() == speed)
        | is(4, matches!(axis.motion, AxisMotion::Stopping(..)))
        | is(1, model.is_21x3() && is_off_on_error)
        | is(0, !axis.is_on)
}

/// The switch byte of an axis: limits and home as levels, and whether it is a stepper.
fn switches(axis: &GalilAxis) -> u8 {
    let inputs = axis.inputs;
    u8::from(inputs.forward) << 3
        | u8::from(inputs.reverse) << 2
        | u8::from(inputs.home) << 1
        | u8::from(axis.is_stepper())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn u16_at(bytes: &[u8], at: usize) -> u16 {
        u16::from_le_bytes([bytes[at], bytes[at + 1]])
    }

    fn i32_at(bytes: &[u8], at: usize) -> i32 {
        i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    #[test]
    fn lengths_are_those_of_the_header_file() {
        assert_eq!(lengths(GalilModel::Dmc4143), "4, 52, 26, 36");
        assert_eq!(lengths(GalilModel::Dmc2143), "4, 24, 16, 28");
        let axes = vec![GalilAxis::new(true); 8];
        let general = GeneralBlock::default();
        assert_eq!(build_record(GalilModel::Dmc4183, &general, &axes, &[]).len(), 370);
        let short = build_record(GalilModel::Dmc2143, &general, &axes[..4], &[]);
        assert_eq!(short.len(), 156);
        assert_eq!(u16_at(&short, 2), 156);
    }

    #[test]
    fn fields_are_where_clients_read_them() {
        let mut axes = vec![GalilAxis::new(true), GalilAxis::new(false)];
        axes[1].profile.place = -123.0;
        axes[1].profile.velocity = -50.0;
        axes[1].is_on = true;
        axes[1].motion = AxisMotion::Target(-500.0);
        axes[1].settings.set(AxisSetting::Speed, 50.0);
        axes[1].stop_code = 0;
        axes[0].filtered = 77.0;
        let general =
            GeneralBlock { sample: 65_536 + 258, error: 6, threads: 5, ..GeneralBlock::default() };
        for (model, head, length, analog, error) in
            [(GalilModel::Dmc4143, 82, 36, 28, 50), (GalilModel::Dmc2143, 44, 28, 26, 26)]
        {
            let bytes = build_record(model, &general, &axes, &[0x1234, 0xfffe]);
            assert_eq!(u16_at(&bytes, 4), 258);
            assert_eq!(bytes[error], 6);
            let b = head + length;
            // Moving, PA, negative, slewing.
            assert_eq!(u16_at(&bytes, b), 0b1110_0000_1010_0000);
            assert_eq!(i32_at(&bytes, b + 4), -123);
            assert_eq!(i32_at(&bytes, b + 20), -3200);
            assert_eq!(u16_at(&bytes, b + analog), 0xfffe);
            assert_eq!(u16_at(&bytes, head + analog), 0x1234);
            assert_eq!(i32_at(&bytes, head + 16), 77);
            // Motor off; switches open, stepper.
            assert_eq!(u16_at(&bytes, head), 1);
            assert_eq!((bytes[head + 2], bytes[head + 3]), (0b1111, 1));
        }
    }
}
