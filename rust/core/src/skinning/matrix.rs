//! Three-by-three matrices of numbers.

use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled};

/// Rows.
pub type Mat3<R> = [[R; 3]; 3];

#[inline(always)]
pub fn apply<R: Real>(a: &Mat3<R>, v: Vec3<R>) -> Vec3<R> {
    std::array::from_fn(|i| a[i][0] * v[0] + a[i][1] * v[1] + a[i][2] * v[2])
}

#[inline(always)]
pub fn apply_transposed<R: Real>(a: &Mat3<R>, v: Vec3<R>) -> Vec3<R> {
    std::array::from_fn(|i| a[0][i] * v[0] + a[1][i] * v[1] + a[2][i] * v[2])
}

/// a += u vᵀ.
#[inline(always)]
pub fn add_outer<R: Real>(a: &mut Mat3<R>, u: Vec3<R>, v: Vec3<R>) {
    for i in 0..3 {
        add_scaled(&mut a[i], u[i], v);
    }
}

/// a b.
#[inline(always)]
pub fn times<R: Real>(a: &Mat3<R>, b: &Mat3<R>) -> Mat3<R> {
    std::array::from_fn(|i| apply_transposed(b, a[i]))
}

/// a bᵀ.
#[inline(always)]
pub fn times_transposed<R: Real>(a: &Mat3<R>, b: &Mat3<R>) -> Mat3<R> {
    std::array::from_fn(|i| apply(b, a[i]))
}

/// aᵀ b.
#[inline(always)]
pub fn transposed_times<R: Real>(a: &Mat3<R>, b: &Mat3<R>) -> Mat3<R> {
    std::array::from_fn(|i| apply_transposed(b, [a[0][i], a[1][i], a[2][i]]))
}

#[inline(always)]
pub fn accumulate<R: Real>(sum: &mut Mat3<R>, a: &Mat3<R>) {
    for i in 0..3 {
        sum[i] = add(sum[i], a[i]);
    }
}
