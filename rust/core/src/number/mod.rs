//! The number types that every formula is written in.
//!
//! A formula is generic over [`Real`], and so is at once the exact path (`f64`), the fast path (SIMD lanes, one body
//! per lane) and the forward-mode derivative ([`Dual`]). No method returns a bool, because lanes may differ:
//! [`Real::if_negative`] chooses between two values lane by lane.
//!
//! All number types of one CPU level ([`simd_level`]) round identically, operation by operation, so a body gets the
//! same bits alone and in any lane of any width. Formulas therefore fix the order of their sums, and write `mul_add`
//! where a single rounding is meant.

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
