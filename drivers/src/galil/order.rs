//! One command of palpate as commands of the controller, and the answers that must come back.

use super::protocol::GalilReply;
use super::sampling::parse_register;
use super::settings::GalilSettings;
use super::sine::SineFeed;
use palpate_model::Nanos;
use palpate_model::rig::{MoveTo, Oscillation, RigCommand, SinePath};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds};

/// Speed and acceleration in counts that a controller in the position tracking mode has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TrackingRates {
    speed: i64,
    acceleration: i64,
}

/// The position tracking mode as it was set, and as the controller made it of that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackingMode {
    asked: TrackingRates,
    made: TrackingRates,
}

/// Software limits are this far beyond the travel and behind home, in mm: behind the limit switches of a slide, which
/// are within 5 mm, and before its mechanical ends. They stop the axis when both palpate and a switch fail.
pub const LIMIT_MARGIN_MM: f64 = 5.0;

const NO_NUMBERS: &str = "the controller's answer does not contain the expected numbers";

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Setting,
    /// The part that counts was sent, for a command as it was set.
    Doing(RigCommand),
}

#[derive(Clone, Debug, PartialEq)]
pub enum OrderStep {
    Wait,
    /// Send these, each answered by a prompt.
    Send(Vec<String>),
    /// Send these, and behind them ask for a sample.
    SendAndSample(Vec<String>),
    Done(RigCommand),
    /// The controller refused a part of it: ask why.
    ReadReason,
    Refused(String),
}

#[derive(Clone, Debug)]
pub struct GalilOrder {
    pub command: RigCommand,
    stage: Stage,
    open: usize,
    numbers: Vec<f64>,
    is_refused: bool,
    /// The part that counts was written, so that the axis may already be doing it.
    pub is_begun: bool,
    tick: Nanos,
    /// The mode in which the controller is, if it takes targets on the way.
    pub tracking: Option<TrackingMode>,
    /// The increments that follow the beginning of a sine.
    pub feed: Option<SineFeed>,
}

impl GalilOrder {
    /// A command that was not begun, for samples of this length.
    #[must_use]
    pub const fn new(command: RigCommand, tick: Nanos) -> Self {
        Self {
            command,
            tick,
            tracking: None,
            feed: None,
            stage: Stage::Setting,
            open: 0,
            numbers: Vec::new(),
            is_refused: false,
            is_begun: false,
        }
    }

    pub fn begin(&mut self, settings: &GalilSettings) -> OrderStep {
        let a = settings.axis;
        let commands = match self.command {
            RigCommand::EnableMotor => {
                self.stage = Stage::Doing(self.command);
                vec![format!("SH{a}"), format!("MG _MO{a}")]
            }
            RigCommand::MoveTo(wanted) => match move_rates(&wanted, settings) {
                Ok(rates) => {
                    let mut commands = rate_commands(a, rates);
                    commands.extend([
                        format!("PA{a}={}", settings.sign() * wanted.target_pulses),
                        format!("MG _SP{a},_AC{a},_DC{a}"),
                        format!("PA{a}=?"),
                    ]);
                    if self.tracking.is_some() {
                        // In that mode a target would take effect before the axis is begun.
                        commands.insert(0, format!("PT{a}=0"));
                    }
                    commands
                }
                Err(why) => return OrderStep::Refused(why),
            },
            RigCommand::Track(wanted) => match move_rates(&wanted, settings) {
                Ok(rates) => {
                    if let Some(mode) = self.tracking.filter(|mode| mode.asked == rates) {
                        let made = made_move(&wanted, mode.made, settings);
                        return self.send_target(made, settings);
                    }
                    let mut commands = rate_commands(a, rates);
                    if self.tracking.is_none() {
                        // A target that a stop left behind must not count when the mode begins.
                        commands.push(format!("PA{a}={}", settings.sign() * wanted.target_pulses));
                    }
                    commands.push(format!("PT{a}=1"));
                    commands.push(format!("MG _PT{a},_SP{a},_AC{a},_DC{a}"));
                    commands
                }
                Err(why) => return OrderStep::Refused(why),
            },
            RigCommand::DefinePosition { .. } => {
                let (forward, reverse) = software_limits(settings, 0, settings.travel.0);
                limit_commands(a, forward, reverse)
            }
            RigCommand::Oscillate(wanted) => {
                let length = Seconds(self.tick.seconds().0);
                let path = SinePath::new(Position(0.0), &wanted, settings.mm_per_pulse, length);
                if let Err(why) = path.check(settings.speed_max, wanted.acceleration) {
                    return OrderStep::Refused(why);
                }
                let rate = settings.counts(wanted.acceleration.0);
                let mode = self.tracking.map(|_| format!("PT{a}=0"));
                let set = [format!("AC{a}={rate}"), format!("DC{a}={rate}")];
                mode.into_iter().chain(set).chain([format!("MG _AC{a},_DC{a}")]).collect()
            }
            RigCommand::Stop | RigCommand::Halt => {
                return OrderStep::Refused("a stop cannot be queued behind other commands".into());
            }
        };
        self.open = commands.len();
        OrderStep::Send(commands)
    }

