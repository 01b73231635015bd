//! What happens once when a board is opened: who it is, whether it is the right one, whether its settings are those of
//! the rig file. Nothing is written that it keeps, and nothing moves.

use super::motion::worst_case_mm;
use super::protocol::{self, CYCLE_START, Incoming, JOG_CANCEL, Parser, State, Status};
use super::settings::{Facts, GrblSettings, HomeSwitch};
use crate::wire::{HostClock, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// Opening the port resets most boards, and a boot loader waits for a new program for one to two seconds.
const START_MAX: Nanos = Nanos::from_millis(5_000);
/// After so long without a byte a reset is asked for: a board that a limit has locked hears nothing else (gnea/grbl,
/// protocol.c, `protocol_exec_rt_system`). Boot loaders of common boards are through by then.
const RESET_AFTER: Nanos = Nanos::from_millis(2_500);
/// Between two questions who is there.
const ASK_AGAIN: Nanos = Nanos::from_millis(300);
/// An answer takes longer only while settings are written, which this never does.
const ANSWER_MAX: Nanos = Nanos::from_millis(1_500);
/// A reset that has just begun shows itself by then: half a second without a word is no board that starts.
const SETTLE: Nanos = Nanos::from_millis(60);
/// The slowest brake that anybody waits for.
const REST_MAX: Nanos = Nanos::from_millis(5_000);
/// Empty lines by which the link is measured.
const PINGS: usize = 10;
/// Status reports have three decimals of a mm (report.c): shorter steps cannot be told apart.
pub const MM_PER_STEP_MIN: f64 = 1e-3;
/// Longest single wait for bytes.
const READ_MAX: Duration = Duration::from_millis(5);

/// A board cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum GrblOpenError {
    /// It was unplugged.
    #[error("the link was lost while the board was set up ({detail}); check the cable")]
    Lost {
        /// What the operating system said.
        detail: String,
    },
    /// Nothing comes.
    #[error("nothing answers like Grbl; check power, port and baud rate (115200 is Grbl's)")]
    Silent,
    /// Something else answers.
    #[error("what answers is not Grbl ({found}); check the port in the rig file")]
    NotGrbl {
        /// What it said.
        found: String,
    },
    /// Too old for jogs.
    #[error("the board runs Grbl {version}, which cannot be driven safely; load Grbl 1.1")]
    OtherVersion {
        /// What it says it is.
        version: String,
    },
    /// A swapped cable.
    #[error(
        "the board calls itself '{found}' where the rig file has '{expected}'; check the cables, or the build_info of the rig file"
    )]
    OtherBoard {
        /// Its text of `$I=`.
        found: String,
        /// The rig file's.
        expected: String,
    },
    /// It does not want to move.
    #[error(
        "the board is locked after its start ({reason}); look whether the axis is free, then let palpate unlock it with unlock = true in the rig file, or switch its homing lock off with $22=0"
    )]
    Locked {
        /// What it said.
        reason: String,
    },
    /// It is in a state in which nothing can be done.
    #[error("the board is in state {0}; reset it and open the rig again")]
    State(String),
    /// A limit switch is closed that Grbl itself watches.
    #[error(
        "the limit pin of axis {axis} is closed, and the board would lock itself again as soon as it opens; move the slide off the switch by hand, then open the rig again"
    )]
    OnALimit {
        /// The axis.
        axis: char,
    },
    /// A setting is not that of the rig file.
    #[error(
        "the board has ${number}={found} ({meaning}) where the rig file needs {wanted}; correct the rig file, or send ${number}={wanted} from a terminal"
    )]
    SetOtherwise {
        /// Number of the setting.
        number: u16,
        /// What it is.
        meaning: &'static str,
        /// As the board has it.
        found: f64,
        /// As it should be.
        wanted: String,
    },
    /// Its steps are shorter than what it tells.
    #[error(
        "the board has ${number}={found} (steps a mm), but tells places in thousandths of a mm only, so that more than 1000 cannot be checked; set the drive to coarser microsteps"
    )]
    TooFine {
        /// Number of the setting.
        number: u16,
        /// What it is.
        found: f64,
    },
    /// Nobody knows at which end it stands.
    #[error(
        "the limit pin of axis {axis} is closed, and home and the far limit look alike on it; move the slide off the switch by hand, or say closed_is_home = true in the rig file if nothing but home can have closed it"
    )]
    OnASwitch {
        /// The axis.
        axis: char,
    },
    /// It refuses a question.
    #[error("the board refuses {line} ({detail})")]
    Refused {
        /// What was asked.
        line: String,
        /// Why.
        detail: String,
    },
}

