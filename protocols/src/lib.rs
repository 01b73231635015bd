//! The engine, its plans, the runner and replay.
