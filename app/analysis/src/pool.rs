//! Many pieces of work on a few named threads, with answers in the order of the pieces.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::Builder;

/// What happened to one piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoAnswer {
    /// It was not begun: the whole was asked to end.
    NotBegun,
    /// Its thread ended without an answer.
    Died,
}

/// What the one who waits is told, on the thread that asked.
pub enum News<R> {
    /// So many pieces are done.
    Done(usize),
    /// The answer to the next piece, in order.
    Next(Result<R, NoAnswer>),
}

/// Does `work` on every piece with `jobs` threads and tells `hear` every answer, in order. Once
/// `is_ending` is set no piece is begun; those under way are waited for.
///
/// Each thread takes the next piece when it is free, so no more than `jobs` are under way; only
/// finished answers wait for their turn.
pub fn in_order<T: Sync, R: Send>(
    jobs: usize,
    pieces: &[T],
    is_ending: &AtomicBool,
    work: impl Fn(&T) -> R + Sync,
    mut hear: impl FnMut(News<R>),
) -> io::Result<()> {
    let next = AtomicUsize::new(0);
    let jobs = jobs.clamp(1, pieces.len().max(1));
    let (sender, receiver) = sync_channel(jobs);
    let mut answers: Vec<Option<R>> = pieces.iter().map(|_| None).collect();
    let mut told = 0;
    std::thread::scope(|scope| {
        let (next, work) = (&next, &work);
        let mut threads = Vec::with_capacity(jobs);
        for number in 1..=jobs {
            let sender = sender.clone();
            let one = move || {
                let _in = tracing::info_span!("worker", number).entered();
                tracing::debug!("started");
                while !is_ending.load(Ordering::Relaxed) {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(piece) = pieces.get(index) else {
                        return;
                    };
                    if sender.send((index, work(piece))).is_err() {
                        return;
                    }
                }
            };
            match Builder::new()
                .name(format!("fit-{number}"))
                .spawn_scoped(scope, one)
            {
                Ok(thread) => threads.push(thread),
                // Fewer threads do the same work; none cannot.
                Err(err) if threads.is_empty() => return Err(err),
                Err(_) => break,
            }
        }
        drop(sender);
        for (done, (index, answer)) in receiver.iter().enumerate() {
            hear(News::Done(done + 1));
            answers[index] = Some(answer);
            while let Some(answer) = answers.get_mut(told).and_then(Option::take) {
                hear(News::Next(Ok(answer)));
                told += 1;
            }
        }
        // Joined here, so that a thread that died is an answer that is missing and not a panic.
        threads.into_iter().for_each(|thread| {
            let _ = thread.join();
        });
        Ok(())
    })?;
    let begun = next.load(Ordering::Relaxed).min(pieces.len());
    for (index, answer) in answers.iter_mut().enumerate().skip(told) {
        let none = if index < begun {
            NoAnswer::Died
        } else {
            NoAnswer::NotBegun
        };
        hear(News::Next(answer.take().ok_or(none)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn answers<R: Send>(
        jobs: usize,
        pieces: &[u32],
        is_ending: &AtomicBool,
        work: impl Fn(&u32) -> R + Sync,
    ) -> (Vec<Result<R, NoAnswer>>, usize) {
        let (mut answers, mut most) = (Vec::new(), 0);
        in_order(jobs, pieces, is_ending, work, |news| match news {
            News::Done(count) => most = count,
            News::Next(answer) => answers.push(answer),
        })
        .unwrap();
        (answers, most)
    }

    #[test]
    fn answers_come_in_order_whoever_is_first() {
        let pieces: Vec<u32> = (0..40).collect();
        let expected: Vec<Result<u32, NoAnswer>> = pieces.iter().map(|i| Ok(i * i)).collect();
        for jobs in [1, 3, 100] {
            let (found, done) = answers(jobs, &pieces, &AtomicBool::new(false), |&i| {
                // Later pieces are quicker.
                std::thread::sleep(Duration::from_millis(u64::from(40 - i) / 8));
                i * i
            });
            assert_eq!((found, done), (expected.clone(), 40));
        }
        let (none, _) = answers(2, &[], &AtomicBool::new(false), |&i| i);
        assert!(none.is_empty());
    }

    #[test]
    fn asked_to_end_it_begins_nothing_new_and_keeps_what_is_done() {
        let is_ending = AtomicBool::new(false);
        let (found, done) = answers(1, &[0, 1, 2, 3], &is_ending, |&i| {
            is_ending.store(i == 1, Ordering::Relaxed);
            i
        });
        let not = Err(NoAnswer::NotBegun);
        assert_eq!((found, done), (vec![Ok(0), Ok(1), not, not], 2));
    }

    #[test]
    fn a_piece_that_kills_its_thread_does_not_kill_the_others() {
        let (found, _) = answers(2, &[0, 1, 2, 3], &AtomicBool::new(false), |&i| {
            assert!(i != 1, "on purpose");
            i
        });
        assert_eq!(found, [Ok(0), Err(NoAnswer::Died), Ok(2), Ok(3)]);
    }
}
