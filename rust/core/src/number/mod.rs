//! The number that every room is written in.
//!
//! A room computes with [`Real`] and so is at once the exact path (`f64`), the fast scalar path (`f32`) and the
//! forward-mode derivative ([`Dual`]). A lane type (many bodies side by side) fits the same trait, which is why no
//! method returns a bool: a choice between two values is made by [`Real::if_negative`].

mod curves;
mod dual;
mod float;
pub mod vector;

pub use dual::Dual;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number, or one number for each lane.
pub trait Real:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One lane of it.
    type Scalar: Scalar;
    /// The type that long sums run in: the same lanes in double precision.
    type Wide: Real<Wide = Self::Wide>;
    const LANES: usize;

    fn of(value: f64) -> Self;
    /// `below` where self < 0, else `otherwise` (at 0, and for NaN).
    fn if_negative(self, below: Self, otherwise: Self) -> Self;
    fn at_least(self, floor: Self) -> Self;
    fn at_most(self, ceiling: Self) -> Self;
    /// Square root, with derivative 0 at 0: the norm's subgradient that the losses want.
    fn sqrt(self) -> Self;
    fn ln(self) -> Self;
    /// 2^self, relative error of a few ulp, within the type's normal range (no underflow to 0, no infinity).
    fn exp2(self) -> Self;
    fn tanh(self) -> Self;
    /// The nearest integer, with slope zero; |self| below 2^22 (2^51 in double precision).
    fn nearest(self) -> Self;
    fn widen(self) -> Self::Wide;
    fn narrow(wide: Self::Wide) -> Self;
    fn lane(self, lane: usize) -> Self::Scalar;
    fn from_lanes(lane: impl FnMut(usize) -> Self::Scalar) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }

    #[inline(always)]
    fn add_to(self, sum: &mut Self::Wide) {
        *sum = *sum + self.widen();
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.if_negative(-self, self)
    }

    /// e^self.
    #[inline(always)]
    fn exp(self) -> Self {
        (self * Self::of(std::f64::consts::LOG2_E)).exp2()
    }
}

/// A number that stands alone, so that decisions (contact, hull) can be taken on its value.
pub trait Scalar: Real<Scalar = Self> {
    fn value(self) -> f64;
}
