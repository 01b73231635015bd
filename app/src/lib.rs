//! The palpate workbench: window and command line.