/// A board that was set up.
#[derive(Clone, Debug)]
pub struct Connected {
    /// Version, text of `$I=`, safety, for the operator and the log.
    pub identity: String,
    /// What its settings make of it.
    pub facts: Facts,
    /// The link as it was measured.
    pub stats: LinkStats,
    /// How far the axis goes at most when palpate falls silent, in mm.
    pub worst_case_mm: f64,
    /// What was exchanged.
    pub raw: Vec<RawBytes>,
}

struct Console<'a> {
    link: &'a mut dyn Link,
    clock: &'a HostClock,
    device: Arc<str>,
    parser: Parser,
    raw: Vec<RawBytes>,
    waiting: std::collections::VecDeque<Incoming>,
}

impl Console<'_> {
    fn now(&self) -> Nanos {
        (self.clock)()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), GrblOpenError> {
        self.link.write(bytes).map_err(lost)?;
        self.tap(true, bytes);
        Ok(())
    }

    fn tap(&mut self, is_sent: bool, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.raw.push(RawBytes {
                at: self.now(),
                device: Arc::clone(&self.device),
                is_sent,
                bytes: bytes.to_vec(),
            });
        }
    }

    /// The next line, if one comes in time.
    fn next(&mut self, until: Nanos) -> Result<Option<Incoming>, GrblOpenError> {
        loop {
            if let Some(incoming) = self.waiting.pop_front() {
                return Ok(Some(incoming));
            }
            if self.now() >= until {
                return Ok(None);
            }
            let mut buffer = [0_u8; 1024];
            let count = self.link.read(&mut buffer, READ_MAX).map_err(lost)?;
            self.tap(false, &buffer[..count]);
            for byte in &buffer[..count] {
                self.waiting.extend(self.parser.take(*byte));
            }
        }
    }

    /// Asks for a status until one comes.
    fn status(&mut self) -> Result<Status, GrblOpenError> {
        let end = self.now() + ANSWER_MAX;
        while self.now() < end {
            self.write(&[protocol::QUERY])?;
            let until = self.now() + ASK_AGAIN;
            while let Some(incoming) = self.next(until)? {
                if let Incoming::Status(status) = incoming {
                    return Ok(status);
                }
            }
        }
        Err(GrblOpenError::Silent)
    }

    /// Sends a line and gives what comes before its `ok`.
    fn ask(&mut self, line: &str) -> Result<Vec<Incoming>, GrblOpenError> {
        self.write(format!("{line}\n").as_bytes())?;
        let until = self.now() + ANSWER_MAX;
        let mut all = Vec::new();
        while let Some(incoming) = self.next(until)? {
            match incoming {
                Incoming::Ok => return Ok(all),
                Incoming::Refused(refusal) => {
                    return Err(GrblOpenError::Refused {
                        line: line.to_owned(),
                        detail: refusal.to_string(),
                    });
                }
                other => all.push(other),
            }
        }
        Err(GrblOpenError::Silent)
    }
}

fn lost(err: std::io::Error) -> GrblOpenError {
    GrblOpenError::Lost {
        detail: err.to_string(),
    }
}

/// Sets a board up. A jog that somebody else has left behind is ended.
pub fn connect(
    link: &mut dyn Link,
    clock: &HostClock,
    settings: &GrblSettings,
    device: &Arc<str>,
) -> Result<Connected, GrblOpenError> {
    let mut console = Console {
        link,
        clock,
        device: Arc::clone(device),
        parser: Parser::default(),
        raw: Vec::new(),
        waiting: std::collections::VecDeque::new(),
    };
    let said = wake(&mut console)?;
    let version = identify(&mut console, settings, said.as_deref())?;
    let status = to_rest(&mut console)?;
    // Whatever is on that pin opens and closes it while the slide leaves the switch, and each change is an alarm
    // (limits.c, the pin's interrupt).
    if settings.home == HomeSwitch::Probe && status.has_pin(settings.axis) {
        return Err(GrblOpenError::OnALimit {
            axis: settings.axis,
        });
    }
    unlock(&mut console, settings, &status)?;
    let values = read_settings(&mut console)?;
    let steps_per_mm = check(settings, &values)?;
    let status = to_rest(&mut console)?;
    if status.state != State::Idle {
        return Err(GrblOpenError::State(format!("{:?}", status.state)));
    }
    let is_shared = settings.home == HomeSwitch::Limit && !settings.is_closed_home;
    if is_shared && status.has_pin(settings.axis) {
        return Err(GrblOpenError::OnASwitch {
            axis: settings.axis,
        });
    }
    let place = status
        .machine
        .as_ref()
        .and_then(|place| place.get(settings.index()).copied());
    let Some(place) = place else {
        return Err(GrblOpenError::SetOtherwise {
            number: 10,
            meaning: "status reports",
            found: value(&values, 10),
            wanted: "1".into(),
        });
    };
    let mut stats = LinkStats::default();
    for _ in 0..PINGS {
        let asked = console.now();
        console.ask("")?;
        stats.push(console.now().since(asked));
    }
    stats.in_flight = 1;
    let worst_case_mm = worst_case_mm(settings.speed_max, settings.acceleration);
    Ok(Connected {
        // Rounded up: it is a bound.
        identity: format!(
            "Grbl {version}, axis {}; at most {:.1} mm after the link is lost at full speed",
            settings.axis,
            (worst_case_mm * 10.0).ceil() / 10.0
        ),
        facts: Facts {
            steps_per_mm,
            steps: (place * steps_per_mm).round() as i64,
            round_trip: stats.round_trip_min,
        },
        stats,
        worst_case_mm,
        raw: console.raw,
    })
}

