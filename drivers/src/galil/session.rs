//! The dialogue with a controller that has been set up: samples asked for one after the other, commands between them,
//! stops before everything.

use super::connect::Connected;
use super::order::{Next, Order};
use super::protocol::{Incoming, LINE_MAX, Parser, Reply, error_of, packed};
use super::recording::{self, Look, Out, Recording};
use super::sampling::{Sampled, Sampler};
use super::search::{MARKERS_MAX, QUIET, Search};
use super::settings::GalilSettings;
use super::sine::Feed;
use super::timing::Timing;
use super::watchdog;
use crate::rig::RigEventBody;
use crate::wire::{Dialogue, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Ack, Fault, RigCommand};
use std::collections::VecDeque;

/// An answer later than this was lost: TMT's galil-io and M2FS wait 0.5 s for commands that write nothing to flash.
const ANSWER_MAX: Nanos = Nanos::from_millis(400);
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
pub(super) enum Asked {
    /// A sample.
    Sample,
    /// A sample behind a command; `true` behind the begin of a motion.
    Marked(bool),
    /// Elements of a recorded array.
    Elements,
    /// Increments of a sine, which a stop or a limit may have ended before.
    Segment,
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
pub(super) struct Outgoing {
    pub text: String,
    pub asked: Vec<Asked>,
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
    pub(super) settings: GalilSettings,
    pace: Pace,
    has_watchdog: bool,
    question: String,
    pub(super) parser: Parser,
    sampler: Sampler,
    pub(super) recording: Option<Recording>,
    pub(super) sine: Option<Feed>,
    timing: Timing,
    pub(super) expected: VecDeque<(Asked, Nanos)>,
    urgent: VecDeque<Outgoing>,
    pub(super) lines: VecDeque<Outgoing>,
    pub(super) fetches: VecDeque<Outgoing>,
    /// The part of an order that begins something, and when it may go out.
    pub(super) beginning: Option<(Outgoing, Nanos)>,
    orders: VecDeque<(u64, RigCommand)>,
    pub(super) order: Option<(u64, Order)>,
    /// Commands in the order in which they came, so that answers come in it too.
    owed: VecDeque<Owed>,
    commands: u64,
    pub(super) is_motion_begun: bool,
    pub(super) search: Option<Search>,
    /// Stops whose answers went by while the order was being looked for.
    pub(super) unconfirmed: Vec<(u64, RigCommand)>,
    /// Why nothing but stops is done any more.
    is_reset: bool,
    attended: Option<Nanos>,
    asked_at: Option<Nanos>,
    renewed_at: Option<Nanos>,
    pub(super) answered_at: Nanos,
    events: VecDeque<(Nanos, RigEventBody)>,
    pub(super) stats: LinkStats,
}

impl Session {
    /// With a controller that was set up just now.
    #[must_use]
    pub fn new(settings: GalilSettings, connected: &Connected, now: Nanos) -> Self {
        let recording = connected.plan.map(Recording::new);
        let question = match &recording {
            Some(_) => recording::question(&settings),
            None => Sampler::question(&settings),
        };
        Self {
            question,
            sampler: Sampler::new(settings.clone()),
            recording,
            sine: None,
            timing: Timing::default(),
            settings,
            pace: connected.pace,
            has_watchdog: connected.has_watchdog,
            parser: Parser::default(),
            expected: VecDeque::new(),
            urgent: VecDeque::new(),
            lines: VecDeque::new(),
            fetches: VecDeque::new(),
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
            self.report_in_order(now, answer);
        }
    }

    fn acknowledge(&mut self, now: Nanos, number: u64, command: RigCommand) {
        self.answer(now, number, RigEventBody::Ack(Ack { command }));
    }

    pub(super) fn refuse(&mut self, now: Nanos, number: u64, detail: impl Into<String>) {
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
        all.push(Asked::Marked(is_begun));
        Outgoing { text, asked: all }
    }

