//! Session logs on disk: write, read, export, import.
