//! Load cells on wires of their own against their emulators, in time that the tests make.

#[path = "cells/bench.rs"]
mod bench;
#[path = "cells/gauge.rs"]
mod gauge;
#[path = "cells/hx711.rs"]
mod hx711;
#[path = "cells/sketch.rs"]
mod sketch;
#[path = "cells/streams.rs"]
mod streams;
