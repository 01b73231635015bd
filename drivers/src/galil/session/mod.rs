//! The dialogue with a controller that has been set up: samples asked for one after the other, commands between them,
//! stops before everything.

mod answers;
mod resync;
mod writing;

use super::clock_alignment::ClockAlignment;
use super::connect::ConnectedGalil;
use super::order::{GalilOrder, TrackingMode};
use super::protocol::{GalilMessage, GalilParser, LINE_MAX, pack_lines};
use super::recording::{self, ArrayRecording};
use super::sampling::Sampler;
use super::settings::GalilSettings;
use super::sine::SineFeed;
use crate::rig::RigEventBody;
use crate::wire::{AnswerQueue, Dialogue, LinkStats, ORDERS_MAX, TOO_MANY_COMMANDS};
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;
use resync::{MARKERS_MAX, QUIET, Resynchronisation};
use std::collections::VecDeque;

/// An answer later than this was lost: TMT's galil-io and M2FS wait 0.5 s for commands that write nothing to flash.
const ANSWER_MAX: Nanos = Nanos::from_millis(400);

const RESET: &str = "the controller was reset; open the rig again";

/// A stop that is sent until the controller has accepted it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PendingStop {
    /// The command it answers; `None` for a stop without a command.
    number: Option<u64>,
    command: RigCommand,
    /// Count of `?` answers, which may be spoilt `:`.
    refusals: u32,
}

impl PendingStop {
    const QUIET: Self = Self { number: None, command: RigCommand::Stop, refusals: 0 };
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ExpectedReply {
    Sample,
    /// A sample behind a command; `true` behind the begin of a motion.
    Marked(bool),
    Elements,
    /// Increments of a sine, which a stop or a limit may have ended before.
    Segment,
    /// The watchdog's variable.
    Renewal,
    Part,
    Stop(PendingStop),
    /// `TC1`, after a refusal of the order under way.
    RefusalReason,
    Marker(u32),
}

#[derive(Clone, Debug, PartialEq)]
struct Outgoing {
    pub text: String,
    pub expects: Vec<ExpectedReply>,
}

impl Outgoing {
    fn one(command: &str, expects: ExpectedReply) -> Self {
        Self { text: format!("{command}\r"), expects: vec![expects] }
    }

    /// Commands in as few lines as hold them; each expects the same.
    fn packed(commands: &[String], expects: ExpectedReply) -> impl Iterator<Item = Self> {
        pack_lines(commands).into_iter().map(move |text| {
            let count = text.matches(';').count() + 1;
            Self { text, expects: vec![expects; count] }
        })
    }
}

/// Speed of the link, measured when the controller was set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PollPace {
    pub every: Nanos,
    pub in_flight: usize,
    pub tick: Nanos,
}