/// Waits until somebody answers. Gives the version of the welcome, where one came.
fn wake(console: &mut Console<'_>) -> Result<Option<String>, GrblOpenError> {
    let start = console.now();
    let mut found = None;
    let (mut has_heard, mut has_reset) = (false, false);
    while console.now().since(start) < START_MAX {
        console.write(&[JOG_CANCEL, protocol::QUERY])?;
        let until = console.now() + ASK_AGAIN;
        while let Some(incoming) = console.next(until)? {
            has_heard = true;
            match incoming {
                Incoming::Hello(version) => {
                    found = Some(version);
                    break;
                }
                Incoming::Status(_) => {
                    // A board that is just being reset says its welcome behind this; then all begins anew.
                    let until = console.now() + SETTLE;
                    while let Some(incoming) = console.next(until)? {
                        if let Incoming::Hello(version) = incoming {
                            return Ok(Some(version));
                        }
                    }
                    return Ok(None);
                }
                Incoming::Other(text) => {
                    let what: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
                    if console.now().since(start) > Nanos::from_millis(2_500) {
                        return Err(GrblOpenError::NotGrbl { found: what });
                    }
                }
                _ => {}
            }
        }
        if found.is_some() {
            return Ok(found);
        }
        if !has_heard && !has_reset && console.now().since(start) >= RESET_AFTER {
            has_reset = true;
            console.write(&[protocol::RESET])?;
        }
    }
    Err(GrblOpenError::Silent)
}

/// Half a line of whoever was here before is spoilt and ended; then version and text of the board.
fn identify(
    console: &mut Console<'_>,
    settings: &GrblSettings,
    said: Option<&str>,
) -> Result<String, GrblOpenError> {
    // `error:7` of a memory that was never written is no answer to anything; neither is half a line's. A dollar alone asks
    // for help; at the end of half a motion it makes an error of it, where an end of line would begin it.
    console.write(b"$\n")?;
    let is_answered = has_ok(console)?;
    // In motion it tells nothing about itself; held, asleep or behind an open door it takes no line at all.
    let status = to_rest(console)?;
    if !matches!(status.state, State::Idle | State::Alarm) {
        return Err(GrblOpenError::State(format!("{:?}", status.state)));
    }
    if !is_answered {
        console.write(&[CYCLE_START])?;
        has_ok(console)?;
    }
    let mut version = None;
    let mut text = String::new();
    for incoming in console.ask("$I")? {
        if let Incoming::Message(message) = incoming
            && let Some(rest) = message.strip_prefix("VER:")
        {
            let (number, own) = rest.split_once(':').unwrap_or((rest, ""));
            version = Some(number.trim_start_matches('v').to_owned());
            own.clone_into(&mut text);
        }
    }
    let version = version
        .or_else(|| said.map(str::to_owned))
        .unwrap_or_else(|| "of unknown version".into());
    if !version.starts_with("1.1") {
        return Err(GrblOpenError::OtherVersion { version });
    }
    match &settings.build_info {
        Some(expected) if *expected != text => Err(GrblOpenError::OtherBoard {
            found: text,
            expected: expected.clone(),
        }),
        _ if text.is_empty() => Ok(version),
        _ => Ok(format!("{version} '{text}'")),
    }
}

