//! The number that every room is written in.
//!
//! A room computes with [`Real`] and so is at once the exact path (`f64`), the fast path (lanes: one lane = one body) and
//! the forward-mode derivative ([`Dual`]). No method returns a bool, for lanes may disagree: a choice between two values
//! is made by [`Real::if_negative`].
//!
//! All numbers of one CPU level ([`gate`]) round alike, operation by operation: a body has the same bits alone and in
//! any lane of any width. Therefore rooms fix the order of their sums, and write `mul_add` where one rounding is meant.

mod curves;
mod dual;
mod dispatch;
mod float;
mod fused;
mod real;
#[cfg(test)]
mod row_tests;
pub mod simd_level;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[macro_use]
mod registers;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "x86_64")]
mod simd;
mod target;
pub mod vector;

pub use dual::Dual;
pub use fused::Fused;
pub use real::{BLOCK, Data, Kernel, Real, SUMS, Scalar, WideScalar, Work, all_finite};
