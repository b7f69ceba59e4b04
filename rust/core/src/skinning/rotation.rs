//! Rotation matrices of a pose, in either form, and their derivatives. For double precision (or its duals).

use super::matrix::Mat3;
use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, scale, sub};
use std::f64::consts::PI;

/// The representation of each joint's rotation relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A rotation vector: its direction the axis, its length the angle in radians.
    AxisAngle,
    /// The first two columns of the matrix, made orthonormal by Gram-Schmidt (Zhou et al. 2019).
    SixD,
}

impl Form {
    /// Numbers per joint.
    pub fn width(self) -> usize {
        match self {
            Form::AxisAngle => 3,
            Form::SixD => 6,
        }
    }

    pub fn of_width(width: usize) -> Option<Form> {
        [Form::AxisAngle, Form::SixD].into_iter().find(|form| form.width() == width)
    }

    #[inline(always)]
    pub fn forward<R: Real>(self, numbers: &[R]) -> Mat3<R> {
        match self {
            Form::AxisAngle => axis_angle(first(numbers)),
            Form::SixD => six_d(first(numbers), second(numbers)),
        }
    }

    /// The gradient by the numbers, given the one by the matrix.
    #[inline(always)]
    pub fn backward<R: Real>(self, numbers: &[R], d_matrix: &Mat3<R>, d_numbers: &mut [R]) {
        match self {
            Form::AxisAngle => d_numbers.copy_from_slice(&axis_angle_backward(first(numbers), d_matrix)),
            Form::SixD => {
                let [d_first, d_second] = six_d_backward(first(numbers), second(numbers), d_matrix);
                d_numbers[..3].copy_from_slice(&d_first);
                d_numbers[3..].copy_from_slice(&d_second);
            }
        }
    }
}

#[inline(always)]
fn first<R: Real>(numbers: &[R]) -> Vec3<R> {
    [numbers[0], numbers[1], numbers[2]]
}

#[inline(always)]
fn second<R: Real>(numbers: &[R]) -> Vec3<R> {
    [numbers[3], numbers[4], numbers[5]]
}

/// Rodrigues: I cos θ + a [v]× + b v vᵀ with a = sin θ / θ, b = (1 − cos θ) / θ².
#[inline(always)]
fn axis_angle<R: Real>(v: Vec3<R>) -> Mat3<R> {
    let square = dot(v, v);
    let Rodrigues { a, b, .. } = Rodrigues::of(square);
    let (diagonal, turn) = (R::of(1.0) - b * square, scale(a, v));
    let share = |i: usize, k: usize| b * v[i] * v[k];
    [
        [diagonal + share(0, 0), share(0, 1) - turn[2], share(0, 2) + turn[1]],
        [share(1, 0) + turn[2], diagonal + share(1, 1), share(1, 2) - turn[0]],
        [share(2, 0) - turn[1], share(2, 1) + turn[0], diagonal + share(2, 2)],
    ]
}

#[inline(always)]
fn axis_angle_backward<R: Real>(v: Vec3<R>, d: &Mat3<R>) -> Vec3<R> {
    let square = dot(v, v);
    let Rodrigues { a, b, a_slope, b_slope } = Rodrigues::of(square);
    let trace = d[0][0] + d[1][1] + d[2][2];
    let turn = [d[2][1] - d[1][2], d[0][2] - d[2][0], d[1][0] - d[0][1]];
    let right: Vec3<R> = std::array::from_fn(|i| dot(d[i], v));
    let left: Vec3<R> = std::array::from_fn(|i| d[0][i] * v[0] + d[1][i] * v[1] + d[2][i] * v[2]);
    let by_square = a_slope * dot(turn, v) + b_slope * (dot(v, right) - square * trace) - b * trace;
    let mut d_v = scale(a, turn);
    add_scaled(&mut d_v, b, add(right, left));
    add_scaled(&mut d_v, by_square + by_square, v);
    d_v
}

#[inline(always)]
fn six_d<R: Real>(x: Vec3<R>, y: Vec3<R>) -> Mat3<R> {
    let (e, _) = unit(x);
    let (f, _) = unit(sub(y, scale(dot(e, y), e)));
    let g = cross(e, f);
    std::array::from_fn(|i| [e[i], f[i], g[i]])
}

#[inline(always)]
fn six_d_backward<R: Real>(x: Vec3<R>, y: Vec3<R>, d: &Mat3<R>) -> [Vec3<R>; 2] {
    let (e, x_length) = unit(x);
    let (f, y_length) = unit(sub(y, scale(dot(e, y), e)));
    let [d_e, d_f, d_g]: [Vec3<R>; 3] = std::array::from_fn(|column| std::array::from_fn(|row| d[row][column]));
    let d_across = unit_backward(f, y_length, add(d_f, cross(d_g, e)));
    let along = dot(e, d_across);
    let mut d_e = add(d_e, cross(f, d_g));
    add_scaled(&mut d_e, -dot(e, y), d_across);
    add_scaled(&mut d_e, -along, y);
    [unit_backward(e, x_length, d_e), sub(d_across, scale(along, e))]
}

/// The direction and the length of a vector; a zero vector has no direction: NaN.
#[inline(always)]
fn unit<R: Real>(v: Vec3<R>) -> (Vec3<R>, R) {
    let length = dot(v, v).sqrt();
    ([v[0] / length, v[1] / length, v[2] / length], length)
}

#[inline(always)]
fn unit_backward<R: Real>(direction: Vec3<R>, length: R, d: Vec3<R>) -> Vec3<R> {
    let across = sub(d, scale(dot(direction, d), direction));
    scale(R::of(1.0) / length, across)
}

