//! An emulated load cell behind a link whose waiting makes the time.

use palpate_drivers::cell::{CellDialogue, CellSample};
use palpate_drivers::wire::{HostClock, Link};
use palpate_emulators::DeviceFault;
use palpate_emulators::cell::{CellLoad, EmulatedCell};
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Volts};
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Emulators are advanced so often.
const STEP: Nanos = Nanos(500_000);

struct State<E> {
    cell: E,
    felt: CellLoad,
    out: Vec<u8>,
    is_unplugged: bool,
    is_mute: bool,
}

/// The bench: one cell, one clock.
pub struct CellBench<E> {
    state: Arc<Mutex<State<E>>>,
    now: Arc<AtomicU64>,
}

impl<E> Clone for CellBench<E> {
    fn clone(&self) -> Self {
        Self { state: Arc::clone(&self.state), now: Arc::clone(&self.now) }
    }
}

impl<E: EmulatedCell> CellBench<E> {
    pub fn new(cell: E) -> Self {
        let felt = CellLoad { volts: Volts(0.0), force: Newtons(0.0) };
        let state = State { cell, felt, out: Vec::new(), is_unplugged: false, is_mute: false };
        Self { state: Arc::new(Mutex::new(state)), now: Arc::new(AtomicU64::new(1_000_000_000)) }
    }

    pub fn clock(&self) -> HostClock {
        let now = Arc::clone(&self.now);
        Arc::new(move || Nanos(now.load(Ordering::SeqCst)))
    }

    pub fn feel(&self, volts: f64, force: f64) {
        let felt = CellLoad { volts: Volts(volts), force: Newtons(force) };
        self.state.lock().expect("the bench").felt = felt;
    }

    pub fn apply_fault(&self, fault: DeviceFault, is_on: bool) {
        let now = Nanos(self.now.load(Ordering::SeqCst));
        self.with(|cell| cell.apply_fault(now, fault, is_on));
    }

    pub fn with<T>(&self, act: impl FnOnce(&mut E) -> T) -> T {
        act(&mut self.state.lock().expect("the bench").cell)
    }

    pub fn unplug(&self) {
        self.state.lock().expect("the bench").is_unplugged = true;
    }

    pub fn mute(&self, is_mute: bool) {
        self.state.lock().expect("the bench").is_mute = is_mute;
    }

    /// Writes, waits and gives what came, as text.
    pub fn ask(&mut self, text: &str, wait_ms: u64) -> String {
        self.write(text.as_bytes()).expect("the link");
        let end = self.now.load(Ordering::SeqCst) + wait_ms * 1_000_000;
        let mut all = Vec::new();
        let mut buffer = [0_u8; 256];
        while self.now.load(Ordering::SeqCst) < end {
            let count = self.read(&mut buffer, Duration::from_millis(1)).expect("the link");
            all.extend_from_slice(&buffer[..count]);
        }
        String::from_utf8(all).expect("text")
    }

    /// Lets a dialogue run for a time and gives its samples.
    pub fn run(&mut self, dialogue: &mut dyn CellDialogue, ms: u64) -> Vec<CellSample> {
        let clock = self.clock();
        let end = clock() + Nanos::from_millis(ms);
        let mut samples = Vec::new();
        let mut buffer = [0_u8; 256];
        while clock() < end {
            let Ok(count) = self.read(&mut buffer, Duration::from_millis(1)) else {
                break;
            };
            dialogue.handle_bytes(clock(), &buffer[..count]);
            samples.extend(std::iter::from_fn(|| dialogue.take_sample()));
        }
        samples
    }
}

impl<E: EmulatedCell> Link for CellBench<E> {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let mut state = self.state.lock().expect("the bench");
        let end = self.now.load(Ordering::SeqCst) + wait.as_nanos() as u64;
        loop {
            if state.is_unplugged {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            if !state.out.is_empty() {
                let count = state.out.len().min(buffer.len());
                buffer[..count].copy_from_slice(&state.out[..count]);
                state.out.drain(..count);
                return Ok(count);
            }
            let now = self.now.load(Ordering::SeqCst);
            if now >= end {
                return Ok(0);
            }
            let now = Nanos(now + STEP.0);
            self.now.store(now.0, Ordering::SeqCst);
            let felt = state.felt;
            state.cell.advance(now, felt);
            let out = state.cell.transmit();
            if !state.is_mute {
                state.out.extend(out);
            }
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let now = Nanos(self.now.load(Ordering::SeqCst));
        let mut state = self.state.lock().expect("the bench");
        if state.is_unplugged {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        state.cell.receive(now, bytes);
        Ok(())
    }
}

/// Something that is no load cell: it answers every piece with the same words.
pub struct Stranger(pub &'static str, pub Vec<u8>);

impl EmulatedCell for Stranger {
    fn receive(&mut self, _now: Nanos, _bytes: &[u8]) {
        self.1.extend_from_slice(self.0.as_bytes());
    }
    fn advance(&mut self, _now: Nanos, _felt: CellLoad) {}
    fn transmit(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.1)
    }
    fn apply_fault(&mut self, _now: Nanos, _fault: DeviceFault, _is_on: bool) {}
}