fn has_ok(console: &mut Console<'_>) -> Result<bool, GrblOpenError> {
    let until = console.now() + ANSWER_MAX;
    while let Some(incoming) = console.next(until)? {
        if incoming == Incoming::Ok {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Ends a jog that is under way.
fn to_rest(console: &mut Console<'_>) -> Result<Status, GrblOpenError> {
    let start = console.now();
    loop {
        let status = console.status()?;
        if status.state != State::Jog {
            return Ok(status);
        }
        if console.now().since(start) > REST_MAX {
            return Err(GrblOpenError::State("Jog".into()));
        }
        console.write(&[JOG_CANCEL])?;
    }
}

fn unlock(
    console: &mut Console<'_>,
    settings: &GrblSettings,
    status: &Status,
) -> Result<(), GrblOpenError> {
    match status.state {
        State::Idle => Ok(()),
        State::Alarm if settings.is_unlocking => console.ask("$X").map(|_| ()),
        State::Alarm => {
            let reason = if status.has_pin(settings.axis) {
                "its limit switch is closed"
            } else {
                "it wants to be homed or confirmed"
            };
            Err(GrblOpenError::Locked {
                reason: reason.into(),
            })
        }
        other => Err(GrblOpenError::State(format!("{other:?}"))),
    }
}

fn read_settings(console: &mut Console<'_>) -> Result<BTreeMap<u16, f64>, GrblOpenError> {
    let listing = console.ask("$$")?;
    Ok(listing
        .into_iter()
        .filter_map(|incoming| match incoming {
            Incoming::Setting(number, value) => Some((number, value)),
            _ => None,
        })
        .collect())
}

/// A setting; what a board does not have is NaN, which no check lets pass.
fn value(values: &BTreeMap<u16, f64>, number: u16) -> f64 {
    values.get(&number).copied().unwrap_or(f64::NAN)
}

/// Compares with the rig file. Gives the steps a mm.
fn check(settings: &GrblSettings, values: &BTreeMap<u16, f64>) -> Result<f64, GrblOpenError> {
    let axis = settings.index() as u16;
    let otherwise = |number, meaning, wanted: String| GrblOpenError::SetOtherwise {
        number,
        meaning,
        found: value(values, number),
        wanted,
    };
    // Three decimals are stored and shown; 2e-4 of the way is far below what any other part of a rig is known to.
    let steps_per_mm = value(values, 100 + axis);
    if steps_per_mm > 1.0 / MM_PER_STEP_MIN {
        return Err(GrblOpenError::TooFine {
            number: 100 + axis,
            found: steps_per_mm,
        });
    }
    let wanted = 1.0 / settings.mm_per_pulse;
    let is_near = |found: f64, wanted: f64, share: f64| (found - wanted).abs() <= share * wanted;
    if !is_near(steps_per_mm, wanted, 2e-4) {
        return Err(otherwise(
            100 + axis,
            "steps a mm, 1 / mm_per_pulse",
            format!("{wanted:.3}"),
        ));
    }
    let fastest = settings.speed_max.0 * 60.0;
    let rate = value(values, 110 + axis);
    if rate.is_nan() || rate < fastest * (1.0 - 1e-4) {
        return Err(otherwise(
            110 + axis,
            "fastest rate in mm/min, speed_max_mm_s times 60 or more",
            format!("{fastest:.3}"),
        ));
    }
    let acceleration = settings.acceleration.0;
    if !is_near(value(values, 120 + axis), acceleration, 1e-4) {
        return Err(otherwise(
            120 + axis,
            "acceleration in mm/s2",
            format!("{acceleration:.3}"),
        ));
    }
    let flags: [(u16, &'static str, f64); 3] = [
        (
            1,
            "ms until the motor is switched off at rest; 255 leaves it on",
            255.0,
        ),
        (13, "reports in inches", 0.0),
        (
            21,
            "hard limits; on with a home switch on the probe pin, off with one on the limit pin",
            if settings.home == HomeSwitch::Probe {
                1.0
            } else {
                0.0
            },
        ),
    ];
    for (number, meaning, wanted) in flags {
        if value(values, number) != wanted {
            return Err(otherwise(number, meaning, format!("{wanted}")));
        }
    }
    // Bit 0 of `$10`: machine position rather than work position.
    let reports = value(values, 10);
    if reports.is_nan() || reports as i64 & 1 == 0 {
        return Err(otherwise(
            10,
            "status reports; the machine position must be in them",
            "1".into(),
        ));
    }
    let travel = value(values, 130 + axis);
    // The travel matters to Grbl's own limits alone.
    if value(values, 20) != 0.0 && (travel.is_nan() || travel < settings.travel.0) {
        return Err(otherwise(
            130 + axis,
            "travel in mm, travel_mm or more",
            format!("{:.3}", settings.travel.0),
        ));
    }
    Ok(steps_per_mm)
}
