//! The simulated rig, and its faulty stand-in.

mod bench;
mod faulty_rig;
mod force;
mod host;
mod path_of_the_slider;
mod switches;
mod time_and_seed;
