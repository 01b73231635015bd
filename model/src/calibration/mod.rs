//! Load-cell calibration: weights to volts and back.
