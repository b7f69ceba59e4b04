//! The five operations that every quantity has: value, vjp, jvp, Hessian-vector product, value with vjp.

use super::Batch;
use super::groups::OnLanes;
use crate::error::Result;
use crate::losses::term::OwnGradient;
use crate::losses::terms::Terms;
use crate::memory;
use crate::number::{Data, Dual, Real, Scalar, all_finite};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::template::Template;

/// The operations of a quantity in the precision `T`, written into given memory. A trait without generic methods, for
/// quantities whose type is known only at run time.
pub trait Evaluate<T: Data>: Send + Sync {
    /// K, the numbers per body.
    fn size(&self, template: &Template) -> usize;

    /// The quantity of each body: B·K numbers.
    fn value_into(&self, batch: &Batch<T>, out: &mut [T]) -> Result<()>;

    /// The quantity, and the gradient of Σ d_out · value by the vertices: B·V·3 numbers, in one pass.
    fn value_and_vjp_into(&self, batch: &Batch<T>, d_out: &[T], out: &mut [T], d_vertices: &mut [T]) -> Result<()>;

    /// The gradient of Σ d_out · value alone.
    fn vjp_into(&self, batch: &Batch<T>, d_out: &[T], d_vertices: &mut [T]) -> Result<()> {
        let mut out = memory::guarded(|| Ok(memory::filled(T::zero(), d_out.len())))?;
        self.value_and_vjp_into(batch, d_out, &mut out, d_vertices)
    }

    /// The derivative of the value along `d_vertices`: B·K numbers.
    fn jvp_into(&self, batch: &Batch<T>, d_vertices: &[T], out: &mut [T]) -> Result<()>;

    /// The derivative of `vjp(d_out)` along `d_vertices`, a Hessian-vector product: B·V·3 numbers.
    fn hvp_into(&self, batch: &Batch<T>, d_out: &[T], d_vertices: &[T], out: &mut [T]) -> Result<()>;
}

impl<T: Data, Q: Quantity> Evaluate<T> for Q {
    fn size(&self, template: &Template) -> usize {
        self.num_outputs(template)
    }

    fn value_into(&self, batch: &Batch<T>, out: &mut [T]) -> Result<()> {
        self.check(batch.template)?;
        let size = self.num_outputs(batch.template);
        let not_finite = |row: &mut [T]| row.fill(T::of(f64::NAN));
        batch.each_group(out.chunks_exact_mut(size), not_finite, |_, out| Forward { quantity: self, size, out })
    }

    fn value_and_vjp_into(&self, batch: &Batch<T>, d_out: &[T], out: &mut [T], d_vertices: &mut [T]) -> Result<()> {
        self.check(batch.template)?;
        let size = self.num_outputs(batch.template);
        let rows = out.chunks_exact_mut(size).zip(d_vertices.chunks_exact_mut(batch.row()));
        batch.each_group(rows, nan_and_zero, |group, rows| {
            let d_out = group.bodies.iter().map(|&body| &d_out[body * size..][..size]).collect();
            let (out, d_vertices) = rows.into_iter().unzip();
            ForwardAndBackward { quantity: self, size, d_out, out, d_vertices }
        })
    }

    fn jvp_into(&self, batch: &Batch<T>, d_vertices: &[T], out: &mut [T]) -> Result<()> {
        self.check(batch.template)?;
        let size = self.num_outputs(batch.template);
        batch.each_body((out, size), |body, out| {
            out.fill(T::zero());
            batch.on_dual(body, d_vertices, |posed| {
                let mut value = memory::filled(Dual::zero(), size);
                self.forward(posed, &mut value);
                for (out, value) in out.iter_mut().zip(value) {
                    *out = finite_or_zero(T::of(value.slope));
                }
            });
        })
    }

    fn hvp_into(&self, batch: &Batch<T>, d_out: &[T], d_vertices: &[T], out: &mut [T]) -> Result<()> {
        self.check(batch.template)?;
        let size = self.num_outputs(batch.template);
        batch.each_body((out, batch.row()), |body, out| {
            out.fill(T::zero());
            batch.on_dual(body, d_vertices, |posed| {
                let d_out = memory::collect(d_out[body * size..][..size].iter().map(|d| Dual::of(d.value())));
                let mut d_points = memory::filled([Dual::zero(); 3], posed.points.len());
                self.forward_and_backward(posed, &d_out, &mut memory::filled(Dual::zero(), size), &mut d_points);
                posed.template.closing.backward(&mut d_points);
                for (out, d) in out.iter_mut().zip(d_points.as_flattened()) {
                    *out = T::of(d.slope);
                }
                zero_if_undefined(out, all_finite(&d_out));
            });
        })
    }
}