    pub fn take(&mut self, reply: &GalilReply, settings: &GalilSettings) -> OrderStep {
        self.open = self.open.saturating_sub(1);
        if reply.is_accepted {
            self.numbers.extend(reply.numbers().unwrap_or_default());
        } else {
            self.is_refused = true;
        }
        if self.open > 0 {
            return OrderStep::Wait;
        }
        if self.is_refused {
            return OrderStep::ReadReason;
        }
        match self.stage {
            Stage::Setting => self.send_main_part(settings),
            Stage::Doing(made) => self.done(made, settings),
        }
    }

    /// Compares what was set with what was asked, and sends the part that begins something.
    fn send_main_part(&mut self, settings: &GalilSettings) -> OrderStep {
        let a = settings.axis;
        let numbers = std::mem::take(&mut self.numbers);
        let (made, commands) = match (self.command, numbers.as_slice()) {
            (RigCommand::MoveTo(wanted), &[speed, ac, dc, target]) => {
                let target = parse_register(target).map(|target| settings.sign() * target);
                if target != Some(wanted.target_pulses) {
                    return OrderStep::Refused(other_target(wanted.target_pulses));
                }
                match check_rates(&wanted, [speed, ac, dc], settings) {
                    Ok(rates) => {
                        let made = made_move(&wanted, rates, settings);
                        (RigCommand::MoveTo(made), vec![format!("BG{a}")])
                    }
                    Err(why) => return OrderStep::Refused(why),
                }
            }
            (RigCommand::Track(wanted), &[mode, speed, ac, dc]) => {
                if mode != 1.0 {
                    let why = "the controller does not enter the position tracking mode (PT)";
                    return OrderStep::Refused(why.into());
                }
                return match check_rates(&wanted, [speed, ac, dc], settings) {
                    Ok(made) => {
                        let asked = move_rates(&wanted, settings);
                        self.tracking = asked.ok().map(|asked| TrackingMode { asked, made });
                        self.send_target(made_move(&wanted, made, settings), settings)
                    }
                    Err(why) => OrderStep::Refused(why),
                };
            }
            (RigCommand::DefinePosition { pulses }, &[forward, reverse]) => {
                let wanted = software_limits(settings, 0, settings.travel.0);
                if (parse_register(forward), parse_register(reverse))
                    != (Some(wanted.0), Some(wanted.1))
                {
                    return OrderStep::Refused(format!(
                        "the controller reports software limits {forward} and {reverse} after {} and {} were set",
                        wanted.0, wanted.1
                    ));
                }
                let define = format!("DP{a}={}", settings.sign() * pulses);
                (self.command, vec![define])
            }
            (RigCommand::Oscillate(wanted), &[ac, dc]) => {
                let ac_asked = settings.counts(wanted.acceleration.0) as f64;
                if ac != dc || ac <= 0.0 || ac > ac_asked {
                    return OrderStep::Refused(format!(
                        "the controller reports acceleration {ac} and deceleration {dc} in counts, after {ac_asked} was set for both"
                    ));
                }
                let made =
                    Oscillation { acceleration: MmPerS2(ac * settings.mm_per_pulse), ..wanted };
                let feed = self.feed.insert(SineFeed::new(&made, settings, self.tick));
                (RigCommand::Oscillate(made), feed.begin())
            }
            _ => {
                return OrderStep::Refused(NO_NUMBERS.into());
            }
        };
        self.stage = Stage::Doing(made);
        self.open = commands.len();
        OrderStep::SendAndSample(commands)
    }

    /// The target, which takes effect at once, and the questions whether it is the one that was sent and whether the mode
    /// is still on: the watchdog's stop ends it too.
    fn send_target(&mut self, made: MoveTo, settings: &GalilSettings) -> OrderStep {
        let a = settings.axis;
        let target = settings.sign() * made.target_pulses;
        let commands = vec![format!("PA{a}={target}"), format!("PA{a}=?"), format!("MG _PT{a}")];
        self.stage = Stage::Doing(RigCommand::Track(made));
        self.open = commands.len();
        OrderStep::SendAndSample(commands)
    }

    /// Whether it changes the target of an axis that may be under way.
    pub fn is_target(&self) -> bool {
        matches!(self.stage, Stage::Doing(RigCommand::Track(_)))
    }

    fn done(&self, made: RigCommand, settings: &GalilSettings) -> OrderStep {
        if let RigCommand::Track(track) = made {
            let &[target, mode] = self.numbers.as_slice() else {
                return OrderStep::Refused(NO_NUMBERS.into());
            };
            if mode != 1.0 {
                return OrderStep::Refused(
                    "the controller has left the position tracking mode (PT); check what else commands it".into(),
                );
            }
            let target = parse_register(target).map(|target| settings.sign() * target);
            if target != Some(track.target_pulses) {
                return OrderStep::Refused(other_target(track.target_pulses));
            }
        }
        // The number is `_MO`: 1 while the motor is off.
        if self.command == RigCommand::EnableMotor && self.numbers != [0.0] {
            let why = "the motor stays off after SH; check the amplifier and its enable input";
            return OrderStep::Refused(why.into());
        }
        OrderStep::Done(made)
    }
}

