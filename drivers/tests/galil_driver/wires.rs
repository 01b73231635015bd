//! The rig over a TCP connection and over a pseudo-terminal, in real time.
