//! Reduction of a training step's terms over a batch, in one pass: their weighted total with its gradient, or each term
//! with the Jacobian that its backward needs.

use crate::batch::{Batch, Evaluate};
use crate::error::{Error, Result, unknown_choice};
use crate::losses::terms::Terms;
use crate::memory;
use crate::number::Data;
use crate::quantity::Quantity;
use crate::threads;

/// How the bodies' terms are reduced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduction {
    /// Mean over the bodies that count.
    Mean,
    Sum,
    /// No reduction: one number per body.
    None,
}

impl Reduction {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "mean" => Ok(Reduction::Mean),
            "sum" => Ok(Reduction::Sum),
            "none" => Ok(Reduction::None),
            _ => Err(unknown_choice("reduction", "\"mean\", \"sum\", \"none\"", name)),
        }
    }
}

/// Which bodies count, and how they are reduced. A body counts if it is `valid` (all are if None) and its first term is
/// not NaN, as it is for a body that is not finite.
pub struct Pool<'a> {
    /// One per body.
    pub valid: Option<&'a [bool]>,
    pub reduction: Reduction,
}

/// A batch's reduced terms.
pub struct Pooled {
    /// K numbers, or B·K without reduction; 0 if no body counts.
    pub terms: Vec<f64>,
    /// The share of each body in the reduced terms.
    pub shares: Vec<f64>,
}

impl Pool<'_> {
    /// The weighted total Σ λ · term with `weights` λ (one number, or one per body without reduction), and the terms.
    /// Writes the gradient of the total (of the sum of totals without reduction) by the vertices, B·V·3 numbers.
    pub fn weighted<T: Data>(
        &self,
        batch: &Batch<T>,
        quantity: &dyn Evaluate<T>,
        weights: &[f64],
        gradient: &mut [T],
    ) -> Result<(Vec<f64>, Pooled)> {
        let (bodies, size) = (batch.len(), quantity.size(batch.template()));
        if size != weights.len() {
            let expected = format!("{size} numbers, one per term");
            return Err(Error::Argument { name: "weights", expected, got: weights.len().to_string() });
        }
        if let Some(weight) = weights.iter().find(|&&weight| !T::of(weight).value().is_finite()) {
            let expected = "finite numbers".into();
            return Err(Error::Argument { name: "weights", expected, got: weight.to_string() });
        }
        let provisional = self.share((0..bodies).filter(|&body| self.valid(body)).count());
        let part = |i: usize| if self.valid(i / size) { T::of(weights[i % size] * provisional) } else { T::zero() };
        let buffers = || Ok((memory::collect((0..bodies * size).map(part)), memory::filled(T::zero(), bodies * size)));
        let (d_out, mut values) = memory::guarded(buffers)?;
        quantity.value_and_vjp_into(batch, &d_out, &mut values, gradient)?;

        // Bodies whose term is NaN are known only now. The mean was taken over them, too: rescale its gradient.
        let (pooled, share) = self.pool(&values, size)?;
        if share != provisional {
            let factor = T::of(share / provisional);
            gradient.iter_mut().for_each(|d| *d = *d * factor);
        }
        let total = |terms: &[f64]| -> f64 { terms.iter().zip(weights).map(|(term, weight)| term * weight).sum() };
        let totals = memory::guarded(|| Ok(memory::collect(pooled.terms.chunks_exact(size).map(total))))?;
        Ok((totals, pooled))
    }

    /// The terms. Writes the Jacobian of [`Batch::value_and_jacobian_into`].
    pub fn terms<T: Data>(&self, batch: &Batch<T>, terms: &Terms, jacobian: &mut [T]) -> Result<Pooled> {
        let size = terms.num_outputs(batch.template());
        let mut values = memory::guarded(|| Ok(memory::filled(T::zero(), batch.len() * size)))?;
        batch.value_and_jacobian_into(terms, &mut values, jacobian)?;
        Ok(self.pool(&values, size)?.0)
    }

    fn valid(&self, body: usize) -> bool {
        self.valid.is_none_or(|valid| valid[body])
    }

    /// The share of one of `count` bodies.
    fn share(&self, count: usize) -> f64 {
        if self.reduction == Reduction::Mean { 1.0 / count.max(1) as f64 } else { 1.0 }
    }

    /// Also returns the share of each counted body.
    fn pool<T: Data>(&self, values: &[T], size: usize) -> Result<(Pooled, f64)> {
        memory::guarded(|| Ok(self.reduce(values, size)))
    }

    fn reduce<T: Data>(&self, values: &[T], size: usize) -> (Pooled, f64) {
        let rows = || values.chunks_exact(size);
        let counts =
            memory::collect(rows().enumerate().map(|(body, row)| self.valid(body) && !row[0].value().is_nan()));
        let share = self.share(counts.iter().filter(|&&counts| counts).count());
        let counted = |body: usize, term: T, share: f64| if counts[body] { term.value() * share } else { 0.0 };
        let terms = match self.reduction {
            Reduction::None => {
                memory::collect(values.iter().enumerate().map(|(i, &term)| counted(i / size, term, 1.0)))
            }
            // `iter().sum()` of an empty iterator is −0.0; `0.0 +` makes it +0.0.
            _ => (0..size)
                .map(|k| 0.0 + rows().enumerate().map(|(body, row)| counted(body, row[k], share)).sum::<f64>())
                .collect(),
        };
        let shares = memory::collect(counts.iter().map(|&counts| if counts { share } else { 0.0 }));
        (Pooled { terms, shares }, share)
    }
}

