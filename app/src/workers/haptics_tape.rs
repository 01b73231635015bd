//! A run of the master-slave system recorded, and the recording computed again.

use super::haptics::Setting;
use super::recorded::{Again, Replayed, computed_again};
use palpate_drivers::rig_file::fields::{Fields, in_words};
use palpate_model::haptics::{DELAY_MAX, DriveKind, Period};
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::haptics::scene_file::{body_text, read_body};
use palpate_protocols::haptics::taped::{COLUMNS, TapeRecorder, TapedRow, taped_row};
use palpate_protocols::haptics::{Simulated, Ticking};
use palpate_sessions::ticks::{Recording, SETTINGS};
use std::path::Path;

/// Drives by name.
const DRIVES: [(&str, bool); 2] = [("voltage", false), ("current", true)];

/// Begins a recording in a new folder.
pub fn recorder(
    folder: &Path,
    body: ModifiedKelvin,
    setting: &Setting,
) -> Result<TapeRecorder, String> {
    TapeRecorder::start(folder, &text(body, setting), COLUMNS)
}

/// What a run was made of, as a text that reads back to the same bits.
fn text(body: ModifiedKelvin, setting: &Setting) -> String {
    let is_current = matches!(setting.drive, DriveKind::Current { .. });
    let drive = DRIVES.iter().find(|(_, current)| *current == is_current);
    let friction = setting.friction.map_or(String::new(), |friction| {
        format!("friction_n = {:?}\n", friction.0)
    });
    format!(
        "[body]\n{}\n\n[device]\nperiod_ns = {}\ndrive = \"{}\"\ndamping_n_s_per_mm = {:?}\n{friction}delay_ticks = {}\ndepth_mm = {:?}\nspeed_mm_per_s = {:?}\n",
        body_text(&body),
        setting.period.nanos(),
        drive.map_or("", |(name, _)| name),
        setting.damping,
        setting.delay,
        setting.deepest.0,
        setting.speed.0
    )
}

fn parse(file: &str, text: &str) -> Result<(ModifiedKelvin, Setting), String> {
    let mut fields = Fields::read(text).map_err(|mistake| in_words(file, &[mistake]))?;
    let body = read_body(&mut fields, "body");
    let most = 1e6;
    let period = fields.needed("device.period_ns", 1.0, 1e9);
    let period = period.and_then(|nanos| Period::of_nanos(nanos as u64).ok());
    let is_current = fields.choice("device.drive", &DRIVES, None);
    let damping = fields.needed("device.damping_n_s_per_mm", 0.0, most);
    let friction = fields.number("device.friction_n", 0.0, most);
    let delay = fields.whole("device.delay_ticks", 0, DELAY_MAX as u64);
    let depth = fields.needed("device.depth_mm", 0.0, most);
    let speed = fields.needed("device.speed_mm_per_s", 0.0, most);
    let all = (body, period, is_current, damping, delay, depth, speed);
    let mistakes = fields.finish();
    let (
        Some(body),
        Some(period),
        Some(is_current),
        Some(damping),
        Some(delay),
        Some(depth),
        Some(speed),
    ) = all
    else {
        return Err(match mistakes.is_empty() {
            true => format!(
                "{file}: the body, the period or the delay is missing; take a whole recording"
            ),
            false => in_words(file, &mistakes),
        });
    };
    if !mistakes.is_empty() {
        return Err(in_words(file, &mistakes));
    }
    let usual = Setting::source(period);
    let setting = Setting {
        period,
        drive: match is_current {
            true => DriveKind::Current { amps_per_volt: 1.0 },
            false => usual.drive,
        },
        damping,
        friction: friction.map(Newtons),
        delay: delay as usize,
        deepest: Depth(depth),
        speed: MmPerS(speed),
    };
    Ok((body, setting))
}

impl Again<3, 5> for Simulated {
    fn tick(&mut self, row: &TapedRow) -> TapedRow {
        let elapsed = row.whole[1];
        Ticking::tick(self, elapsed);
        taped_row(elapsed, self.last())
    }

    fn left(&self) -> u64 {
        self.last().snapshot.sum()
    }
}

/// Computes every tick of a recording again.
pub fn replay(folder: &Path, progress: &mut dyn FnMut(f64)) -> Result<Replayed, String> {
    let found = Recording::read(folder, COLUMNS)?;
    let called = folder.join(SETTINGS).display().to_string();
    let (body, setting) = parse(&called, &found.settings)?;
    let device = Simulated::new(&setting.simulation(body, true));
    let mut device = device.map_err(|err| format!("{called}: {err}"))?;
    Ok(computed_again(
        "master and slave",
        &found,
        COLUMNS,
        &mut device,
        progress,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_was_made_of_reads_back_to_the_same_bits() {
        let period = Period::of_rate(3000.0).unwrap();
        let usual = Setting::source(period);
        let odd = Setting {
            drive: DriveKind::Current { amps_per_volt: 1.0 },
            damping: 1.0 / 3000.0,
            friction: Some(Newtons(0.1 + 0.2)),
            delay: 3,
            ..usual
        };
        for setting in [usual, odd] {
            let text = text(ModifiedKelvin::THESIS, &setting);
            let found = parse("settings.toml", &text);
            assert_eq!(found, Ok((ModifiedKelvin::THESIS, setting)), "{text}");
        }
        for (text, told) in [
            ("[device]\ndrive = \"steam\"", "line 2: device.drive"),
            ("", "device.period_ns: is missing"),
        ] {
            let said = parse("settings.toml", text).unwrap_err();
            assert!(said.contains(told), "{said}");
        }
    }
}
