//! Batches: many bodies of one template, over the lanes of a number and over threads.
//!
//! Every body is computed from start to end in one lane by one thread, and all numbers of a CPU level round alike, so its
//! bits depend neither on the number of threads nor on its neighbours nor on its place.

mod groups;
mod per_body;
mod quantities;

pub use groups::Batch;
