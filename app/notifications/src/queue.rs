//! What waits for one target: bounded, the most important first.

use crate::notice::Notice;
use std::collections::VecDeque;
use std::time::Duration;

/// Notices that may wait for one target. A rig gives a few an hour, so this is more than a day without a network.
pub const WAITING_MAX: usize = 64;

/// Waits before the second attempt and those after it: short for a server that restarts, then long for a network that is
/// repaired.
const WAITS_S: [u64; 12] = [1, 4, 15, 60, 120, 300, 300, 600, 600, 900, 900, 900];

/// Attempts to send a notice: the first, and one after each wait, over an hour and a quarter.
pub const ATTEMPTS_MAX: usize = WAITS_S.len() + 1;

/// How long to wait after so many failed attempts; `None` once it is given up.
pub(crate) fn wait_after(attempts: usize) -> Option<Duration> {
    let index = attempts.checked_sub(1)?;
    WAITS_S.get(index).map(|seconds| Duration::from_secs(*seconds))
}

/// A notice that waits, with its failed attempts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WaitingNotice {
    pub number: u64,
    pub notice: Notice,
    pub attempts: usize,
    /// Why the last attempt failed.
    pub reason: String,
}

/// Notices of one target in the order in which they are sent.
#[derive(Debug, Default)]
pub(crate) struct NoticeQueue {
    waiting: VecDeque<WaitingNotice>,
    next: u64,
}

impl NoticeQueue {
    /// Adds a notice behind those that matter as much. A full queue gives up the oldest of the least important ones,
    /// which is the new one where all others matter more.
    pub fn push(&mut self, notice: Notice) -> Option<WaitingNotice> {
        let (kind, number) = (notice.kind, self.next);
        self.next += 1;
        let place = self.waiting.partition_point(|one| one.notice.kind <= kind);
        let reason = String::new();
        self.waiting.insert(place, WaitingNotice { number, notice, attempts: 0, reason });
        if self.waiting.len() <= WAITING_MAX {
            return None;
        }
        let least = self.waiting.back()?.notice.kind;
        let first = self.waiting.partition_point(|one| one.notice.kind < least);
        self.waiting.remove(first)
    }

    /// The next to send.
    pub fn first(&self) -> Option<&WaitingNotice> {
        self.waiting.front()
    }

    /// Takes one out.
    pub fn take(&mut self, number: u64) -> Option<WaitingNotice> {
        let index = self.waiting.iter().position(|one| one.number == number)?;
        self.waiting.remove(index)
    }

    /// Counts a failed attempt; returns how long to wait, or the notice if it is given up.
    pub fn fail(
        &mut self,
        number: u64,
        reason: &str,
    ) -> Result<Duration, Option<Box<WaitingNotice>>> {
        let Some(one) = self.waiting.iter_mut().find(|one| one.number == number) else {
            return Err(None);
        };
        one.attempts += 1;
        reason.clone_into(&mut one.reason);
        let attempts = one.attempts;
        wait_after(attempts).ok_or_else(|| self.take(number).map(Box::new))
    }

    pub fn take_all(&mut self) -> Vec<WaitingNotice> {
        self.waiting.drain(..).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::notice::NoticeKind;

    fn notice(kind: NoticeKind) -> Notice {
        Notice { kind, ..Notice::test(chrono::DateTime::UNIX_EPOCH) }
    }

    #[test]
    fn the_most_important_is_first_and_equals_keep_their_order() {
        let mut queue = NoticeQueue::default();
        for kind in [NoticeKind::Ended, NoticeKind::Alarm, NoticeKind::Ended, NoticeKind::Failed] {
            assert_eq!(queue.push(notice(kind)), None);
        }
        let order: Vec<(NoticeKind, u64)> =
            queue.take_all().iter().map(|one| (one.notice.kind, one.number)).collect();
        assert_eq!(
            order,
            [
                (NoticeKind::Alarm, 1),
                (NoticeKind::Failed, 3),
                (NoticeKind::Ended, 0),
                (NoticeKind::Ended, 2)
            ]
        );
    }

    #[test]
    fn a_full_queue_drops_the_oldest_ordinary_notice_and_never_an_alarm_before_it() {
        let mut queue = NoticeQueue::default();
        queue.push(notice(NoticeKind::Alarm));
        for _ in 1..WAITING_MAX {
            assert_eq!(queue.push(notice(NoticeKind::Ended)), None);
        }
        let dropped = queue.push(notice(NoticeKind::Ended)).unwrap();
        assert_eq!((dropped.notice.kind, dropped.number), (NoticeKind::Ended, 1));
        let mut dropped = Vec::new();
        for _ in 1..WAITING_MAX {
            dropped.extend(queue.push(notice(NoticeKind::Alarm)));
        }
        assert!(dropped.iter().all(|one| one.notice.kind == NoticeKind::Ended));
        assert_eq!(dropped.len(), WAITING_MAX - 1);
        // Now all are alarms: an ordinary one has no place, and of the alarms the newest stay.
        let refused = queue.push(notice(NoticeKind::Calibration)).unwrap();
        assert_eq!(refused.notice.kind, NoticeKind::Calibration);
        assert_eq!(queue.push(notice(NoticeKind::Alarm)).unwrap().number, 0);
    }

    #[test]
    fn attempts_are_bounded() {
        let mut queue = NoticeQueue::default();
        queue.push(notice(NoticeKind::Failed));
        let waits: Vec<Duration> = std::iter::from_fn(|| queue.fail(0, "no route").ok()).collect();
        assert_eq!(waits.len(), ATTEMPTS_MAX - 1);
        assert!(waits.is_sorted());
        assert_eq!(queue.first(), None);
    }

    #[test]
    fn the_one_given_up_says_why() {
        let mut queue = NoticeQueue::default();
        queue.push(notice(NoticeKind::Failed));
        for _ in 1..ATTEMPTS_MAX {
            queue.fail(0, "no route").unwrap();
        }
        let given_up = queue.fail(0, "refused").unwrap_err().unwrap();
        assert_eq!((given_up.attempts, given_up.reason.as_str()), (ATTEMPTS_MAX, "refused"));
    }
}
