//! Fuzz targets: functions of bytes that must neither panic nor break what they assert, whatever the bytes are.
//!
//! With cargo-fuzz: `cargo +nightly fuzz run --fuzz-dir rust/fuzz --features libfuzzer mesh`. On stable Rust, without
//! coverage: `make fuzz`, or `cargo run --release -p ipman-fuzz -- mesh 3600` for an hour.
//!
//! The `.c3d` walk is Python's (`ipman_rs.data`): its fuzzer is in `tools/`.

pub mod balance;
pub mod body;
pub mod closing;
pub mod mesh;
pub mod skinning;
pub mod source;
pub mod support;

/// A target by its name.
pub type Target = (&'static str, fn(&[u8]));

pub const TARGETS: [Target; 5] = [
    ("mesh", mesh::run),
    ("closing", closing::run),
    ("support", support::run),
    ("balance", balance::run),
    ("skinning", skinning::run),
];

/// Where every corpus starts: each of the shapes, as it is and with some edits. What bytes do not say is zero.
pub fn seeds() -> Vec<Vec<u8>> {
    let edited = |shape: u8, edits: u8| [&[shape, edits][..], &[shape.wrapping_mul(37); 24]].concat();
    (0..body::SHAPES).flat_map(|shape| [vec![shape], edited(shape, 1), edited(shape, 3)]).collect()
}
