//! The dialogue with a controller that has been set up: samples asked for one after the other, commands between them,
//! stops before everything.

use super::order::{Next, Order};
use super::protocol::{Incoming, LINE_MAX, Parser, Reply, error_of, packed};
use super::sampling::{Sampled, Sampler};
use super::settings::GalilSettings;
use super::watchdog;
use crate::rig::RigEventBody;
use crate::wire::{Dialogue, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Ack, Fault, RigCommand};
use std::collections::VecDeque;

/// An answer later than this was lost: TMT's galil-io and M2FS wait 0.5 s for commands that write nothing to flash.
const ANSWER_MAX: Nanos = Nanos::from_millis(400);
/// The line is quiet after so long without a byte.
const QUIET: Nanos = Nanos::from_millis(25);
/// So long a marker may take to come back; a controller needs a third of a second to start again.
const MARKER_MAX: Nanos = Nanos::from_millis(350);
/// Markers sent before the link counts as dead: on a line that spoils one byte in fifty all come back spoilt once in
/// four thousand times.
const MARKERS_MAX: u32 = 6;
/// Commands that wait; as many as may wait on the way here.
const ORDERS_MAX: usize = 64;

/// Why a motion is not begun.
const OVERTAKEN: &str = "a stop came first, so it was not begun";
/// Why nothing is done any more.
const RESET: &str = "the controller was reset; open the rig again";

/// Whether a command moves the axis.
const fn is_motion(command: &RigCommand) -> bool {
    matches!(command, RigCommand::MoveTo(_) | RigCommand::Oscillate(_))
}

/// What a prompt still to come belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Asked {
    /// A sample; `true` right behind the begin of a motion.
    Sample(bool),
    /// The watchdog's variable.
    Renewal,
    /// A part of the order under way.
    Part,
    /// A command that stops.
    Stop(u64, RigCommand),
    /// A stop that nobody waits for.
    QuietStop,
    /// `TC1`, after a refusal of the order under way.
    Why,
    /// A number that must come back.
    Marker(u32),
}

/// A command that was not answered for yet.
#[derive(Clone, Debug)]
struct Owed {
    number: u64,
    answer: Option<RigEventBody>,
}

/// A line to be written.
#[derive(Clone, Debug, PartialEq)]
struct Outgoing {
    text: String,
    asked: Vec<Asked>,
}

/// The order of questions and answers is lost and looked for.
#[derive(Clone, Copy, Debug)]
struct Search {
    last_byte: Nanos,
    marker_at: Option<Nanos>,
    markers: u32,
}

/// How fast the link was when the controller was set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Between two questions.
    pub every: Nanos,
    /// Questions that may wait for answers at once.
    pub in_flight: usize,
    /// Length of a sample of the controller.
    pub tick: Nanos,
}