/// The backward of [`Pool::terms`] from its Jacobian and shares: the gradient by the vertices, B·V·3 numbers. `widths` are
/// the terms', `d_terms` is the upstream gradient of the batch's terms, or of each body's; `normals` are the ground's, one
/// or B.
pub fn terms_backward<T: Data>(
    widths: &[usize],
    jacobian: &[T],
    shares: &[T],
    d_terms: &[T],
    normals: &[[T; 3]],
    gradient: &mut [T],
    interrupted: &(dyn Fn() -> bool + Sync),
) -> Result<()> {
    if shares.is_empty() {
        return Ok(());
    }
    let row = gradient.len() / shares.len();
    let bodies = jacobian.chunks_exact(row / 3 * widths.iter().sum::<usize>());
    let bodies = bodies.zip(gradient.chunks_exact_mut(row)).enumerate();
    let bodies = memory::guarded(|| Ok(memory::collect(bodies)))?;
    threads::each(bodies, true, interrupted, &|(body, (jacobian, gradient))| {
        if shares[body].value() == 0.0 {
            return gradient.fill(T::zero());
        }
        // A single row applies to all bodies.
        let rows = d_terms.len() / widths.len();
        let d_terms = &d_terms[body % rows * widths.len()..][..widths.len()];
        let (mut by_points, mut by_heights, mut rest) = (Vec::new(), Vec::new(), jacobian);
        for (&d_term, &width) in d_terms.iter().zip(widths) {
            let (own, others) = rest.split_at(row / 3 * width);
            if width == 1 { &mut by_heights } else { &mut by_points }.push((shares[body] * d_term, own));
            rest = others;
        }
        add_up(&by_points, &by_heights, normals[body % normals.len()], gradient);
    })
}

/// Vertices of a body that are put together at once, so that a part of the gradient stays in the cache.
const VERTICES: usize = 256;

/// Writes Σ factor · gradient by the points + (Σ factor · gradient by the heights) · normal.
fn add_up<T: Data>(by_points: &[(T, &[T])], by_heights: &[(T, &[T])], normal: [T; 3], gradient: &mut [T]) {
    let mut along = [T::zero(); VERTICES];
    for (block, gradient) in gradient.chunks_mut(3 * VERTICES).enumerate() {
        let along = &mut along[..gradient.len() / 3];
        weighted_sum(by_heights, VERTICES * block, along);
        weighted_sum(by_points, 3 * VERTICES * block, gradient);
        if !by_heights.is_empty() {
            for (d_point, &along) in gradient.as_chunks_mut::<3>().0.iter_mut().zip(&*along) {
                for k in 0..3 {
                    d_point[k] = d_point[k] + along * normal[k];
                }
            }
        }
    }
}

/// Writes Σ factor · numbers, from `start` on. The first product is not added to 0, for 0 + −0 would be +0.
fn weighted_sum<T: Data>(parts: &[(T, &[T])], start: usize, out: &mut [T]) {
    let Some((&(factor, numbers), rest)) = parts.split_first() else { return out.fill(T::zero()) };
    for (out, &number) in out.iter_mut().zip(&numbers[start..]) {
        *out = factor * number;
    }
    for &(factor, numbers) in rest {
        for (out, &number) in out.iter_mut().zip(&numbers[start..]) {
            *out = *out + factor * number;
        }
    }
}
