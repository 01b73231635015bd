//! A recorded session as it was at any moment: its inputs drive the engine again, forth and back.

use super::ReplayError;
use super::source::{RecordedInput, config_of, inputs_of, reading_of};
use crate::{Board, LogState, RigView, Snapshot};
use palpate_model::Nanos;
use palpate_protocols::engine::{self, Effect, Input, State};
use palpate_protocols::preview::preview;
use palpate_sessions::log::Session;
use palpate_sessions::record::Row;
use std::path::PathBuf;
use std::sync::Arc;

/// Places remembered on the way, so that going back does not begin at the beginning: as many as a slider has
/// pixels to tell apart would cost memory; of 64, the way from the nearest is 1.5 % of the session.
const FRAMES_MAX: usize = 64;
/// Samples between two of them at least: less is walked in a few milliseconds.
const FRAME_SAMPLES_MIN: usize = 5000;

/// A session that is played.
pub struct Player {
    rows: Vec<Row>,
    inputs: Vec<RecordedInput>,
    end: Nanos,
    here: Place,
    frames: Vec<Place>,
    every: usize,
    is_same_engine: bool,
}

/// The run after so many samples and inputs.
#[derive(Clone)]
struct Place {
    rows: usize,
    inputs: usize,
    /// `None` only while [`engine::step`] has it.
    state: Option<State>,
    board: Board,
}

impl Player {
    /// At the beginning of a session. `folder` is where it lies.
    pub fn new(session: Session, folder: PathBuf) -> Result<Self, ReplayError> {
        let config = config_of(&session)?;
        let inputs: Vec<RecordedInput> = inputs_of(&session)?.into();
        let expected =
            preview(&config.plan, &config.rig, &config.limits, &config.curve, config.is_homed);
        let last_row = session.rows.last().map_or(Nanos::ZERO, |row| row.host);
        let end = inputs.last().map_or(last_row, |input| input.now.max(last_row));
        let here = Place {
            rows: 0,
            inputs: 0,
            board: Board::new(&config, expected.steps, folder),
            state: Some(State::new(Arc::new(config))),
        };
        Ok(Self {
            every: (session.rows.len() / FRAMES_MAX).max(FRAME_SAMPLES_MIN),
            is_same_engine: session.manifest.engine_version == engine::ENGINE_VERSION,
            rows: session.rows,
            inputs,
            end,
            frames: vec![here.clone()],
            here,
        })
    }

    /// Session time of the last input.
    pub fn end(&self) -> Nanos {
        self.end
    }

    /// Session time of the newest input taken.
    pub fn now(&self) -> Nanos {
        self.here.board.now()
    }

    /// Whether the engine that recorded the session is this one; if not, what is shown may differ from what was.
    pub fn is_same_engine(&self) -> bool {
        self.is_same_engine
    }

    /// Goes towards a session time, forth or back, by so many samples and inputs at most. Whether it is there.
    pub fn go_to(&mut self, time: Nanos, most: usize) -> bool {
        let nearest = self.frames.iter().rev();
        let nearest = nearest.into_iter().find(|place| place.board.now() <= time);
        if let Some(place) = nearest
            && (time < self.now() || place.rows > self.here.rows)
        {
            self.here = place.clone();
        }
        for _ in 0..most {
            match self.next_time() {
                Some(next) if next <= time => self.advance(),
                _ => return true,
            }
        }
        self.next_time().is_none_or(|next| next > time)
    }

    /// When the next input came, a sample or another.
    fn next_time(&self) -> Option<Nanos> {
        let row = self.rows.get(self.here.rows).map(|row| row.host);
        self.next_input().map(|input| input.now).or(row)
    }

    /// The next input, if it comes before the next sample.
    fn next_input(&self) -> Option<&RecordedInput> {
        let next = self.inputs.get(self.here.inputs)?;
        (next.after_sample <= self.here.rows as u64 || self.here.rows == self.rows.len())
            .then_some(next)
    }

    fn advance(&mut self) {
        let input = self.next_input().map(|next| (next.now, next.input.clone()));
        let here = &mut self.here;
        let (now, input) = match (input, self.rows.get(here.rows)) {
            (Some(input), _) => {
                here.inputs += 1;
                input
            }
            (None, Some(row)) => {
                here.rows += 1;
                match reading_of(row) {
                    Some(reading) => (row.host, Input::Reading(reading)),
                    None => return,
                }
            }
            (None, None) => return,
        };
        here.take(now, input);
        let known = self.frames.last().map_or(0, |place| place.rows);
        if self.here.rows >= known + self.every {
            self.frames.push(self.here.clone());
        }
    }

    /// What a window shows of it.
    pub fn snapshot(&self, sequence: u64) -> Option<Snapshot> {
        let Place { rows, board, .. } = &self.here;
        let state = self.here.state.as_ref()?;
        let log = LogState { saved_through: board.now(), ..LogState::default() };
        let reading = rows.checked_sub(1).and_then(|last| self.rows.get(last));
        Some(Snapshot {
            rig: RigView {
                description: Arc::new(state.config().rig.clone()),
                reading: reading.and_then(reading_of),
                is_homed: state.is_homed(),
                link: None,
                link_error: None,
            },
            run: Some(board.view(state, log)),
            refusal: None,
            sequence,
        })
    }
}

impl Place {
    fn take(&mut self, now: Nanos, input: Input) {
        self.board.input(now, &input);
        let is_sample = matches!(input, Input::Reading(_));
        let Some(state) = self.state.take() else {
            return;
        };
        let (state, effects) = engine::step(state, now, input);
        if is_sample {
            self.board.sample(&state);
        }
        self.state = Some(state);
        for effect in effects {
            match effect {
                Effect::Command(_) | Effect::ByHand(_) => {}
                Effect::Record(record) => self.board.record(&record),
                Effect::Finished(outcome) => self.board.end(&outcome),
            }
        }
    }
}
