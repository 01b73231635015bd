//! The order of writing: stops before everything, then the watchdog, increments of a sine, commands, questions.

use super::{ExpectedReply, GalilSession, Outgoing, PendingStop};
use crate::galil::order::{GalilOrder, OrderStep};
use crate::galil::recording::ArrayRecording;
use crate::galil::watchdog;
use crate::wire::{ATTENDED_MAX, OVERTAKEN};
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

const ABANDONED: &str = "no samples were taken for half a second, so the axis was stopped";

impl GalilSession {
    pub(super) fn with_sample(
        &self,
        commands: &[String],
        is_begun: bool,
        expects: ExpectedReply,
    ) -> Outgoing {
        let mut text = commands.join(";");
        text.push(';');
        text.push_str(&self.question);
        text.push('\r');
        let mut all = vec![expects; commands.len()];
        all.push(ExpectedReply::Marked(is_begun));
        Outgoing { text, expects: all }
    }

    /// Puts a stop before everything. Motions that wait are not begun any more.
    pub(super) fn stop(&mut self, now: Nanos, command: RigCommand) {
        self.sine = None;
        self.drop_motions(now, OVERTAKEN);
        let number = self.answers.owe();
        let stop = PendingStop { number: Some(number), command, refusals: 0 };
        self.send_urgent(command, ExpectedReply::Stop(stop));
    }

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
        let is_ended =
            |(_, order): &mut (u64, GalilOrder)| order.command.is_motion() && !order.is_begun;
        if let Some((number, _)) = self.order.take_if(is_ended) {
            self.lines.clear();
            self.beginning = None;
            ended.push(number);
        }
        for number in ended {
            self.refuse(now, number, why);
        }
    }

    /// Stops an axis that may move while no samples are taken, repeatedly until they are: if palpate hangs, the
    /// operator cannot stop it from there, and a controller without the watchdog's program would go on.
    fn stop_if_abandoned(&mut self, now: Nanos) {
        let is_due = now.since(self.abandoned_at.unwrap_or(self.attended_at)) > ATTENDED_MAX;
        if !is_due || !self.may_move() {
            return;
        }
        self.abandoned_at = Some(now);
        self.drop_motions(now, ABANDONED);
        if self.sine.take().is_some() {
            self.end_sine(now, ABANDONED);
        } else {
            self.send_urgent(RigCommand::Stop, ExpectedReply::Stop(PendingStop::QUIET));
        }
    }

    /// Whether the axis moves, as far as is known, or is to move.
    fn may_move(&self) -> bool {
        let orders = self.order.iter().map(|(_, order)| &order.command);
        let mut orders = orders.chain(self.orders.iter().map(|(_, command)| command));
        self.sine.is_some() || self.sampler.is_moving() || orders.any(RigCommand::is_motion)
    }

    pub(super) fn send_urgent(&mut self, command: RigCommand, expects: ExpectedReply) {
        let axis = self.settings.axis;
        // A stop ends the position tracking mode (DMC-40x0 command reference, `PT`).
        self.tracking = None;
        if let Some((_, order)) = &mut self.order {
            order.tracking = None;
        }
        let text = match command {
            // 1: the motion alone, so that the watchdog's program goes on (DMC-40x0 command reference, `AB`).
            RigCommand::Halt => "AB 1".to_owned(),
            _ => format!("ST{axis}"),
        };
        let line = self.with_sample(&[text], false, expects);
        self.urgent.push_back(line);
    }

    pub(super) fn apply_step(&mut self, now: Nanos, next: OrderStep) {
        match next {
            OrderStep::Wait => {}
            OrderStep::Send(commands) => {
                self.lines.extend(Outgoing::packed(&commands, ExpectedReply::Part));
            }
            OrderStep::SendAndSample(commands) => {
                let order = self.order.as_ref();
                let begins = order.is_some_and(|(_, order)| order.command.is_motion());
                // A target on the way waits for nothing: when it takes effect need be known to a few samples only.
                let is_target = order.is_some_and(|(_, order)| order.is_target());
                let line = self.with_sample(&commands, begins, ExpectedReply::Part);
                // The sample behind the begin is to be a new one, so that the motion begins at its tick: two samples
                // of the controller after the last one that was asked for.
                let pause = Nanos(2 * self.pace.tick.0);
                let from = self.answered_at.max(self.polled_at.unwrap_or(Nanos::ZERO));
                let due = if is_target { now } else { from + pause };
                self.beginning = Some((line, due));
            }
            OrderStep::Done(made) => {
                if let Some((number, order)) = self.order.take() {
                    if order.command.is_motion() {
                        self.tracking = order.tracking.filter(|_| order.is_target());
                    }
                    self.acknowledge(now, number, made);
                }
            }
            OrderStep::ReadReason => {
                self.lines.push_back(Outgoing::one("TC1", ExpectedReply::RefusalReason))
            }
            OrderStep::Refused(why) => {
                if let Some((number, _)) = self.order.take() {
                    self.refuse(now, number, why);
                }
            }
        }
    }

    pub(super) fn samples_in_flight(&self) -> usize {
        let is_sample = |expects: &ExpectedReply| {
            matches!(expects, ExpectedReply::Sample | ExpectedReply::Marked(_))
        };
        self.expected.iter().filter(|(expects, _)| is_sample(expects)).count()
    }

    pub(super) fn is_renewal_due(&self, now: Nanos) -> bool {
        let is_attended = now.since(self.attended_at) < ATTENDED_MAX;
        self.has_watchdog
            && is_attended
            && self.renewed_at.is_none_or(|at| now.since(at) >= watchdog::RENEW)
    }

    pub(super) fn next_line(&mut self, now: Nanos) -> Option<Outgoing> {
        self.stop_if_abandoned(now);
        if let Some(line) = self.take_urgent(now) {
            return Some(line);
        }
        if self.resync.is_some() {
            return self.next_marker(now);
        }
        if self.is_renewal_due(now) {
            self.renewed_at = Some(now);
            let command = format!("{}=1", watchdog::VARIABLE);
            return Some(Outgoing::one(&command, ExpectedReply::Renewal));
        }
        if self.sine.as_ref().is_some_and(|sine| sine.is_dry(now)) {
            self.sine = None;
            self.end_sine(
                now,
                "this computer did not send the next segment of the sine in time; close other programs",
            );
            return self.urgent.pop_front();
        }
        if let Some(commands) = self.sine.as_mut().and_then(|sine| sine.take(now)) {
            let expects = vec![ExpectedReply::Segment; commands.len()];
            let text = format!("{}\r", commands.join(";"));
            return Some(Outgoing { text, expects });
        }
        // Answers of an order that a stop has ended may still be on their way.
        let has_answers_to_come = self.expected.iter().any(|(expects, _)| {
            matches!(expects, ExpectedReply::Part | ExpectedReply::RefusalReason)
        });
        if self.order.is_none()
            && !has_answers_to_come
            && let Some((number, command)) = self.orders.pop_front()
        {
            let mut order = GalilOrder::new(command, self.pace.tick);
            order.tracking = self.tracking;
            let next = order.begin(&self.settings);
            self.order = Some((number, order));
            self.apply_step(now, next);
        }
        if let Some(line) = self.lines.pop_front() {
            return Some(line);
        }
        match &self.beginning {
            Some((_, due)) if now < *due => return None,
            Some(_) => return self.take_beginning(now),
            None => {}
        }
        let is_due = self.polled_at.is_none_or(|at| now.since(at) >= self.pace.every);
        if let Some(line) = self.fetches.pop_front() {
            return Some(line);
        }
        if self.recording.as_ref().is_some_and(ArrayRecording::is_fetching) {
            return None;
        }
        if is_due && self.samples_in_flight() < self.pace.in_flight {
            self.polled_at = Some(now);
            return Some(Outgoing::one(&self.question, ExpectedReply::Sample));
        }
        None
    }

    fn take_urgent(&mut self, now: Nanos) -> Option<Outgoing> {
        let line = self.urgent.pop_front()?;
        let Some(resync) = &mut self.resync else {
            return Some(line);
        };
        // Its answers go by unseen; it will be asked for again.
        resync.marker_at = None;
        resync.last_byte = now;
        for expects in &line.expects {
            if let ExpectedReply::Stop(stop) = expects {
                self.confirm_later(*stop);
            }
        }
        Some(Outgoing { expects: Vec::new(), ..line })
    }

    fn take_beginning(&mut self, now: Nanos) -> Option<Outgoing> {
        let (line, _) = self.beginning.take()?;
        if let Some((_, order)) = &mut self.order {
            order.is_begun = true;
            if let Some(mut feed) = order.feed.take() {
                feed.mark_begun(now);
                self.sine = Some(feed);
            }
        }
        self.polled_at = Some(now);
        Some(line)
    }
}
