"""Gravity, the same wherever bodies fall, are weighed, or move over force plates."""

GRAVITY = 9.81  # m/s², that of the Rust core (`solid.rs`)
