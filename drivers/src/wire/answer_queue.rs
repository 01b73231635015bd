//! Commands are answered in the order in which they came, whatever the order in which they are done.

use crate::rig::RigEventBody;
use palpate_model::rig::{Ack, Fault, RigCommand};
use std::collections::VecDeque;

#[derive(Clone, Debug, Default)]
pub struct AnswerQueue {
    owed: VecDeque<(u64, Option<RigEventBody>)>,
    count: u64,
}

impl AnswerQueue {
    pub fn owe(&mut self) -> u64 {
        self.count += 1;
        self.owed.push_back((self.count, None));
        self.count
    }

    fn answer(&mut self, number: u64, body: RigEventBody) {
        if let Some((_, answer)) = self.owed.iter_mut().find(|(owed, _)| *owed == number) {
            *answer = Some(body);
        }
    }

    pub fn acknowledge(&mut self, number: u64, command: RigCommand) {
        self.answer(number, RigEventBody::Ack(Ack { command }));
    }

    pub fn refuse(&mut self, number: u64, detail: impl Into<String>) {
        let detail = detail.into();
        self.answer(number, RigEventBody::Fault(Fault::CommandRefused { detail }));
    }

    /// The next answer, when all before it were given.
    pub fn take(&mut self) -> Option<RigEventBody> {
        let answer = self.owed.front_mut()?.1.take()?;
        self.owed.pop_front();
        Some(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_order_of_the_commands() {
        let mut answers = AnswerQueue::default();
        let (first, second) = (answers.owe(), answers.owe());
        answers.acknowledge(second, RigCommand::Stop);
        assert_eq!(answers.take(), None);
        answers.refuse(first, "no");
        assert!(matches!(answers.take(), Some(RigEventBody::Fault(_))));
        assert!(matches!(answers.take(), Some(RigEventBody::Ack(_))));
        assert_eq!(answers.take(), None);
    }
}
