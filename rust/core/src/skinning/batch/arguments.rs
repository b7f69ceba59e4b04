//! The arrays of a call on many bodies: parameters, upstream gradients, gradients; and whether they fit together.

use crate::error::{Error, Result};
use crate::number::{Real, Scalar};
use crate::skinning::Skin;
use crate::skinning::rotation::Form;
use std::mem::take;
use std::ops::Range;

/// Vertices per tile: one to four vector registers, depending on the CPU.
pub const TILE: usize = 16;
/// One row of `width` numbers per body, or a single row shared by all; width 0 if not given.
#[derive(Clone, Copy)]
pub struct Rows<'a, T> {
    pub numbers: &'a [T],
    pub width: usize,
    pub shared: bool,
}

impl<'a, T> Rows<'a, T> {
    pub(super) fn of(&self, body: usize) -> &'a [T] {
        let start = if self.shared { 0 } else { body * self.width };
        &self.numbers[start..start + self.width]
    }
}

/// The parameters of all bodies, or a direction in their space.
#[derive(Clone, Copy)]
pub struct Bodies<'a, T> {
    pub pose: Rows<'a, T>,       // J·3 axis-angle or J·6
    pub betas: Rows<'a, T>,      // up to B
    pub expression: Rows<'a, T>, // up to E
    pub transl: Rows<'a, T>,     // 3 or none
}

/// The gradient by the posed bodies; an empty array counts as zeros.
#[derive(Clone, Copy)]
pub struct Upstream<'a, T> {
    pub vertices: &'a [T], // (B, V, 3)
    pub joints: &'a [T],   // (B, J, 3)
}

/// Gradients by pose, betas, expression and translation, one row per body; an empty one is not computed.
pub type Gradients<'a, T> = [&'a mut [T]; 4];

/// Checks that a direction has the shapes of the parameters; parts of it may be missing.
pub(super) fn check_direction<T: Copy>(bodies: &Bodies<T>, along: &Bodies<T>, num_bodies: usize) -> Result<()> {
    let pairs = [
        ("along_pose", bodies.pose, along.pose),
        ("along_betas", bodies.betas, along.betas),
        ("along_expression", bodies.expression, along.expression),
        ("along_transl", bodies.transl, along.transl),
    ];
    for (name, values, slopes) in pairs {
        check(name, slopes.width, slopes.width.min(1) * values.width)?;
        check(name, slopes.numbers.len(), slopes.width * if slopes.shared { 1 } else { num_bodies })?;
    }
    Ok(())
}

/// Numbers per body in each of the gradients; `given` are those of the parameters.
pub(super) fn gradient_widths<T>(gradients: &Gradients<T>, given: [usize; 4], num_bodies: usize) -> Result<[usize; 4]> {
    let names = ["d_pose", "d_betas", "d_expression", "d_transl"];
    let mut widths = [0; 4];
    for (k, numbers) in gradients.iter().enumerate() {
        let width = numbers.len() / num_bodies.max(1);
        check(names[k], numbers.len(), width.min(given[k]) * num_bodies)?;
        widths[k] = width;
    }
    Ok(widths)
}

/// Index of the last non-zero column, plus one.
pub(super) fn used<T: Scalar>(rows: Rows<T>) -> usize {
    let last = |row: &[T]| row.iter().rposition(|x| x.value() != 0.0).map_or(0, |last| last + 1);
    rows.numbers.chunks_exact(rows.width.max(1)).map(last).max().unwrap_or(0)
}

pub(super) fn read<R: Scalar>(numbers: &[R::Data]) -> Vec<R> {
    numbers.iter().map(|&x| R::read(x)).collect()
}

pub(super) fn triple<R: Real>(numbers: &[R]) -> [R; 3] {
    std::array::from_fn(|axis| numbers.get(axis).copied().unwrap_or(R::zero()))
}

/// The rows of some bodies; empty if `numbers` is.
pub(super) fn rows<T>(numbers: &[T], bodies: Range<usize>, row: usize) -> &[T] {
    numbers.get(bodies.start * row..bodies.end * row).unwrap_or_default()
}

/// Splits off the first n.
pub(super) fn front<'a, T>(rest: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let (front, back) = take(rest).split_at_mut(n);
    *rest = back;
    front
}

pub(super) fn fronts<'a, T>(rest: &mut Gradients<'a, T>, sizes: [usize; 4]) -> Gradients<'a, T> {
    std::array::from_fn(|k| front(&mut rest[k], sizes[k]))
}

pub(super) fn check(name: &'static str, got: usize, expected: usize) -> Result<()> {
    match got == expected {
        true => Ok(()),
        false => Err(Error::Argument { name, expected: format!("{expected} numbers"), got: got.to_string() }),
    }
}

pub(super) fn check_rows<T: Scalar>(skin: &Skin<T, TILE>, num_bodies: usize, bodies: &Bodies<T>) -> Result<()> {
    let joints = skin.num_joints();
    let form = Form::of_width(bodies.pose.width / joints);
    if form.is_none() || !bodies.pose.width.is_multiple_of(joints) {
        let expected = format!("{joints} joints of 3 or 6 numbers");
        return Err(Error::Argument { name: "pose", expected, got: format!("{} numbers", bodies.pose.width) });
    }
    let rows = [
        ("pose", bodies.pose, bodies.pose.width),
        ("betas", bodies.betas, bodies.betas.width.min(skin.num_betas())),
        ("expression", bodies.expression, bodies.expression.width.min(skin.num_expressions())),
        ("transl", bodies.transl, if bodies.transl.width == 0 { 0 } else { 3 }),
    ];
    for (name, rows, width) in rows {
        check(name, rows.width, width)?;
        check(name, rows.numbers.len(), width * if rows.shared { 1 } else { num_bodies })?;
    }
    Ok(())
}
