//! Opening a board: its identity and its settings are compared with the rig file. Nothing is written that the board
//! keeps, and nothing moves.

use super::console::GrblConsole;
use super::error::GrblOpenError;
use super::fitness::{check_settings, read_settings, setting};
use super::motion::worst_case_mm;
use super::protocol::{self, CYCLE_START, GrblLine, GrblParser, GrblState, GrblStatus, JOG_CANCEL};
use super::settings::{BoardParameters, GrblSettings, HomeSwitch};
use crate::wire::{HostClock, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::sync::Arc;

/// Opening the port resets most boards, and a boot loader waits for a new program for one to two seconds.
const START_MAX: Nanos = Nanos::from_millis(5_000);
/// After so long without a byte a reset is sent: a board that a limit has locked reacts to nothing else (gnea/grbl,
/// protocol.c, `protocol_exec_rt_system`). Boot loaders of common boards are through by then.
const RESET_AFTER: Nanos = Nanos::from_millis(2_500);
pub(super) const ASK_AGAIN: Nanos = Nanos::from_millis(300);
/// An answer takes longer only while settings are written, which this never does.
pub(super) const ANSWER_MAX: Nanos = Nanos::from_millis(1_500);
/// A reset that has just begun shows its welcome by then.
const SETTLE: Nanos = Nanos::from_millis(60);
const REST_MAX: Nanos = Nanos::from_millis(5_000);
const PINGS: usize = 10;

#[derive(Clone, Debug)]
pub struct ConnectedGrbl {
    /// Version, text of `$I=`, safety, for the operator and the log.
    pub identity: String,
    pub parameters: BoardParameters,
    pub stats: LinkStats,
    /// Longest way of the axis after palpate falls silent, in mm.
    pub worst_case_mm: f64,
    pub raw: Vec<RawBytes>,
}

/// Sets a board up. A jog that another program has left running is ended.
pub fn connect(
    link: &mut dyn Link,
    clock: &HostClock,
    settings: &GrblSettings,
    device: &Arc<str>,
) -> Result<ConnectedGrbl, GrblOpenError> {
    let mut console = GrblConsole::open(link, clock, device, GrblParser::take);
    let welcome_version = wake(&mut console)?;
    let version = identify(&mut console, settings, welcome_version.as_deref())?;
    let status = wait_for_rest(&mut console)?;
    // Whatever is on that pin opens and closes it while the slide leaves the switch, and each change is an alarm
    // (limits.c, the pin's interrupt).
    if settings.home == HomeSwitch::Probe && status.has_pin(settings.axis) {
        return Err(GrblOpenError::OnALimit { axis: settings.axis });
    }
    unlock(&mut console, settings, &status)?;
    let values = read_settings(&mut console)?;
    let steps_per_mm = check_settings(settings, &values)?;
    let status = wait_for_rest(&mut console)?;
    if status.state != GrblState::Idle {
        return Err(GrblOpenError::State(format!("{:?}", status.state)));
    }
    let is_shared = settings.home == HomeSwitch::Limit && !settings.is_closed_home;
    if is_shared && status.has_pin(settings.axis) {
        return Err(GrblOpenError::OnASwitch { axis: settings.axis });
    }
    let place = status.machine.as_ref().and_then(|place| place.get(settings.index()).copied());
    let place = place.ok_or_else(|| GrblOpenError::SetOtherwise {
        number: 10,
        meaning: "status reports",
        found: setting(&values, 10),
        wanted: "1".into(),
    })?;
    let mut stats = LinkStats::default();
    for _ in 0..PINGS {
        let start = console.now();
        console.ask("")?;
        stats.push(console.now().since(start));
    }
    stats.in_flight = 1;
    let worst_case_mm = worst_case_mm(settings.speed_max, settings.acceleration);
    Ok(ConnectedGrbl {
        // Rounded up: it is a bound.
        identity: format!(
            "Grbl {version}, axis {}; the axis stops within {:.1} mm after the link is lost",
            settings.axis,
            (worst_case_mm * 10.0).ceil() / 10.0
        ),
        parameters: BoardParameters {
            steps_per_mm,
            steps: (place * steps_per_mm).round() as i64,
            round_trip: stats.round_trip_min,
        },
        stats,
        worst_case_mm,
        raw: console.raw,
    })
}

/// Waits for an answer. Returns the version of the welcome, if one came.
fn wake(console: &mut GrblConsole<'_>) -> Result<Option<String>, GrblOpenError> {
    let start = console.now();
    let (mut has_received, mut has_reset) = (false, false);
    while console.now().since(start) < START_MAX {
        console.write([JOG_CANCEL, protocol::QUERY])?;
        let until = console.now() + ASK_AGAIN;
        while let Some(incoming) = console.next_line(until)? {
            has_received = true;
            match incoming {
                GrblLine::Hello(version) => return Ok(Some(version)),
                GrblLine::Status(_) => {
                    // A board that is just being reset sends its welcome after this; the dialogue then starts again.
                    let until = console.now() + SETTLE;
                    while let Some(incoming) = console.next_line(until)? {
                        if let GrblLine::Hello(version) = incoming {
                            return Ok(Some(version));
                        }
                    }
                    return Ok(None);
                }
                GrblLine::Other(text) => {
                    let what: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
                    if console.now().since(start) > Nanos::from_millis(2_500) {
                        return Err(GrblOpenError::NotGrbl { found: what });
                    }
                }
                _ => {}
            }
        }
        if !has_received && !has_reset && console.now().since(start) >= RESET_AFTER {
            has_reset = true;
            console.write([protocol::RESET])?;
        }
    }
    Err(GrblOpenError::Silent)
}

/// Ends half a line that another program may have written, then reads version and text of the board.
fn identify(
    console: &mut GrblConsole<'_>,
    settings: &GrblSettings,
    welcome_version: Option<&str>,
) -> Result<String, GrblOpenError> {
    // `error:7` of a memory that was never written is no answer to anything; neither is half a line's. A dollar alone
    // asks for help; at the end of half a motion it makes an error of it, where an end of line would begin it.
    console.write(b"$\n")?;
    let is_answered = wait_for_ok(console)?;
    // In motion it does not identify itself; held, asleep or behind an open door it takes no line at all.
    let status = wait_for_rest(console)?;
    if !matches!(status.state, GrblState::Idle | GrblState::Alarm) {
        return Err(GrblOpenError::State(format!("{:?}", status.state)));
    }
    if !is_answered {
        console.write([CYCLE_START])?;
        wait_for_ok(console)?;
    }
    let mut version = None;
    let mut text = String::new();
    for incoming in console.ask("$I")? {
        if let GrblLine::Message(message) = incoming
            && let Some(rest) = message.strip_prefix("VER:")
        {
            let (number, own) = rest.split_once(':').unwrap_or((rest, ""));
            version = Some(number.trim_start_matches('v').to_owned());
            own.clone_into(&mut text);
        }
    }
    let version = version
        .or_else(|| welcome_version.map(str::to_owned))
        .unwrap_or_else(|| "of unknown version".into());
    if !version.starts_with("1.1") {
        return Err(GrblOpenError::OtherVersion { version });
    }
    match &settings.build_info {
        Some(expected) if *expected != text => {
            Err(GrblOpenError::OtherBoard { found: text, expected: expected.clone() })
        }
        _ if text.is_empty() => Ok(version),
        _ => Ok(format!("{version} '{text}'")),
    }
}

fn wait_for_ok(console: &mut GrblConsole<'_>) -> Result<bool, GrblOpenError> {
    let until = console.now() + ANSWER_MAX;
    while let Some(incoming) = console.next_line(until)? {
        if incoming == GrblLine::Ok {
            return Ok(true);
        }
    }
    Ok(false)
}

fn wait_for_rest(console: &mut GrblConsole<'_>) -> Result<GrblStatus, GrblOpenError> {
    let start = console.now();
    loop {
        let status = console.status()?;
        if status.state != GrblState::Jog {
            return Ok(status);
        }
        if console.now().since(start) > REST_MAX {
            return Err(GrblOpenError::State("Jog".into()));
        }
        console.write([JOG_CANCEL])?;
    }
}

fn unlock(
    console: &mut GrblConsole<'_>,
    settings: &GrblSettings,
    status: &GrblStatus,
) -> Result<(), GrblOpenError> {
    match status.state {
        GrblState::Idle => Ok(()),
        GrblState::Alarm if settings.is_unlocking => console.ask("$X").map(|_| ()),
        GrblState::Alarm => {
            let reason = if status.has_pin(settings.axis) {
                "its limit switch is closed"
            } else {
                "it needs homing or unlocking"
            };
            Err(GrblOpenError::Locked { reason: reason.into() })
        }
        other => Err(GrblOpenError::State(format!("{other:?}"))),
    }
}
