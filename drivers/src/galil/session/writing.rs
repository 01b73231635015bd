//! What is written next: stops before everything, then the watchdog, increments of a sine, commands, questions.

use super::{Asked, Halting, OVERTAKEN, Outgoing, Session};
use crate::galil::order::{Next, Order};
use crate::galil::protocol::packed;
use crate::galil::recording::Recording;
use crate::galil::watchdog;
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

/// The watchdog is renewed, and the axis left to move, only while somebody takes samples: a computer whose palpate hangs
/// is silent too.
const ATTENDED_MAX: Nanos = Nanos::from_millis(500);

/// Why an axis is stopped that nobody looks after.
const ABANDONED: &str = "nobody took samples for half a second, so the axis was stopped";

impl Session {
    pub(super) fn with_sample(
        &self,
        commands: &[String],
        is_begun: bool,
        asked: Asked,
    ) -> Outgoing {
        let mut text = commands.join(";");
        text.push(';');
        text.push_str(&self.question);
        text.push('\r');
        let mut all = vec![asked; commands.len()];
        all.push(Asked::Marked(is_begun));
        Outgoing { text, asked: all }
    }

    /// Puts a stop before everything. Motions that wait are not begun any more.
    pub(super) fn stop(&mut self, now: Nanos, command: RigCommand) {
        self.sine = None;
        self.drop_motions(now, OVERTAKEN);
        let number = self.answers.owe();
        let halting = Halting { number: Some(number), command, refusals: 0 };
        self.urge(command, Asked::Stop(halting));
    }

    /// Refuses motions that wait or are being set.
    fn drop_motions(&mut self, now: Nanos, why: &str) {
        let mut ended = Vec::new();
        self.orders.retain(|(number, order)| {
            let stays = !order.is_motion();
            if !stays {
                ended.push(*number);
            }
            stays
        });
        // A motion that is being set ends here; its answers are taken and thrown away.
        let is_ended = |(_, order): &mut (u64, Order)| order.command.is_motion() && !order.is_begun;
        if let Some((number, _)) = self.order.take_if(is_ended) {
            self.lines.clear();
            self.beginning = None;
            ended.push(number);
        }
        for number in ended {
            self.refuse(now, number, why);
        }
    }

    /// Stops an axis that may move while nobody takes samples, again and again until somebody does: a computer that hangs
    /// has nobody to stop it, and a controller without the watchdog's program would go on.
    fn stop_if_abandoned(&mut self, now: Nanos) {
        let is_due = now.since(self.abandoned_at.unwrap_or(self.attended)) > ATTENDED_MAX;
        if !is_due || !self.may_move() {
            return;
        }
        self.abandoned_at = Some(now);
        self.drop_motions(now, ABANDONED);
        if self.sine.take().is_some() {
            self.end_sine(now, ABANDONED);
        } else {
            self.urge(RigCommand::Stop, Asked::Stop(Halting::QUIET));
        }
    }

    /// Whether the axis moves, as far as is known, or is to move.
    fn may_move(&self) -> bool {
        let orders = self.order.iter().map(|(_, order)| &order.command);
        let mut orders = orders.chain(self.orders.iter().map(|(_, command)| command));
        self.sine.is_some() || self.sampler.is_moving() || orders.any(RigCommand::is_motion)
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

    pub(super) fn go_on(&mut self, now: Nanos, next: Next) {
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
                let begins = order.is_some_and(|(_, order)| order.command.is_motion());
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
            Next::AskWhy => {
                self.lines.push_back(Outgoing { text: "TC1\r".into(), asked: vec![Asked::Why] })
            }
            Next::Refused(why) => {
                if let Some((number, _)) = self.order.take() {
                    self.refuse(now, number, why);
                }
            }
        }
    }

    pub(super) fn samples_in_flight(&self) -> usize {
        let is_sample = |asked: &Asked| matches!(asked, Asked::Sample | Asked::Marked(_));
        self.expected.iter().filter(|(asked, _)| is_sample(asked)).count()
    }

    pub(super) fn is_renewal_due(&self, now: Nanos) -> bool {
        let is_attended = now.since(self.attended) < ATTENDED_MAX;
        self.has_watchdog
            && is_attended
            && self.renewed_at.is_none_or(|at| now.since(at) >= watchdog::RENEW)
    }

    pub(super) fn next_line(&mut self, now: Nanos) -> Option<Outgoing> {
        self.stop_if_abandoned(now);
        if let Some(line) = self.take_urgent(now) {
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
        let has_answers_to_come =
            self.expected.iter().any(|(asked, _)| matches!(asked, Asked::Part | Asked::Why));
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
        match &self.beginning {
            Some((_, due)) if now < *due => return None,
            Some(_) => return self.take_beginning(now),
            None => {}
        }
        let is_due = self.asked_at.is_none_or(|at| now.since(at) >= self.pace.every);
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

    /// A stop, or whatever else waits for nothing.
    fn take_urgent(&mut self, now: Nanos) -> Option<Outgoing> {
        let line = self.urgent.pop_front()?;
        let Some(search) = &mut self.search else {
            return Some(line);
        };
        // Its answers go by unseen; it will be asked for again.
        search.marker_at = None;
        search.last_byte = now;
        for asked in &line.asked {
            if let Asked::Stop(halting) = asked {
                self.confirm_later(*halting);
            }
        }
        Some(Outgoing { asked: Vec::new(), ..line })
    }

    /// The part of an order that begins something.
    fn take_beginning(&mut self, now: Nanos) -> Option<Outgoing> {
        let (line, _) = self.beginning.take()?;
        if let Some((_, order)) = &mut self.order {
            order.is_begun = true;
            if let Some(mut feed) = order.feed.take() {
                feed.begun(now);
                self.sine = Some(feed);
            }
        }
        self.asked_at = Some(now);
        Some(line)
    }
}
