//! Questions on a thread, one at a time: while one is answered only the newest of those asked meanwhile is kept.

use super::Job;
use eframe::egui::Context;

/// Questions of one kind and their answers.
#[derive(Debug)]
pub struct LatestAnswer<Q, A> {
    name: &'static str,
    work: fn(&Q) -> Result<A, String>,
    job: Job<Result<A, String>>,
    next: Option<Q>,
}

impl<Q: Send + 'static, A: Send + 'static> LatestAnswer<Q, A> {
    /// Nothing asked yet. The threads have this name and do this work.
    #[must_use]
    pub fn new(name: &'static str, work: fn(&Q) -> Result<A, String>) -> Self {
        Self { name, work, job: Job::default(), next: None }
    }

    /// Asks, in the place of what was asked and not begun.
    pub fn ask(&mut self, question: Q, ctx: &Context) {
        self.next = Some(question);
        self.begin(ctx);
    }

    /// Whether an answer is still to come.
    pub fn is_busy(&self) -> bool {
        self.job.is_busy() || self.next.is_some()
    }

    fn begin(&mut self, ctx: &Context) {
        if self.job.is_busy() {
            return;
        }
        let Some(question) = self.next.take() else { return };
        let work = self.work;
        let started = self.job.start(self.name, ctx, move || work(&question));
        if started.is_err() {
            // The next poll tries again.
            ctx.request_repaint();
        }
    }

    /// An answer that has come, once; the next question is then begun.
    pub fn poll(&mut self, ctx: &Context) -> Option<Result<A, String>> {
        let was_busy = self.job.is_busy();
        let answer = self.job.poll();
        let has_died = was_busy && answer.is_none() && !self.job.is_busy();
        self.begin(ctx);
        match has_died {
            true => Some(Err(
                "the work ended unexpectedly; try again, and report it if it happens twice".into(),
            )),
            false => answer,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_test_support::wait::until;
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, sync_channel};

    fn answers<Q: Send + 'static>(
        latest: &mut LatestAnswer<Q, u32>,
        count: usize,
    ) -> Vec<Result<u32, String>> {
        let ctx = Context::default();
        let mut all = Vec::new();
        let have_come = || {
            all.extend(latest.poll(&ctx));
            (all.len() == count && !latest.is_busy()).then_some(())
        };
        until(have_come, || format!("{count} answers"));
        all
    }

    #[test]
    fn the_newest_question_wins() {
        let ctx = Context::default();
        let (go, wait) = sync_channel::<()>(8);
        type Question = (u32, std::sync::Arc<Mutex<Receiver<()>>>);
        let wait = std::sync::Arc::new(Mutex::new(wait));
        let mut latest: LatestAnswer<Question, u32> =
            LatestAnswer::new("test", |(number, wait)| {
                let wait = wait.lock().map_err(|err| err.to_string())?;
                wait.recv().map_err(|err| err.to_string())?;
                Ok(*number)
            });
        for number in 0..5 {
            latest.ask((number, wait.clone()), &ctx);
        }
        assert!(latest.is_busy() && latest.poll(&ctx).is_none());
        for _ in 0..2 {
            go.send(()).unwrap();
        }
        assert_eq!(answers(&mut latest, 2), [Ok(0), Ok(4)]);
    }

    #[test]
    fn work_that_dies_says_so_and_the_next_is_done() {
        let ctx = Context::default();
        let mut latest: LatestAnswer<u32, u32> = LatestAnswer::new("test", |number| {
            assert!(*number != 0, "on purpose");
            Ok(*number)
        });
        latest.ask(0, &ctx);
        assert!(answers(&mut latest, 1)[0].is_err());
        latest.ask(7, &ctx);
        assert_eq!(answers(&mut latest, 1), [Ok(7)]);
    }
}