#[derive(Clone, Debug)]
pub struct GalilSession {
    settings: GalilSettings,
    pace: PollPace,
    has_watchdog: bool,
    question: String,
    parser: GalilParser,
    sampler: Sampler,
    recording: Option<ArrayRecording>,
    sine: Option<SineFeed>,
    timing: ClockAlignment,
    expected: VecDeque<(ExpectedReply, Nanos)>,
    urgent: VecDeque<Outgoing>,
    lines: VecDeque<Outgoing>,
    fetches: VecDeque<Outgoing>,
    /// The part of an order that begins something, and when it may go out.
    beginning: Option<(Outgoing, Nanos)>,
    orders: VecDeque<(u64, RigCommand)>,
    order: Option<(u64, GalilOrder)>,
    /// The position tracking mode, while the controller is in it.
    tracking: Option<TrackingMode>,
    answers: AnswerQueue,
    is_motion_begun: bool,
    resync: Option<Resynchronisation>,
    /// Stops whose answers went by while the order was being looked for.
    unconfirmed: Vec<PendingStop>,
    is_reset: bool,
    /// Time of the newest request for samples; the start counts.
    attended_at: Nanos,
    /// Time of the newest stop because no samples were taken.
    abandoned_at: Option<Nanos>,
    polled_at: Option<Nanos>,
    renewed_at: Option<Nanos>,
    answered_at: Nanos,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl GalilSession {
    #[must_use]
    pub fn new(settings: GalilSettings, connected: &ConnectedGalil, now: Nanos) -> Self {
        let recording = connected.plan.map(ArrayRecording::new);
        let question = match &recording {
            Some(_) => recording::question(&settings),
            None => Sampler::question(&settings),
        };
        Self {
            question,
            sampler: Sampler::new(settings.clone()),
            recording,
            sine: None,
            timing: ClockAlignment::default(),
            settings,
            pace: connected.pace,
            has_watchdog: connected.has_watchdog,
            parser: GalilParser::default(),
            expected: VecDeque::new(),
            urgent: VecDeque::new(),
            lines: VecDeque::new(),
            fetches: VecDeque::new(),
            beginning: None,
            orders: VecDeque::new(),
            order: None,
            tracking: None,
            answers: AnswerQueue::default(),
            is_motion_begun: false,
            resync: None,
            unconfirmed: Vec::new(),
            is_reset: false,
            attended_at: now,
            abandoned_at: None,
            polled_at: None,
            renewed_at: None,
            answered_at: now,
            events: VecDeque::new(),
            stats: connected.stats,
        }
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    /// Reports behind all samples that the controller has taken by now.
    fn report_in_order(&mut self, now: Nanos, body: RigEventBody) {
        match &mut self.recording {
            Some(recording) => recording.hold(body),
            None => self.report(now, body),
        }
    }

    fn acknowledge(&mut self, now: Nanos, number: u64, command: RigCommand) {
        for answer in self.answers.acknowledge(number, command) {
            self.report_in_order(now, answer);
        }
    }

    fn refuse(&mut self, now: Nanos, number: u64, detail: impl Into<String>) {
        for answer in self.answers.refuse(number, detail) {
            self.report_in_order(now, answer);
        }
    }
}

impl Dialogue for GalilSession {
    fn note_attendance(&mut self, at: Nanos) {
        self.attended_at = at;
        self.abandoned_at = None;
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            self.stop(now, command);
            return;
        }
        let number = self.answers.owe();
        if self.is_reset {
            self.refuse(now, number, RESET);
        } else if self.orders.len() >= ORDERS_MAX {
            self.refuse(now, number, TOO_MANY_COMMANDS);
        } else {
            self.orders.push_back((number, command));
        }
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        if let Some(resync) = self.resync.as_mut().filter(|_| !bytes.is_empty()) {
            resync.last_byte = now;
        }
        for byte in bytes {
            match self.parser.take(*byte) {
                Some(GalilMessage::Reply(reply)) => self.on_reply(now, &reply),
                // What programs of the controller say is in the log of raw bytes.
                Some(GalilMessage::Unsolicited(_)) => {}
                Some(GalilMessage::Flood) if self.resync.is_none() => self.resynchronise(now),
                Some(GalilMessage::Flood) | None => {}
            }
        }
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_overdue =
            self.expected.front().is_some_and(|(_, sent)| now.since(*sent) > ANSWER_MAX);
        if is_overdue && self.resync.is_none() {
            self.resynchronise(now);
        }
        let line = self.next_line(now)?;
        debug_assert!(line.text.len() <= LINE_MAX, "{}", line.text);
        for expects in line.expects {
            self.expected.push_back((expects, now));
        }
        Some(line.text.into_bytes())
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        if self.resync.is_some() {
            // Often enough to see that the line has become quiet.
            return now + Nanos(QUIET.0 / 10);
        }
        // While answers are on their way nothing is due; their bytes end the wait.
        let is_waiting = self.samples_in_flight() >= self.pace.in_flight
            || self.recording.as_ref().is_some_and(ArrayRecording::is_fetching);
        let due = match &self.beginning {
            Some((_, due)) => *due,
            None if is_waiting => now + QUIET,
            None => self.polled_at.map_or(now, |at| at + self.pace.every),
        };
        let feed_due = self.sine.as_ref().and_then(SineFeed::due);
        feed_due.map_or(due, |feed| feed.min(due)).max(now)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        self.resync?.is_over(now).then(|| {
            format!(
                "the controller gave no valid answer to {MARKERS_MAX} queries; check cable and power"
            )
        })
    }

    fn uncertainty(&self, at: Nanos) -> Option<Nanos> {
        self.timing.uncertainty(at, self.pace.tick)
    }

    fn host_time(&self, tick: u64) -> Option<Nanos> {
        self.timing.host_time(tick, self.pace.tick)
    }

    fn stats(&self) -> LinkStats {
        LinkStats { deviation_max: self.timing.deviation_max, ..self.stats }
    }
}