/// The dialogue.
#[derive(Clone, Debug)]
pub struct Session {
    settings: GalilSettings,
    pace: Pace,
    has_watchdog: bool,
    question: String,
    parser: Parser,
    sampler: Sampler,
    expected: VecDeque<(Asked, Nanos)>,
    urgent: VecDeque<Outgoing>,
    lines: VecDeque<Outgoing>,
    /// The part of an order that begins something, and when it may go out.
    beginning: Option<(Outgoing, Nanos)>,
    orders: VecDeque<(u64, RigCommand)>,
    order: Option<(u64, Order)>,
    /// Commands in the order in which they came, so that answers come in it too.
    owed: VecDeque<Owed>,
    commands: u64,
    is_motion_begun: bool,
    search: Option<Search>,
    /// Stops whose answers went by while the order was being looked for.
    unconfirmed: Vec<(u64, RigCommand)>,
    /// Why nothing but stops is done any more.
    is_reset: bool,
    attended: Option<Nanos>,
    asked_at: Option<Nanos>,
    renewed_at: Option<Nanos>,
    answered_at: Nanos,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl Session {
    /// With a controller that was set up just now.
    #[must_use]
    pub fn new(
        settings: GalilSettings,
        pace: Pace,
        has_watchdog: bool,
        stats: LinkStats,
        now: Nanos,
    ) -> Self {
        Self {
            question: Sampler::question(&settings),
            sampler: Sampler::new(settings.clone()),
            settings,
            pace,
            has_watchdog,
            parser: Parser::default(),
            expected: VecDeque::new(),
            urgent: VecDeque::new(),
            lines: VecDeque::new(),
            beginning: None,
            orders: VecDeque::new(),
            order: None,
            owed: VecDeque::new(),
            commands: 0,
            is_motion_begun: false,
            search: None,
            unconfirmed: Vec::new(),
            is_reset: false,
            attended: None,
            asked_at: None,
            renewed_at: None,
            answered_at: now,
            events: VecDeque::new(),
            stats: LinkStats {
                in_flight: pace.in_flight,
                ..stats
            },
        }
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    /// Notes a command that wants an answer.
    fn owe(&mut self) -> u64 {
        self.commands += 1;
        self.owed.push_back(Owed {
            number: self.commands,
            answer: None,
        });
        self.commands
    }

    /// Answers a command; it is told when all before it are answered.
    fn answer(&mut self, now: Nanos, number: u64, answer: RigEventBody) {
        if let Some(owed) = self.owed.iter_mut().find(|owed| owed.number == number) {
            owed.answer = Some(answer);
        }
        while let Some(answer) = self.owed.front_mut().and_then(|owed| owed.answer.take()) {
            self.owed.pop_front();
            self.report(now, answer);
        }
    }

    fn acknowledge(&mut self, now: Nanos, number: u64, command: RigCommand) {
        self.answer(now, number, RigEventBody::Ack(Ack { command }));
    }

    fn refuse(&mut self, now: Nanos, number: u64, detail: impl Into<String>) {
        let detail = detail.into();
        let fault = Fault::CommandRefused { detail };
        self.answer(now, number, RigEventBody::Fault(fault));
    }

    fn with_sample(&self, commands: &[String], is_begun: bool, asked: Asked) -> Outgoing {
        let mut text = commands.join(";");
        text.push(';');
        text.push_str(&self.question);
        text.push('\r');
        let mut all = vec![asked; commands.len()];
        all.push(Asked::Sample(is_begun));
        Outgoing { text, asked: all }
    }

    /// Puts a stop before everything. Motions that wait are not begun any more.
    fn stop(&mut self, now: Nanos, command: RigCommand) {
        let mut ended = Vec::new();
        self.orders.retain(|(number, order)| {
            let stays = !is_motion(order);
            if !stays {
                ended.push(*number);
            }
            stays
        });
        // A motion that is being set ends here; its answers are taken and thrown away.
        let is_ended = |(_, order): &mut (u64, Order)| is_motion(&order.command) && !order.is_begun;
        if let Some((number, _)) = self.order.take_if(is_ended) {
            self.lines.clear();
            self.beginning = None;
            ended.push(number);
        }
        for number in ended {
            self.refuse(now, number, OVERTAKEN);
        }
        let number = self.owe();
        self.urge(command, Asked::Stop(number, command));
    }

    fn urge(&mut self, command: RigCommand, asked: Asked) {
        let axis = self.settings.axis;
        let text = match command {
            // 1: the motion alone, so that the watchdog's program goes on (DMC-40x0 command reference, `AB`).
            RigCommand::Halt => "AB 1".to_owned(),
            _ => format!("ST{axis}"),
        };
        let line = self.with_sample(&[text], false, asked);
        self.urgent.push_back(line);
    }

    fn go_on(&mut self, now: Nanos, next: Next) {
        match next {
            Next::Wait => {}
            Next::Send(commands) => {
                for text in packed(&commands) {
                    let parts = text.matches(';').count() + 1;
                    let asked = vec![Asked::Part; parts];
                    self.lines.push_back(Outgoing { text, asked });
                }
            }
            Next::SendAndSample(commands) => {
                let order = self.order.as_ref();
                let begins = order.is_some_and(|(_, order)| is_motion(&order.command));
                let line = self.with_sample(&commands, begins, Asked::Part);
                // The sample behind the begin is to be a new one, so that the motion begins at its tick: two samples
                // of the controller after the last one that was asked for.
                let pause = Nanos(2 * self.pace.tick.0);
                let from = self.answered_at.max(self.asked_at.unwrap_or(Nanos::ZERO));
                self.beginning = Some((line, from + pause));
            }
            Next::Done(made) => {
                if let Some((number, _)) = self.order.take() {
                    self.acknowledge(now, number, made);
                }
            }
            Next::AskWhy => self.lines.push_back(Outgoing {
                text: "TC1\r".into(),
                asked: vec![Asked::Why],
            }),
            Next::Refused(why) => {
                if let Some((number, _)) = self.order.take() {
                    self.refuse(now, number, why);
                }
            }
        }
    }

    fn on_reply(&mut self, now: Nanos, reply: &Reply) {
        if self.search.is_some() {
            return self.on_reply_while_searching(now, reply);
        }
        let Some((asked, sent)) = self.expected.pop_front() else {
            return self.lose_order(now);
        };
        self.answered_at = now;
        match asked {
            Asked::Sample(is_begun) => {
                self.stats.push(now.since(sent));
                self.on_sample(now, reply, is_begun);
            }
            Asked::Renewal => {
                // A refusal is a program that is gone, which a reset explains; the clock will tell.
                if !reply.bytes.is_empty() {
                    self.lose_order(now);
                }
            }
            Asked::Part => {
                let settings = self.settings.clone();
                // Answers of an order that a stop has ended belong to nobody.
                if let Some((_, order)) = &mut self.order {
                    let next = order.take(reply, &settings);
                    self.go_on(now, next);
                }
            }
            Asked::Stop(number, command) if reply.is_accepted && reply.bytes.is_empty() => {
                self.acknowledge(now, number, command);
            }
            Asked::Stop(number, command) if reply.is_accepted => {
                self.unconfirmed.push((number, command));
                self.lose_order(now);
            }
            Asked::Stop(number, command) => {
                self.refuse(now, number, format!("it refuses {command:?}"));
            }
            Asked::QuietStop => {}
            Asked::Why => {
                if let Some((number, _)) = self.order.take() {
                    let why = error_of(reply).map(|err| err.to_string());
                    let why = why.unwrap_or_else(|| "it does not say why".into());
                    self.refuse(now, number, why);
                }
            }
            Asked::Marker(_) => {}
        }
    }

    fn on_sample(&mut self, now: Nanos, reply: &Reply, is_begun: bool) {
        let numbers = reply.numbers().filter(|_| reply.is_accepted);
        let is_begun = is_begun || self.is_motion_begun;
        let sampled = numbers.and_then(|numbers| self.sampler.take(&numbers, is_begun));
        match sampled {
            Some(Sampled::Reading(reading)) => {
                self.is_motion_begun = false;
                self.report(now, RigEventBody::Reading(reading));
            }
            Some(Sampled::Same) => self.is_motion_begun = is_begun,
            Some(Sampled::Reset) => {
                self.is_motion_begun = false;
                self.on_reset(now);
            }
            None => self.lose_order(now),
        }
    }

    /// The controller has forgotten its settings: nothing may move before it is opened again.
    fn on_reset(&mut self, now: Nanos) {
        self.is_reset = true;
        self.has_watchdog = false;
        self.beginning = None;
        let under_way = self.order.take().map(|(number, _)| number);
        let waiting: Vec<u64> = self.orders.drain(..).map(|(number, _)| number).collect();
        for number in under_way.into_iter().chain(waiting) {
            self.refuse(now, number, RESET);
        }
        self.report(now, RigEventBody::Fault(Fault::ControllerReset));
    }

    /// Answers and questions do not belong together any more: bytes were lost, doubled or spoilt.
    fn lose_order(&mut self, now: Nanos) {
        self.stats.resynchronised += 1;
        self.parser.clear();
        for (asked, _) in self.expected.drain(..) {
            if let Asked::Stop(number, command) = asked {
                self.unconfirmed.push((number, command));
            }
        }
        self.lines.clear();
        self.beginning = None;
        self.is_motion_begun = false;
        if let Some((number, _)) = self.order.take() {
            // It may or may not be under way: to be safe, it is not.
            self.refuse(
                now,
                number,
                "its answer was garbled, so the axis was stopped; check the cable",
            );
            self.urge(RigCommand::Stop, Asked::QuietStop);
        }
        self.search = Some(Search {
            last_byte: now,
            marker_at: None,
            markers: 0,
        });
    }

    fn on_reply_while_searching(&mut self, now: Nanos, reply: &Reply) {
        let Some((Asked::Marker(number), _)) = self.expected.front() else {
            return;
        };
        if reply.numbers() == Some(vec![f64::from(*number)]) {
            self.expected.clear();
            self.search = None;
            self.answered_at = now;
            for (number, command) in std::mem::take(&mut self.unconfirmed) {
                self.urge(command, Asked::Stop(number, command));
            }
        }
    }

    /// The next marker, once the line has become quiet.
    fn search_line(&mut self, now: Nanos) -> Option<Outgoing> {
        let search = self.search.as_mut()?;
        let is_due = match search.marker_at {
            None => now.since(search.last_byte) >= QUIET,
            Some(at) => now.since(at) >= MARKER_MAX,
        };
        if !is_due || search.markers >= MARKERS_MAX {
            return None;
        }
        search.markers += 1;
        search.marker_at = Some(now);
        self.parser.clear();
        self.expected.clear();
        // A number that no sample begins with, and another one each time.
        let number = 27_180 + search.markers;
        Some(Outgoing {
            text: format!("MG {number}\r"),
            asked: vec![Asked::Marker(number)],
        })
    }

    fn samples_in_flight(&self) -> usize {
        let is_sample = |asked: &Asked| matches!(asked, Asked::Sample(_));
        self.expected
            .iter()
            .filter(|(asked, _)| is_sample(asked))
            .count()
    }

    fn is_renewal_due(&self, now: Nanos) -> bool {
        let is_attended = self.attended.is_some_and(|at| now.since(at) < ATTENDED_MAX);
        self.has_watchdog
            && is_attended
            && self
                .renewed_at
                .is_none_or(|at| now.since(at) >= watchdog::RENEW)
    }

    fn next_line(&mut self, now: Nanos) -> Option<Outgoing> {
        if let Some(line) = self.urgent.pop_front() {
            if let Some(search) = &mut self.search {
                // Its answers go by unseen; it will be asked for again.
                search.marker_at = None;
                search.last_byte = now;
                for asked in &line.asked {
                    if let Asked::Stop(number, command) = asked {
                        self.unconfirmed.push((*number, *command));
                    }
                }
                return Some(Outgoing {
                    asked: Vec::new(),
                    ..line
                });
            }
            return Some(line);
        }
        if self.search.is_some() {
            return self.search_line(now);
        }
        if self.is_renewal_due(now) {
            self.renewed_at = Some(now);
            return Some(Outgoing {
                text: format!("{}=1\r", watchdog::VARIABLE),
                asked: vec![Asked::Renewal],
            });
        }
        // Answers of an order that a stop has ended may still be on their way.
        let has_answers_to_come = self
            .expected
            .iter()
            .any(|(asked, _)| matches!(asked, Asked::Part | Asked::Why));
        if self.order.is_none()
            && !has_answers_to_come
            && let Some((number, command)) = self.orders.pop_front()
        {
            let mut order = Order::new(command);
            let next = order.begin(&self.settings);
            self.order = Some((number, order));
            self.go_on(now, next);
        }
        if let Some(line) = self.lines.pop_front() {
            return Some(line);
        }
        if let Some((_, due)) = &self.beginning {
            if now < *due {
                return None;
            }
            let (line, _) = self.beginning.take()?;
            if let Some((_, order)) = &mut self.order {
                order.is_begun = true;
            }
            self.asked_at = Some(now);
            return Some(line);
        }
        let is_due = self
            .asked_at
            .is_none_or(|at| now.since(at) >= self.pace.every);
        if is_due && self.samples_in_flight() < self.pace.in_flight {
            self.asked_at = Some(now);
            return Some(Outgoing {
                text: format!("{}\r", self.question),
                asked: vec![Asked::Sample(false)],
            });
        }
        None
    }
}

/// The watchdog is renewed only while somebody takes samples: a computer whose palpate hangs is silent too.
const ATTENDED_MAX: Nanos = Nanos::from_millis(500);

impl Dialogue for Session {
    fn attended(&mut self, at: Nanos) {
        self.attended = Some(at);
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            self.stop(now, command);
            return;
        }
        let number = self.owe();
        if self.is_reset {
            self.refuse(now, number, RESET);
        } else if self.orders.len() >= ORDERS_MAX {
            self.refuse(now, number, "too many commands at once");
        } else {
            self.orders.push_back((number, command));
        }
    }

    fn overtaken(&mut self, now: Nanos, command: RigCommand) {
        // The stop that comes next ends it, if it is a motion.
        self.command(now, command);
    }

    fn received(&mut self, now: Nanos, bytes: &[u8]) {
        if let Some(search) = self.search.as_mut().filter(|_| !bytes.is_empty()) {
            search.last_byte = now;
        }
        for byte in bytes {
            match self.parser.take(*byte) {
                Some(Incoming::Reply(reply)) => self.on_reply(now, &reply),
                // What programs of the controller say is in the log of raw bytes.
                Some(Incoming::Unasked(_)) => {}
                Some(Incoming::Flood) if self.search.is_none() => self.lose_order(now),
                Some(Incoming::Flood) | None => {}
            }
        }
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_overdue = self
            .expected
            .front()
            .is_some_and(|(_, sent)| now.since(*sent) > ANSWER_MAX);
        if is_overdue && self.search.is_none() {
            self.lose_order(now);
        }
        let line = self.next_line(now)?;
        debug_assert!(line.text.len() <= LINE_MAX, "{}", line.text);
        for asked in line.asked {
            self.expected.push_back((asked, now));
        }
        Some(line.text.into_bytes())
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        if self.search.is_some() {
            // Often enough to see that the line has become quiet.
            return now + Nanos(QUIET.0 / 10);
        }
        let due = match &self.beginning {
            Some((_, due)) => *due,
            None => self.asked_at.map_or(now, |at| at + self.pace.every),
        };
        if self.samples_in_flight() < self.pace.in_flight || self.beginning.is_some() {
            due.max(now)
        } else {
            now + QUIET
        }
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        let search = self.search?;
        let is_over = search.markers >= MARKERS_MAX
            && search
                .marker_at
                .is_some_and(|at| now.since(at) >= MARKER_MAX);
        is_over.then(|| {
            format!(
                "the controller gave no sensible answer to {MARKERS_MAX} questions; check cable and power"
            )
        })
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}
