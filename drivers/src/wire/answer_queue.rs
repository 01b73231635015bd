//! Commands are answered in the order in which they came, in whatever order they are done.

use crate::rig::RigEventBody;
use palpate_model::rig::{Ack, RigCommand};
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

    /// Answers a command. Returns the answers that may be given now, in order: those with none missing before them.
    fn answer(&mut self, number: u64, body: RigEventBody) -> Vec<RigEventBody> {
        if let Some((_, answer)) = self.owed.iter_mut().find(|(owed, _)| *owed == number) {
            *answer = Some(body);
        }
        let ready = self.owed.iter().take_while(|(_, answer)| answer.is_some()).count();
        self.owed.drain(..ready).filter_map(|(_, answer)| answer).collect()
    }

    pub fn acknowledge(&mut self, number: u64, command: RigCommand) -> Vec<RigEventBody> {
        self.answer(number, RigEventBody::Ack(Ack { command }))
    }

    pub fn refuse(&mut self, number: u64, detail: impl Into<String>) -> Vec<RigEventBody> {
        self.answer(number, RigEventBody::refusal(detail))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_order_of_the_commands() {
        let mut answers = AnswerQueue::default();
        let (first, second) = (answers.owe(), answers.owe());
        assert_eq!(answers.acknowledge(second, RigCommand::Stop), []);
        let both = answers.refuse(first, "no");
        assert!(matches!(both[..], [RigEventBody::Fault(_), RigEventBody::Ack(_)]));
    }
}
