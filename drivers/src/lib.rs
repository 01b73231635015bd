//! Motion controllers and load cells, real and simulated.
