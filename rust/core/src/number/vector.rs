//! Vectors of three numbers.

use super::Real;

pub type Vec3<R> = [R; 3];

#[inline(always)]
pub fn zero<R: Real>() -> Vec3<R> {
    [R::zero(); 3]
}

#[inline(always)]
pub fn add<R: Real>(a: Vec3<R>, b: Vec3<R>) -> Vec3<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub fn sub<R: Real>(a: Vec3<R>, b: Vec3<R>) -> Vec3<R> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn scale<R: Real>(factor: R, a: Vec3<R>) -> Vec3<R> {
    [factor * a[0], factor * a[1], factor * a[2]]
}

#[inline(always)]
pub fn over<R: Real>(a: Vec3<R>, divisor: R) -> Vec3<R> {
    [a[0] / divisor, a[1] / divisor, a[2] / divisor]
}

#[inline(always)]
pub fn add_scaled<R: Real>(sum: &mut Vec3<R>, factor: R, a: Vec3<R>) {
    *sum = [factor.mul_add(a[0], sum[0]), factor.mul_add(a[1], sum[1]), factor.mul_add(a[2], sum[2])];
}

#[inline(always)]
pub fn dot<R: Real>(a: Vec3<R>, b: Vec3<R>) -> R {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub fn cross<R: Real>(a: Vec3<R>, b: Vec3<R>) -> Vec3<R> {
    let minor = |i: usize, j: usize| a[i].mul_add(b[j], -(a[j] * b[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// sum + a × b
#[inline(always)]
pub fn add_cross<R: Real>(sum: Vec3<R>, a: Vec3<R>, b: Vec3<R>) -> Vec3<R> {
    let add_minor = |sum: R, i: usize, j: usize| a[i].mul_add(b[j], a[j].neg_mul_add(b[i], sum));
    [add_minor(sum[0], 1, 2), add_minor(sum[1], 2, 0), add_minor(sum[2], 0, 1)]
}

#[inline(always)]
pub fn widen<R: Real>(a: Vec3<R>) -> Vec3<R::Wide> {
    [a[0].widen(), a[1].widen(), a[2].widen()]
}

/// [`Real::add_to`] of each.
#[inline(always)]
pub fn add_to<R: Real>(a: Vec3<R>, sum: &mut Vec3<R::Wide>) {
    for k in 0..3 {
        a[k].add_to(&mut sum[k]);
    }
}

/// [`widen`] by [`Real::widen_in_line`].
#[inline(always)]
pub fn widen_in_line<R: Real>(a: Vec3<R>) -> Vec3<R::Wide> {
    [a[0].widen_in_line(), a[1].widen_in_line(), a[2].widen_in_line()]
}

#[inline(always)]
pub fn narrow<R: Real>(a: Vec3<R::Wide>) -> Vec3<R> {
    [R::narrow(a[0]), R::narrow(a[1]), R::narrow(a[2])]
}

/// `a` as a constant of another number type.
#[inline(always)]
pub fn of<R: Real>(a: Vec3<f64>) -> Vec3<R> {
    [R::of(a[0]), R::of(a[1]), R::of(a[2])]
}