    /// Puts a stop before everything. Motions that wait are not begun any more.
    fn stop(&mut self, now: Nanos, command: RigCommand) {
        self.sine = None;
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

    pub(super) fn urge(&mut self, command: RigCommand, asked: Asked) {
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
            Asked::Sample => self.on_answer(now, sent, reply, None),
            Asked::Marked(is_begun) => self.on_answer(now, sent, reply, Some(is_begun)),
            Asked::Elements => self.on_elements(now, reply),
            Asked::Segment => {
                if !reply.is_accepted && self.sine.take().is_some() {
                    self.end_sine(now, "the controller takes no more of it");
                }
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

    /// The answer to the question, polled or while recording.
    fn on_answer(&mut self, now: Nanos, sent: Nanos, reply: &Reply, marked: Option<bool>) {
        self.stats.push(now.since(sent));
        let Some(numbers) = reply.numbers().filter(|_| reply.is_accepted) else {
            return self.lose_order(now);
        };
        let Some(recording) = &mut self.recording else {
            // Without a recording `_RD` means nothing; a question with it may still be on its way.
            let poll = Look::read(&numbers).map_or(numbers, |look| look.poll.to_vec());
            return self.on_sample(now, Some(sent), &poll, marked == Some(true));
        };
        let Some(look) = Look::read(&numbers) else {
            return self.lose_order(now);
        };
        if self.sampler.is_reset(look.time) {
            self.give_up_recording(now);
            return self.on_sample(now, Some(sent), &look.poll, false);
        }
        match recording.look(look, marked) {
            Ok(()) => {
                self.stats.lost = recording.lost;
                self.timing
                    .push(look.time as u64, self.pace.tick, sent, now);
                self.fetch(now);
            }
            Err(_) => {
                self.give_up_recording(now);
                let detail = "the controller has stopped recording, and samples were lost; open the rig again";
                let fault = Fault::CommandRefused {
                    detail: detail.into(),
                };
                self.report(now, RigEventBody::Fault(fault));
                self.on_sample(now, Some(sent), &look.poll, marked == Some(true));
            }
        }
    }

    /// From here on samples are polled.
    fn give_up_recording(&mut self, now: Nanos) {
        let Some(mut recording) = self.recording.take() else {
            return;
        };
        self.question = Sampler::question(&self.settings);
        for out in recording.drain() {
            self.put_out(now, out);
        }
    }

    /// Asks for elements that are there, and tells what waited when there are none.
    fn fetch(&mut self, now: Nanos) {
        let Some(recording) = &mut self.recording else {
            return;
        };
        if let Some(commands) = recording.fetch() {
            for text in packed(&commands) {
                let asked = vec![Asked::Elements; text.matches(';').count() + 1];
                self.fetches.push_back(Outgoing { text, asked });
            }
        } else if !recording.is_fetching() {
            for out in recording.settled() {
                self.put_out(now, out);
            }
        }
    }

    fn on_elements(&mut self, now: Nanos, reply: &Reply) {
        let Some(recording) = &mut self.recording else {
            // Of a recording that was given up.
            return;
        };
        let column = reply.numbers().filter(|_| reply.is_accepted);
        let out = column.and_then(|column| recording.take(column, &self.settings));
        let Some(out) = out else {
            return self.lose_order(now);
        };
        for out in out {
            self.put_out(now, out);
        }
        if self.search.is_none() {
            self.fetch(now);
        }
    }

    fn put_out(&mut self, now: Nanos, out: Out) {
        match out {
            Out::Event(event) => self.report(now, event),
            Out::Sample(poll, is_begun) => self.on_sample(now, None, &poll, is_begun),
        }
    }

    /// The numbers of a sample, as a poll gives them.
    fn on_sample(&mut self, now: Nanos, sent: Option<Nanos>, numbers: &[f64], is_begun: bool) {
        let is_begun = is_begun || self.is_motion_begun;
        match self.sampler.take(numbers, is_begun) {
            Some(Sampled::Reading(reading)) => {
                self.is_motion_begun = false;
                if let Some(sent) = sent {
                    self.timing.push(reading.tick, self.pace.tick, sent, now);
                }
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

    /// A sine that cannot go on: the axis is stopped.
    pub(super) fn end_sine(&mut self, now: Nanos, why: &str) {
        self.urge(RigCommand::Stop, Asked::QuietStop);
        let fault = Fault::CommandRefused {
            detail: format!("the sine was broken off: {why}"),
        };
        self.report_in_order(now, RigEventBody::Fault(fault));
    }

    /// The controller has forgotten its settings: nothing may move before it is opened again.
    fn on_reset(&mut self, now: Nanos) {
        self.is_reset = true;
        self.timing = Timing::default();
        self.sine = None;
        self.has_watchdog = false;
        self.beginning = None;
        let under_way = self.order.take().map(|(number, _)| number);
        let waiting: Vec<u64> = self.orders.drain(..).map(|(number, _)| number).collect();
        for number in under_way.into_iter().chain(waiting) {
            self.refuse(now, number, RESET);
        }
        self.report(now, RigEventBody::Fault(Fault::ControllerReset));
    }

    fn samples_in_flight(&self) -> usize {
        let is_sample = |asked: &Asked| matches!(asked, Asked::Sample | Asked::Marked(_));
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
        if self.sine.as_ref().is_some_and(|sine| sine.is_dry(now)) {
            self.sine = None;
            self.end_sine(now, "this computer did not send it in time");
            return self.urgent.pop_front();
        }
        if let Some(commands) = self.sine.as_mut().and_then(|sine| sine.take(now)) {
            let asked = vec![Asked::Segment; commands.len()];
            let text = format!("{}\r", commands.join(";"));
            return Some(Outgoing { text, asked });
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
            let mut order = Order::new(command, self.pace.tick);
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
                if let Some(mut feed) = order.feed.take() {
                    feed.begun(now);
                    self.sine = Some(feed);
                }
            }
            self.asked_at = Some(now);
            return Some(line);
        }
        let is_due = self
            .asked_at
            .is_none_or(|at| now.since(at) >= self.pace.every);
        if let Some(line) = self.fetches.pop_front() {
            return Some(line);
        }
        if self.recording.as_ref().is_some_and(Recording::is_fetching) {
            return None;
        }
        if is_due && self.samples_in_flight() < self.pace.in_flight {
            self.asked_at = Some(now);
            return Some(Outgoing {
                text: format!("{}\r", self.question),
                asked: vec![Asked::Sample],
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
        let feed_due = self.sine.as_ref().and_then(Feed::due);
        let due = feed_due.map_or(due, |feed| feed.min(due));
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
        self.search?.is_over(now).then(|| {
            format!(
                "the controller gave no sensible answer to {MARKERS_MAX} questions; check cable and power"
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
        LinkStats {
            deviation_max: self.timing.deviation_max,
            ..self.stats
        }
    }
}
