//! Recordings of the master-slave system, and their replay.

use super::haptics::HapticSettings;
use super::tick_replay::{FinishedRecording, ReplayResult, Replayable, replay_ticks};
use palpate_drivers::rig_file::fields::{Fields, format_mistakes};
use palpate_haptics::{DELAY_MAX, DriveKind, MasterSlaveError, Period};
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::device_recording::{
    COLUMNS, DeviceRecorder, DeviceRow, GUIDED_COLUMNS, GuidedDeviceRecorder, GuidedDeviceRow,
    RecordedGuidedDevice, device_row, guided_device_row,
};
use palpate_runner::haptics::scene_file::{format_body, read_body};
use palpate_runner::haptics::{GuidedDevice, LoopTask, SimulatedMasterSlave};
use palpate_sessions::ticks::{SETTINGS_FILE, TickRecording, has_columns};
use std::path::Path;

const DRIVES: [(&str, bool); 2] = [("voltage", false), ("current", true)];

pub fn recorder(
    folder: &Path,
    body: ModifiedKelvin,
    setting: &HapticSettings,
) -> Result<DeviceRecorder, String> {
    DeviceRecorder::start(folder, &text(body, setting, true), COLUMNS)
}

/// For a run whose hand is led from outside.
pub fn hand_led_recorder(
    folder: &Path,
    body: ModifiedKelvin,
    setting: &HapticSettings,
    is_guarded: bool,
) -> Result<GuidedDeviceRecorder, String> {
    GuidedDeviceRecorder::start(folder, &text(body, setting, is_guarded), GUIDED_COLUMNS)
}

/// Ends the recording of a led run, if there is one.
pub fn finish_recording(
    RecordedGuidedDevice { device, recorder }: RecordedGuidedDevice,
) -> FinishedRecording {
    let hash = Replayable::state_hash(&device);
    Some(recorder?.finish(hash).map(|counts| (counts, hash)))
}

/// The settings of a run as a text that reads back to the same bits.
fn text(body: ModifiedKelvin, setting: &HapticSettings, is_guarded: bool) -> String {
    let is_current = matches!(setting.drive, DriveKind::Current { .. });
    let drive = DRIVES.iter().find(|(_, current)| *current == is_current);
    let friction = setting
        .friction
        .map_or(String::new(), |friction| format!("friction_n = {:?}\n", friction.0));
    format!(
        "[body]\n{}\n\n[device]\nperiod_ns = {}\ndrive = \"{}\"\ndamping_n_s_per_mm = {:?}\n{friction}delay_ticks = {}\ndepth_mm = {:?}\nspeed_mm_per_s = {:?}\nguards = {is_guarded}\n",
        format_body(&body),
        setting.period.nanos(),
        drive.map_or("", |(name, _)| name),
        setting.damping,
        setting.delay,
        setting.deepest.0,
        setting.speed.0
    )
}

/// The body, the device and the hand, and whether guards and controller were at work.
fn parse(file: &str, text: &str) -> Result<(ModifiedKelvin, HapticSettings, bool), String> {
    let mut fields = Fields::read(text).map_err(|mistake| format_mistakes(file, &[mistake]))?;
    let found = read_setting(&mut fields);
    match (found, fields.finish()) {
        (Some(found), mistakes) if mistakes.is_empty() => Ok(found),
        (None, mistakes) if mistakes.is_empty() => Err(format!(
            "{file}: the model, the period or the delay is missing; use a complete recording"
        )),
        (_, mistakes) => Err(format_mistakes(file, &mistakes)),
    }
}

/// Every field is read before the first that is missing ends it, so that all mistakes are listed.
fn read_setting(fields: &mut Fields) -> Option<(ModifiedKelvin, HapticSettings, bool)> {
    let most = 1e6;
    let body = read_body(fields, "body");
    let period = fields.required_number("device.period_ns", 1.0, 1e9);
    let is_current = fields.choice("device.drive", &DRIVES, None);
    let damping = fields.required_number("device.damping_n_s_per_mm", 0.0, most);
    let friction = fields.number("device.friction_n", 0.0, most).map(Newtons);
    let delay = fields.whole_number("device.delay_ticks", 0, DELAY_MAX as u64);
    let depth = fields.required_number("device.depth_mm", 0.0, most);
    let speed = fields.required_number("device.speed_mm_per_s", 0.0, most);
    // Recordings of older versions do not have it, and all of them were guarded.
    let is_guarded = fields.flag("device.guards").unwrap_or(true);
    let period = Period::of_nanos(period? as u64).ok()?;
    let usual = HapticSettings::source(period);
    let setting = HapticSettings {
        drive: if is_current? { DriveKind::Current { amps_per_volt: 1.0 } } else { usual.drive },
        damping: damping?,
        friction,
        delay: delay? as usize,
        deepest: Depth(depth?),
        speed: MmPerS(speed?),
        ..usual
    };
    Some((body?, setting, is_guarded))
}