/// Speed and acceleration of a move in counts, or why the rig cannot make it.
fn move_rates(wanted: &MoveTo, settings: &GalilSettings) -> Result<TrackingRates, String> {
    let rates = TrackingRates {
        speed: settings.counts(wanted.speed.0),
        acceleration: settings.counts(wanted.acceleration.0),
    };
    if wanted.speed.0 > settings.speed_max.0 * (1.0 + 1e-9) || rates.speed < 1 {
        return Err(format!(
            "a speed of {} is not between one pulse a second and the maximum of the rig file, {}",
            wanted.speed, settings.speed_max
        ));
    }
    Ok(rates)
}

fn rate_commands(axis: char, TrackingRates { speed, acceleration }: TrackingRates) -> Vec<String> {
    vec![
        format!("SP{axis}={speed}"),
        format!("AC{axis}={acceleration}"),
        format!("DC{axis}={acceleration}"),
    ]
}

/// Speed, acceleration and deceleration as they are read back, compared with the request.
fn check_rates(
    wanted: &MoveTo,
    [speed, ac, dc]: [f64; 3],
    settings: &GalilSettings,
) -> Result<TrackingRates, String> {
    // The controller rounds down to its resolution; a larger value is an error.
    let speed_asked = settings.counts(wanted.speed.0) as f64;
    let ac_asked = settings.counts(wanted.acceleration.0) as f64;
    if ac != dc || speed <= 0.0 || speed > speed_asked || ac <= 0.0 || ac > ac_asked {
        return Err(format!(
            "the controller reports speed {speed}, acceleration {ac} and deceleration {dc} in counts, after speed {speed_asked} and acceleration {ac_asked} were set"
        ));
    }
    Ok(TrackingRates { speed: speed as i64, acceleration: ac as i64 })
}

fn made_move(wanted: &MoveTo, rates: TrackingRates, settings: &GalilSettings) -> MoveTo {
    MoveTo {
        target_pulses: wanted.target_pulses,
        speed: MmPerS(rates.speed as f64 * settings.mm_per_pulse),
        acceleration: MmPerS2(rates.acceleration as f64 * settings.mm_per_pulse),
    }
}

fn other_target(pulses: i64) -> String {
    format!("the controller reports a target other than {pulses} pulses")
}

/// Software limits in the controller's counts, forward and reverse, around places from `here_pulses` on over `way_mm`.
#[must_use]
pub fn software_limits(settings: &GalilSettings, here_pulses: i64, way_mm: f64) -> (i64, i64) {
    let pulses = |mm: f64| (mm / settings.mm_per_pulse).round() as i64;
    let far = here_pulses + pulses(way_mm + LIMIT_MARGIN_MM);
    let near = here_pulses - pulses(LIMIT_MARGIN_MM);
    let (far, near) = (settings.sign() * far, settings.sign() * near);
    (far.max(near), far.min(near))
}

/// Sets software limits and reads them back (`FL`, `BL`).
#[must_use]
pub fn limit_commands(axis: char, forward: i64, reverse: i64) -> Vec<String> {
    vec![
        format!("FL{axis}={forward}"),
        format!("BL{axis}={reverse}"),
        format!("MG _FL{axis},_BL{axis}"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::galil::settings::tests::thesis;

    /// What becomes of an order whose numbers are read back so.
    fn read_back(command: RigCommand, readback: &[&str]) -> OrderStep {
        let settings = thesis();
        let mut order = GalilOrder::new(command, Nanos(976_563));
        let OrderStep::Send(commands) = order.begin(&settings) else {
            panic!("it is not set");
        };
        let first = commands.len() - readback.len();
        let answers = std::iter::repeat_n("", first).chain(readback.iter().copied());
        let mut next = OrderStep::Wait;
        for text in answers {
            let reply = GalilReply { is_accepted: true, bytes: text.into() };
            next = order.take(&reply, &settings);
        }
        next
    }

    #[test]
    fn nothing_faster_than_asked_for_and_nothing_without_a_rate_is_begun() {
        let wanted =
            MoveTo { target_pulses: 1000, speed: MmPerS(0.75), acceleration: MmPerS2(61.44) };
        for (readback, is_begun) in [
            (" 50 4096 4096", true),
            (" 48 3072 3072", true),
            (" 52 4096 4096", false),
            (" 500 4096 4096", false),
            (" 50 5120 5120", false),
            // An axis without acceleration would not begin.
            (" 50 0 0", false),
        ] {
            let next = read_back(RigCommand::MoveTo(wanted), &[readback, " 1000"]);
            let begins = matches!(next, OrderStep::SendAndSample(_));
            assert_eq!(begins, is_begun, "{readback}: {next:?}");
        }
    }
}
