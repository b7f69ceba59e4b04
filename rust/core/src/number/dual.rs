//! Dual numbers: a value and its derivative along one direction.
//!
//! In a quantity's forward they give the directional derivative (jvp), in its backward the derivative of the gradient
//! (Hessian-vector product); neither has to be written by hand.

use super::{Real, Scalar};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// value + slope · ε with ε² = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl Dual {
    pub fn new(value: f64, slope: f64) -> Self {
        Dual { value, slope }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Dual::new(self.value + other.value, self.slope + other.slope)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Dual::new(self.value - other.value, self.slope - other.slope)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Dual::new(self.value * other.value, self.slope * other.value + self.value * other.slope)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Dual::new(value, (self.slope - value * other.slope) / other.value)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Dual::new(-self.value, -self.slope)
    }
}

impl Real for Dual {
    type Scalar = Dual;
    type Data = f64;
    type Wide = Dual;
    const LANES: usize = 1;

    fn of(value: f64) -> Self {
        Dual::new(value, 0.0)
    }
    fn splat(number: f64) -> Self {
        Dual::of(number)
    }
    fn if_negative(self, below: Self, otherwise: Self) -> Self {
        if self.value < 0.0 { below } else { otherwise }
    }
    fn at_least(self, floor: Self) -> Self {
        if self.value < floor.value { floor } else { self }
    }
    fn at_most(self, ceiling: Self) -> Self {
        if self.value > ceiling.value { ceiling } else { self }
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        Dual::new(root, if root == 0.0 { 0.0 } else { self.slope / (2.0 * root) })
    }
    fn ln(self) -> Self {
        Dual::new(self.value.ln(), self.slope / self.value)
    }
    fn exp2(self) -> Self {
        let power = Real::exp2(self.value);
        Dual::new(power, power * std::f64::consts::LN_2 * self.slope)
    }
    fn tanh(self) -> Self {
        let t = Real::tanh(self.value);
        Dual::new(t, (1.0 - t * t) * self.slope)
    }
    fn nearest(self) -> Self {
        Dual::of(self.value.nearest())
    }
    fn widen(self) -> Self {
        self
    }
    fn narrow(wide: Self) -> Self {
        wide
    }
    fn lane(self, _: usize) -> Self {
        self
    }
    fn from_lanes(mut lane: impl FnMut(usize) -> Self) -> Self {
        lane(0)
    }
}

impl Scalar for Dual {
    fn value(self) -> f64 {
        self.value
    }
    fn read(data: f64) -> Self {
        Dual::of(data)
    }
    fn data(self) -> f64 {
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_follow_the_chain_rule() {
        let x = Dual::new(0.7, 1.0);
        let f = |x: f64| (x * x / (x + 2.0)).sqrt().ln() + x.tanh() * x.exp2();
        let got = (x * x / (x + Dual::of(2.0))).sqrt().ln() + x.tanh() * Real::exp2(x);
        let step = 1e-6;
        assert!((got.value - f(0.7)).abs() < 1e-14);
        assert!((got.slope - (f(0.7 + step) - f(0.7 - step)) / (2.0 * step)).abs() < 1e-9);
        assert_eq!(Dual::new(0.0, 3.0).sqrt().slope, 0.0);
    }
}