impl<T: Data> Batch<'_, T> {
    /// The terms, and their Jacobian: for each body the gradient of each number, one after the other, by the vertices or
    /// by their heights: V·[width](Terms::widths).
    pub fn value_and_jacobian_into(&self, terms: &Terms, out: &mut [T], jacobian: &mut [T]) -> Result<()> {
        terms.check(self.template)?;
        let size = terms.num_outputs(self.template);
        let rows = out.chunks_exact_mut(size).zip(jacobian.chunks_exact_mut(terms.jacobian_row(self.template)));
        self.each_group(rows, nan_and_zero, |_, rows| {
            let (out, jacobian) = rows.into_iter().unzip();
            ForwardAndJacobian { terms, size, out, jacobian }
        })
    }

    /// [`Evaluate::value_into`] a new vector.
    pub fn value<Q: Quantity>(&self, quantity: &Q) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.num_outputs(self.template))?;
        quantity.value_into(self, &mut out).map(|()| out)
    }

    /// [`Evaluate::value_and_vjp_into`] new vectors.
    pub fn value_and_vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<(Vec<T>, Vec<T>)> {
        let (mut out, mut d_vertices) = (self.rows(quantity.num_outputs(self.template))?, self.rows(self.row())?);
        quantity.value_and_vjp_into(self, d_out, &mut out, &mut d_vertices).map(|()| (out, d_vertices))
    }

    /// [`Evaluate::vjp_into`] a new vector.
    pub fn vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<Vec<T>> {
        let mut d_vertices = self.rows(self.row())?;
        quantity.vjp_into(self, d_out, &mut d_vertices).map(|()| d_vertices)
    }

    /// [`Evaluate::jvp_into`] a new vector.
    pub fn jvp<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.num_outputs(self.template))?;
        quantity.jvp_into(self, d_vertices, &mut out).map(|()| out)
    }

    /// [`Evaluate::hvp_into`] a new vector.
    pub fn hvp<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(self.row())?;
        quantity.hvp_into(self, d_out, d_vertices, &mut out).map(|()| out)
    }
}

/// The rows of a body that is not finite: its values are NaN, its gradient is zero.
fn nan_and_zero<T: Data>((values, gradient): (&mut [T], &mut [T])) {
    values.fill(T::of(f64::NAN));
    gradient.fill(T::zero());
}

struct Forward<'a, T, Q> {
    quantity: &'a Q,
    size: usize,
    out: Vec<&'a mut [T]>,
}

impl<T: Data, Q: Quantity> OnLanes<T> for Forward<'_, T, Q> {
    fn run<R: Real<Data = T>>(mut self, posed: &PosedBody<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        self.quantity.forward(posed, &mut out);
        R::write_rows(&out, &mut self.out);
    }
}

struct ForwardAndBackward<'a, T, Q> {
    quantity: &'a Q,
    size: usize,
    d_out: Vec<&'a [T]>,
    out: Vec<&'a mut [T]>,
    d_vertices: Vec<&'a mut [T]>,
}

impl<T: Data, Q: Quantity> OnLanes<T> for ForwardAndBackward<'_, T, Q> {
    fn run<R: Real<Data = T>>(mut self, posed: &PosedBody<R>) {
        let last = self.d_out.len() - 1;
        let mut d_out = memory::with_capacity(self.size);
        for k in 0..self.size {
            d_out.push(R::from_lanes(|lane| R::Scalar::read(self.d_out[lane.min(last)][k])));
        }
        let mut out = memory::filled(R::zero(), self.size);
        let mut d_points = memory::filled([R::zero(); 3], posed.points.len());
        self.quantity.forward_and_backward(posed, &d_out, &mut out, &mut d_points);
        posed.template.closing.backward(&mut d_points);
        R::write_rows(&out, &mut self.out);
        let d_vertices = &d_points[..posed.template.mesh.num_vertices];
        R::write_rows(d_vertices.as_flattened(), &mut self.d_vertices);
        for (row, d_out) in self.d_vertices.iter_mut().zip(&self.d_out) {
            zero_if_undefined(row, all_finite(d_out));
        }
    }
}

struct ForwardAndJacobian<'a, T> {
    terms: &'a Terms,
    size: usize,
    out: Vec<&'a mut [T]>,
    jacobian: Vec<&'a mut [T]>,
}

impl<T: Data> OnLanes<T> for ForwardAndJacobian<'_, T> {
    fn run<R: Real<Data = T>>(mut self, posed: &PosedBody<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        let mut gradients = self.terms.forward_and_jacobian(posed, &mut out);
        R::write_rows(&out, &mut self.out);
        let mut start = 0;
        for gradient in &mut gradients {
            let numbers = match gradient {
                OwnGradient::Points(d_points) => {
                    posed.template.closing.backward(d_points);
                    d_points[..posed.template.mesh.num_vertices].as_flattened()
                }
                OwnGradient::Heights(d_heights) => d_heights,
            };
            let rows = self.jacobian.iter_mut().map(|row| &mut row[start..start + numbers.len()]);
            R::write_rows(numbers, &mut rows.collect::<Vec<_>>());
            start += numbers.len();
        }
        self.jacobian.into_iter().for_each(|row| zero_if_undefined(row, true));
    }
}

/// A gradient that is not finite, though the upstream gradient is, belongs to a body on which the quantity is undefined
/// (no volume, coordinates out of range): it becomes zero.
fn zero_if_undefined<T: Scalar>(gradient: &mut [T], upstream_is_finite: bool) {
    if upstream_is_finite && !all_finite(gradient) {
        gradient.fill(T::zero());
    }
}

fn finite_or_zero<T: Scalar>(x: T) -> T {
    if x.value().is_finite() { x } else { T::zero() }
}
