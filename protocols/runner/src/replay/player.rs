//! A recorded session at any time: its inputs drive the engine again, forward and back.

use super::ReplayError;
use super::source::{RecordedInput, read_config, read_inputs, read_sample};
use crate::{Board, LogState, RigView, RunnerSnapshot};
use palpate_model::Nanos;
use palpate_protocols::engine::{self, Effect, EngineInput, EngineState};
use palpate_protocols::preview::preview;
use palpate_sessions::log::Session;
use palpate_sessions::record::SampleRow;
use std::path::PathBuf;
use std::sync::Arc;

/// Stored states, so that going back does not start at the beginning. One for each pixel of a slider would cost memory; with
/// 64, the nearest is at most 1.5 % of the session away.
const FRAMES_MAX: usize = 64;
/// Least samples between two stored states: fewer are replayed in a few milliseconds.
const FRAME_SAMPLES_MIN: usize = 5000;

pub struct Player {
    rows: Vec<SampleRow>,
    inputs: Vec<RecordedInput>,
    end: Nanos,
    current: PlaybackPosition,
    frames: Vec<PlaybackPosition>,
    every: usize,
    is_same_engine: bool,
}

/// The run after so many samples and inputs.
#[derive(Clone)]
struct PlaybackPosition {
    rows: usize,
    inputs: usize,
    /// `None` only while [`engine::step`] has it.
    state: Option<EngineState>,
    board: Board,
}

impl Player {
    /// At the beginning of a session. `folder` is where it lies.
    pub fn new(session: Session, folder: PathBuf) -> Result<Self, ReplayError> {
        let config = read_config(&session)?;
        let inputs: Vec<RecordedInput> = read_inputs(&session)?.into();
        let expected =
            preview(&config.plan, &config.rig, &config.limits, &config.curve, config.is_homed);
        let last_row = session.rows.last().map_or(Nanos::ZERO, |row| row.host);
        let end = inputs.last().map_or(last_row, |input| input.now.max(last_row));
        let current = PlaybackPosition {
            rows: 0,
            inputs: 0,
            board: Board::new(&config, expected.steps, folder),
            state: Some(EngineState::new(Arc::new(config))),
        };
        Ok(Self {
            every: (session.rows.len() / FRAMES_MAX).max(FRAME_SAMPLES_MIN),
            is_same_engine: session.manifest.engine_version == engine::ENGINE_VERSION,
            rows: session.rows,
            inputs,
            end,
            frames: vec![current.clone()],
            current,
        })
    }

    pub fn end(&self) -> Nanos {
        self.end
    }

    /// Session time of the newest input taken.
    pub fn now(&self) -> Nanos {
        self.current.board.now()
    }

    /// Whether the engine that recorded the session is this one; if not, what is shown may differ from what was.
    pub fn is_same_engine(&self) -> bool {
        self.is_same_engine
    }

    /// Goes towards a session time by at most so many samples and inputs; true once it is reached.
    pub fn go_to(&mut self, time: Nanos, most: usize) -> bool {
        let nearest = self.frames.iter().rev();
        let nearest = nearest.into_iter().find(|place| place.board.now() <= time);
        if let Some(place) = nearest
            && (time < self.now() || place.rows > self.current.rows)
        {
            self.current = place.clone();
        }
        for _ in 0..most {
            match self.next_time() {
                Some(next) if next <= time => self.advance(),
                _ => return true,
            }
        }
        self.next_time().is_none_or(|next| next > time)
    }

    fn next_time(&self) -> Option<Nanos> {
        let row = self.rows.get(self.current.rows).map(|row| row.host);
        self.next_input().map(|input| input.now).or(row)
    }

    /// The next input, if it comes before the next sample.
    fn next_input(&self) -> Option<&RecordedInput> {
        let next = self.inputs.get(self.current.inputs)?;
        (next.after_sample <= self.current.rows as u64 || self.current.rows == self.rows.len())
            .then_some(next)
    }

    fn advance(&mut self) {
        let input = self.next_input().map(|next| (next.now, next.input.clone()));
        let current = &mut self.current;
        let (now, input) = match (input, self.rows.get(current.rows)) {
            (Some(input), _) => {
                current.inputs += 1;
                input
            }
            (None, Some(row)) => {
                current.rows += 1;
                match read_sample(row) {
                    Some(reading) => (row.host, EngineInput::Reading(reading)),
                    None => return,
                }
            }
            (None, None) => return,
        };
        current.push(now, input);
        let known = self.frames.last().map_or(0, |place| place.rows);
        if self.current.rows >= known + self.every {
            self.frames.push(self.current.clone());
        }
    }

    /// What a window shows of it.
    pub fn snapshot(&self, sequence: u64) -> Option<RunnerSnapshot> {
        let PlaybackPosition { rows, board, .. } = &self.current;
        let state = self.current.state.as_ref()?;
        let log = LogState { saved_through: board.now(), ..LogState::default() };
        let reading = rows.checked_sub(1).and_then(|last| self.rows.get(last));
        Some(RunnerSnapshot {
            rig: RigView {
                description: Arc::new(state.config().rig.clone()),
                reading: reading.and_then(read_sample),
                is_homed: state.is_homed(),
                link: None,
                link_error: None,
                sensors: *state.sensors(),
            },
            run: Some(board.view(state, log)),
            refusal: None,
            sequence,
        })
    }
}

impl PlaybackPosition {
    fn push(&mut self, now: Nanos, input: EngineInput) {
        self.board.push_input(now, &input);
        let is_sample = matches!(input, EngineInput::Reading(_));
        let Some(state) = self.state.take() else {
            return;
        };
        let (state, effects) = engine::step(state, now, input);
        if is_sample {
            self.board.push_sample(&state);
        }
        self.state = Some(state);
        for effect in effects {
            match effect {
                Effect::Command(_) | Effect::ByHand(_) => {}
                Effect::Record(record) => self.board.push_record(&record),
                Effect::Finished(outcome) => self.board.push_outcome(&outcome),
            }
        }
    }
}
