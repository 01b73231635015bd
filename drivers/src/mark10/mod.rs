//! Mark-10
