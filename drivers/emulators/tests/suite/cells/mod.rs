//! Load cells on wires of their own against their emulators, in time that the tests make.

mod bench;
mod gauge;
mod hx711;
mod plain_numbers;
mod sketch;
mod streams;
