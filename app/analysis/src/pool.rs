//! Many pieces of work on a few named threads, with answers in the order of the pieces.

use palpate_model::panics::catch_panic;
use rayon::ThreadPoolBuilder;
use rayon::iter::{ParallelBridge, ParallelIterator};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkFailure {
    NotBegun,
    Died,
}

/// An event of the work, on the calling thread.
pub enum WorkEvent<R> {
    /// Number of pieces done.
    Done(usize),
    /// The answer to the next piece, in order.
    Next(Result<R, WorkFailure>),
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
    mut hear: impl FnMut(WorkEvent<R>),
) -> io::Result<()> {
    let jobs = jobs.clamp(1, pieces.len().max(1));
    let pool = ThreadPoolBuilder::new()
        .num_threads(jobs)
        .thread_name(|index| format!("fit-{}", index + 1))
        .build()
        .map_err(io::Error::other)?;
    // Pieces leave the bridge one by one, in order.
    let one = |piece: &T| match is_ending.load(Ordering::Relaxed) {
        true => Err(WorkFailure::NotBegun),
        false => {
            let _in = tracing::info_span!("worker").entered();
            catch_panic(|| work(piece)).map_err(|_| WorkFailure::Died)
        }
    };
    let (sender, receiver) = sync_channel(jobs);
    let mut answers: Vec<Option<Result<R, WorkFailure>>> = pieces.iter().map(|_| None).collect();
    let (mut done, mut delivered) = (0, 0);
    pool.in_place_scope(|scope| {
        scope.spawn(|_| {
            let pieces = pieces.iter().enumerate().par_bridge();
            // Sending fails only where `hear` itself panicked.
            let _ = pieces.try_for_each_with(sender, |sender, (index, piece)| {
                sender.send((index, one(piece))).ok()
            });
        });
        for (index, answer) in receiver {
            if answer.is_ok() {
                done += 1;
                hear(WorkEvent::Done(done));
            }
            answers[index] = Some(answer);
            while let Some(answer) = answers.get_mut(delivered).and_then(Option::take) {
                hear(WorkEvent::Next(answer));
                delivered += 1;
            }
        }
    });
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
    ) -> (Vec<Result<R, WorkFailure>>, usize) {
        let (mut answers, mut most) = (Vec::new(), 0);
        in_order(jobs, pieces, is_ending, work, |news| match news {
            WorkEvent::Done(count) => most = count,
            WorkEvent::Next(answer) => answers.push(answer),
        })
        .unwrap();
        (answers, most)
    }

    #[test]
    fn answers_come_in_order_whoever_is_first() {
        let pieces: Vec<u32> = (0..40).collect();
        let expected: Vec<Result<u32, WorkFailure>> = pieces.iter().map(|i| Ok(i * i)).collect();
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
        let not = Err(WorkFailure::NotBegun);
        assert_eq!((found, done), (vec![Ok(0), Ok(1), not, not], 2));
    }

    #[test]
    fn a_piece_that_kills_its_thread_does_not_kill_the_others() {
        let (found, _) = answers(2, &[0, 1, 2, 3], &AtomicBool::new(false), |&i| {
            assert!(i != 1, "on purpose");
            i
        });
        assert_eq!(found, [Ok(0), Err(WorkFailure::Died), Ok(2), Ok(3)]);
    }
}
