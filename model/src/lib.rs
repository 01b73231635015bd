//! Vocabulary and mathematics of soft-tissue indentation, without I/O.
