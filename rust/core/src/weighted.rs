//! The weighted total of a training step: Σ_k λ_k term_k of each body, reduced over a batch, with its gradient in one pass.

use crate::batch::Batch;
use crate::error::{Error, Result};
use crate::number::Data;
use crate::quantity::{Quantity, unknown_choice};

/// How bodies are put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduction {
    /// Over the bodies that count.
    Mean,
    Sum,
    /// One number a body.
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

/// A body counts if `valid` says so (or is None) and its first term is a number: it is NaN for a broken body.
pub struct Weighted<'a> {
    /// λ, one a term.
    pub weights: &'a [f64],
    /// One a body.
    pub valid: Option<&'a [bool]>,
    pub reduction: Reduction,
}

/// What is known of a batch besides the gradient.
pub struct Totals<T> {
    /// Σ λ · term: one number, or one a body where nothing is reduced; 0 where no body counts.
    pub totals: Vec<T>,
    /// The unweighted terms: K numbers, or B·K.
    pub terms: Vec<T>,
    /// What each body counts for.
    pub shares: Vec<T>,
}

impl Weighted<'_> {
    /// Writes the gradient of the total (of Σ totals where nothing is reduced) by the vertices, B·V·3 numbers.
    pub fn evaluate<T: Data, Q: Quantity>(
        &self,
        batch: &Batch<T>,
        quantity: &Q,
        gradient: &mut [T],
    ) -> Result<Totals<T>> {
        let (bodies, size) = (batch.len(), self.size(batch, quantity)?);
        let dealt = self.share((0..bodies).filter(|&body| self.valid(body)).count());
        let d_out: Vec<T> = (0..bodies * size)
            .map(|i| if self.valid(i / size) { T::of(self.weights[i % size] * dealt) } else { T::zero() })
            .collect();
        let mut values = vec![T::zero(); bodies * size];
        batch.value_and_vjp_into(quantity, &d_out, &mut values, gradient)?;

        // Broken bodies are known only now, after the shares of a mean were dealt out: put that right.
        let counts = self.counts(&values, size);
        let share = self.share(counts.iter().filter(|&&counts| counts).count());
        if share != dealt {
            let factor = T::of(share / dealt);
            gradient.iter_mut().for_each(|d| *d = *d * factor);
        }
        Ok(self.reduce(&values, &counts, share))
    }

    /// The same without a gradient.
    pub fn evaluate_alone<T: Data, Q: Quantity>(&self, batch: &Batch<T>, quantity: &Q) -> Result<Totals<T>> {
        let size = self.size(batch, quantity)?;
        let values = batch.value(quantity)?;
        let counts = self.counts(&values, size);
        let share = self.share(counts.iter().filter(|&&counts| counts).count());
        Ok(self.reduce(&values, &counts, share))
    }

    /// Numbers a body, if there is a weight for each.
    fn size<T: Data, Q: Quantity>(&self, batch: &Batch<T>, quantity: &Q) -> Result<usize> {
        let size = quantity.len(batch.template());
        if size == self.weights.len() {
            return Ok(size);
        }
        let expected = format!("{size} numbers, one a term");
        Err(Error::Argument { name: "weights", expected, got: self.weights.len().to_string() })
    }

    fn valid(&self, body: usize) -> bool {
        self.valid.is_none_or(|valid| valid[body])
    }

    fn counts<T: Data>(&self, values: &[T], size: usize) -> Vec<bool> {
        let number = |body: usize| !values[body * size].value().is_nan();
        (0..values.len() / size).map(|body| self.valid(body) && number(body)).collect()
    }

    /// What one of `count` bodies counts for.
    fn share(&self, count: usize) -> f64 {
        if self.reduction == Reduction::Mean { 1.0 / count.max(1) as f64 } else { 1.0 }
    }

    fn reduce<T: Data>(&self, values: &[T], counts: &[bool], share: f64) -> Totals<T> {
        let size = self.weights.len();
        let shares: Vec<f64> = counts.iter().map(|&counts| if counts { share } else { 0.0 }).collect();
        let rows = || values.chunks_exact(size).zip(&shares).filter(|(_, share)| **share > 0.0);
        let weigh = |terms: &[f64]| -> f64 { terms.iter().zip(self.weights).map(|(term, weight)| term * weight).sum() };
        let (totals, terms) = if self.reduction == Reduction::None {
            let terms: Vec<f64> =
                (0..values.len()).map(|i| if counts[i / size] { values[i].value() } else { 0.0 }).collect();
            (terms.chunks_exact(size).map(weigh).collect(), terms)
        } else {
            let terms: Vec<f64> =
                (0..size).map(|k| rows().map(|(row, share)| row[k].value() * share).sum::<f64>()).collect();
            (vec![weigh(&terms)], terms)
        };
        let narrow = |numbers: Vec<f64>| numbers.into_iter().map(T::of).collect();
        Totals { totals: narrow(totals), terms: narrow(terms), shares: narrow(shares) }
    }
}