/// a = sin θ / θ and b = (1 − cos θ) / θ² as functions of θ², with their slopes: smooth, also at zero.
struct Rodrigues<R> {
    a: R,
    b: R,
    a_slope: R,
    b_slope: R,
}

impl<R: Real> Rodrigues<R> {
    #[inline(always)]
    fn of(square: R) -> Self {
        // Series below one radian, where the closed forms cancel.
        let large = square.at_least(R::of(1.0));
        let angle = large.sqrt();
        let (sin, cos) = sin_cos(angle);
        let a = sin / angle;
        let b = (R::of(1.0) - cos) / large;
        let half = R::of(0.5) / large;
        let small = square.at_most(R::of(1.0));
        let pick = square - R::of(1.0);
        Rodrigues {
            a: pick.if_negative(polynomial(&SIN, small), a),
            b: pick.if_negative(polynomial(&VERSIN, small), b),
            a_slope: pick.if_negative(polynomial(&SIN_SLOPE, small), (cos - a) * half),
            b_slope: pick.if_negative(polynomial(&VERSIN_SLOPE, small), (a - b - b) * half),
        }
    }
}

/// Terms whose remainder is below double precision for |θ| ≤ π/2.
const TERMS: usize = 12;

/// (−1)^i / (2i + first)!: with 1 the series of sin θ / θ in θ², with 2 that of (1 − cos θ) / θ².
const fn series(first: usize) -> [f64; TERMS] {
    let mut table = [0.0; TERMS];
    let mut term = 1.0 / first as f64;
    let mut i = 0;
    while i < TERMS {
        table[i] = term;
        term /= -(((2 * i + first + 1) * (2 * i + first + 2)) as f64);
        i += 1;
    }
    table
}

const SIN: [f64; TERMS] = series(1);
const VERSIN: [f64; TERMS] = series(2);
const SIN_SLOPE: [f64; TERMS] = slopes(&SIN);
const VERSIN_SLOPE: [f64; TERMS] = slopes(&VERSIN);

/// The coefficients of a polynomial's derivative.
const fn slopes(table: &[f64; TERMS]) -> [f64; TERMS] {
    let mut slopes = [0.0; TERMS];
    let mut i = 1;
    while i < TERMS {
        slopes[i - 1] = i as f64 * table[i];
        i += 1;
    }
    slopes
}

#[inline(always)]
fn polynomial<R: Real>(table: &[f64; TERMS], x: R) -> R {
    let mut sum = R::of(table[TERMS - 1]);
    for &coefficient in table[..TERMS - 1].iter().rev() {
        sum = sum * x + R::of(coefficient);
    }
    sum
}

/// π in two parts: multiples of the first, up to a million, are exact.
const PI_HIGH: f64 = (PI * 1_073_741_824.0) as i64 as f64 / 1_073_741_824.0;
const PI_LOW: f64 = (PI - PI_HIGH) + 1.2246467991473532e-16;

/// Both from additions and multiplications only: the same bits on every machine.
#[inline(always)]
fn sin_cos<R: Real>(x: R) -> (R, R) {
    let half_turns = (x * R::of(1.0 / PI)).nearest();
    let f = (x - half_turns * R::of(PI_HIGH)) - half_turns * R::of(PI_LOW);
    let odd = half_turns - R::of(2.0) * (half_turns * R::of(0.5)).nearest();
    let sign = R::of(1.0) - R::of(2.0) * odd * odd;
    let square = f * f;
    (sign * f * polynomial(&SIN, square), sign * (R::of(1.0) - square * polynomial(&VERSIN, square)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Dual;

    #[test]
    fn sin_cos_is_within_rounding_of_the_platform() {
        for i in -40_000..40_000 {
            let x = i as f64 * 0.00731;
            let (sin, cos) = sin_cos(x);
            assert!((sin - x.sin()).abs() < 4e-16 && (cos - x.cos()).abs() < 4e-16, "{x}");
        }
        let far = 1e6;
        assert!((sin_cos(far).0 - f64::sin(far)).abs() < 1e-15);
    }

    /// The backward is the derivative of the forward: against dual numbers, at zero, across the seam, near π and beyond.
    #[test]
    fn backward_is_the_derivative() {
        let direction = [0.36, -0.48, 0.8];
        let d: Mat3<f64> = [[0.3, -0.2, 0.9], [0.5, 0.1, -0.7], [-0.4, 0.8, 0.6]];
        for angle in [0.0, 1e-200, 1e-9, 0.1, 1.0 - 1e-12, 1.0, 2.0, PI - 1e-9, PI, 6.3, 40.0] {
            check(Form::AxisAngle, &scale(angle, direction), &d);
        }
        check(Form::SixD, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &d);
        check(Form::SixD, &[0.3, -2.0, 0.4, 0.9, 0.1, -0.7], &d);
    }

    fn check(form: Form, numbers: &[f64], d: &Mat3<f64>) {
        let mut got = vec![0.0; numbers.len()];
        form.backward(numbers, d, &mut got);
        for k in 0..numbers.len() {
            let along: Vec<_> = (0..numbers.len()).map(|i| Dual::new(numbers[i], (i == k) as i32 as f64)).collect();
            let slopes = form.forward(&along);
            let want: f64 = (0..9).map(|i| d[i / 3][i % 3] * slopes[i / 3][i % 3].slope).sum();
            assert!((got[k] - want).abs() < 1e-14, "{form:?} {numbers:?} {k}: {} {want}", got[k]);
        }
    }
}
