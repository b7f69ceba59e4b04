//! Batches: many bodies of one template, over SIMD lanes and threads.
//!
//! Every body is computed from start to end in one lane by one thread, and all number types of a CPU level round
//! identically, so its bits depend neither on the number of threads nor on the other bodies nor on its position in the
//! batch.

mod groups;
mod per_body;
mod quantities;

pub use groups::Batch;
pub use quantities::Evaluate;
