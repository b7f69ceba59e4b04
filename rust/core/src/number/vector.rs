//! Three-vectors of numbers.

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
pub fn add_scaled<R: Real>(sum: &mut Vec3<R>, factor: R, a: Vec3<R>) {
    *sum = add(*sum, scale(factor, a));
}

#[inline(always)]
pub fn dot<R: Real>(a: Vec3<R>, b: Vec3<R>) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn cross<R: Real>(a: Vec3<R>, b: Vec3<R>) -> Vec3<R> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub fn widen<R: Real>(a: Vec3<R>) -> Vec3<R::Wide> {
    a.map(R::widen)
}

#[inline(always)]
pub fn narrow<R: Real>(a: Vec3<R::Wide>) -> Vec3<R> {
    a.map(R::narrow)
}

/// `a` as a constant of another number type.
#[inline(always)]
pub fn of<R: Real>(a: Vec3<f64>) -> Vec3<R> {
    a.map(R::of)
}