impl Replayable<3, 5> for SimulatedMasterSlave {
    fn tick(&mut self, row: &DeviceRow) -> DeviceRow {
        let elapsed = row.whole[1];
        LoopTask::tick(self, elapsed);
        device_row(elapsed, self.last())
    }

    fn state_hash(&self) -> u64 {
        self.last().snapshot.sum()
    }
}

impl Replayable<3, 6> for GuidedDevice {
    fn tick(&mut self, row: &GuidedDeviceRow) -> GuidedDeviceRow {
        let elapsed = row.whole[1];
        self.hand_target().set(row.real[0]);
        LoopTask::tick(self, elapsed);
        guided_device_row(elapsed, self)
    }

    fn state_hash(&self) -> u64 {
        self.view().last.snapshot.sum()
    }
}

/// Whether a recording is of this system, its hand on a path or led.
pub fn is_tape(folder: &Path) -> Result<bool, String> {
    let ((whole, real), (_, led)) = (COLUMNS, GUIDED_COLUMNS);
    Ok(has_columns(folder, &whole, &real)? || has_columns(folder, &whole, &led)?)
}

/// Computes every tick of a recording again. `is_going` hears the share done and ends it early.
pub fn replay(
    folder: &Path,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ReplayResult, String> {
    if !is_tape(folder)? {
        return Err(format!(
            "{} lacks the columns of a master-slave recording; give the folder of a recorded run",
            folder.display()
        ));
    }
    let called = folder.join(SETTINGS_FILE).display().to_string();
    let wrong = |err: MasterSlaveError| format!("{called}: {err}");
    let simulation = |settings: &str| {
        let (body, setting, is_guarded) = parse(&called, settings)?;
        Ok::<_, String>((setting.simulation(body, is_guarded), setting.speed))
    };
    if has_columns(folder, &GUIDED_COLUMNS.0, &GUIDED_COLUMNS.1)? {
        let found = TickRecording::read(folder, GUIDED_COLUMNS)?;
        let (settings, speed) = simulation(&found.settings)?;
        let mut led = GuidedDevice::new(&settings, speed).map_err(wrong)?;
        let name = "master and slave, led by hand";
        return replay_ticks(name, &found, GUIDED_COLUMNS, &mut led, is_going);
    }
    let found = TickRecording::read(folder, COLUMNS)?;
    let (settings, _) = simulation(&found.settings)?;
    let mut device = SimulatedMasterSlave::new(&settings).map_err(wrong)?;
    let name = "master and slave";
    replay_ticks(name, &found, COLUMNS, &mut device, is_going)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_was_made_of_reads_back_to_the_same_bits() {
        let period = Period::of_rate(3000.0).unwrap();
        let usual = HapticSettings::source(period);
        let odd = HapticSettings {
            drive: DriveKind::Current { amps_per_volt: 1.0 },
            damping: 1.0 / 3000.0,
            friction: Some(Newtons(0.1 + 0.2)),
            delay: 3,
            ..usual
        };
        for setting in [usual, odd] {
            let text = text(ModifiedKelvin::THESIS, &setting, setting == usual);
            let found = parse("settings.toml", &text);
            let right = (ModifiedKelvin::THESIS, setting, setting == usual);
            assert_eq!(found, Ok(right), "{text}");
        }
        for (text, expected) in [
            ("[device]\ndrive = \"steam\"", "line 2: device.drive"),
            ("", "device.period_ns: this key is missing"),
        ] {
            let found = parse("settings.toml", text).unwrap_err();
            assert!(found.contains(expected), "{found}");
        }
    }
}
