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

impl<T: Data> Batch<'_, T> {
    /// The quantity of each body: B·K numbers.
    pub fn value_into<Q: Quantity>(&self, quantity: &Q, out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let size = quantity.num_outputs(self.template);
        self.each([(out, size)], |group, [out]| {
            self.on_lanes(group, Forward { quantity, size, out });
        })
    }

    /// The quantity, and the gradient of Σ d_out · value by the vertices: B·V·3 numbers, in one pass.
    pub fn value_and_vjp_into<Q: Quantity>(
        &self,
        quantity: &Q,
        d_out: &[T],
        out: &mut [T],
        d_vertices: &mut [T],
    ) -> Result<()> {
        quantity.check(self.template)?;
        let (size, row) = (quantity.num_outputs(self.template), 3 * self.template.mesh.num_vertices);
        self.each([(out, size), (d_vertices, row)], |group, [out, d_vertices]| {
            let d_out = group.bodies.iter().map(|&body| &d_out[body * size..][..size]).collect();
            let work = ForwardAndBackward { template: self.template, quantity, size, d_out, out, d_vertices };
            self.on_lanes(group, work);
        })
    }

    /// The gradient of Σ d_out · value alone.
    pub fn vjp_into<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &mut [T]) -> Result<()> {
        let mut out = memory::guarded(|| Ok(memory::filled(T::zero(), d_out.len())))?;
        self.value_and_vjp_into(quantity, d_out, &mut out, d_vertices)
    }

    /// The terms, and their Jacobian: for each body the gradient of each number, one after the other, by the vertices or
    /// by their heights: V·[width](Terms::widths).
    pub fn value_and_jacobian_into(&self, terms: &Terms, out: &mut [T], jacobian: &mut [T]) -> Result<()> {
        terms.check(self.template)?;
        let (size, row) = (terms.num_outputs(self.template), terms.jacobian_row(self.template));
        self.each([(out, size), (jacobian, row)], |group, [out, jacobian]| {
            self.on_lanes(group, ForwardAndJacobian { terms, size, out, jacobian });
        })
    }

    /// The derivative of the value along `d_vertices`: B·K numbers.
    pub fn jvp_into<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T], out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let size = quantity.num_outputs(self.template);
        self.each_body((out, size), |body, out| {
            out.fill(T::zero());
            self.on_dual(body, d_vertices, |posed| {
                let mut value = memory::filled(Dual::zero(), size);
                quantity.forward(posed, &mut value);
                for (out, value) in out.iter_mut().zip(value) {
                    *out = finite_or_zero(T::of(value.slope));
                }
            });
        })
    }

    /// The derivative of `vjp(d_out)` along `d_vertices`, a Hessian-vector product: B·V·3 numbers.
    pub fn vjp_jvp_into<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T], out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let (size, row) = (quantity.num_outputs(self.template), 3 * self.template.mesh.num_vertices);
        self.each_body((out, row), |body, out| {
            out.fill(T::zero());
            self.on_dual(body, d_vertices, |posed| {
                let d_out = memory::collect(d_out[body * size..][..size].iter().map(|d| Dual::of(d.value())));
                let mut d_points = memory::filled([Dual::zero(); 3], posed.points.len());
                quantity.forward_and_backward(posed, &d_out, &mut memory::filled(Dual::zero(), size), &mut d_points);
                posed.template.closing.backward(&mut d_points);
                for (out, d) in out.iter_mut().zip(d_points.as_flattened()) {
                    *out = T::of(d.slope);
                }
                zero_if_undefined(out, all_finite(&d_out));
            });
        })
    }

    /// [`Batch::value_into`] a new vector.
    pub fn value<Q: Quantity>(&self, quantity: &Q) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.num_outputs(self.template))?;
        self.value_into(quantity, &mut out).map(|()| out)
    }

    /// [`Batch::value_and_vjp_into`] new vectors.
    pub fn value_and_vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<(Vec<T>, Vec<T>)> {
        let (mut out, mut d_vertices) = (self.rows(quantity.num_outputs(self.template))?, self.rows(self.row())?);
        self.value_and_vjp_into(quantity, d_out, &mut out, &mut d_vertices).map(|()| (out, d_vertices))
    }

    /// [`Batch::vjp_into`] a new vector.
    pub fn vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<Vec<T>> {
        let mut d_vertices = self.rows(self.row())?;
        self.vjp_into(quantity, d_out, &mut d_vertices).map(|()| d_vertices)
    }

    /// [`Batch::jvp_into`] a new vector.
    pub fn jvp<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.num_outputs(self.template))?;
        self.jvp_into(quantity, d_vertices, &mut out).map(|()| out)
    }

    /// [`Batch::vjp_jvp_into`] a new vector.
    pub fn vjp_jvp<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(self.row())?;
        self.vjp_jvp_into(quantity, d_out, d_vertices, &mut out).map(|()| out)
    }
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
    template: &'a Template,
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
        self.template.closing.backward(&mut d_points);
        R::write_rows(&out, &mut self.out);
        let d_vertices = &d_points[..self.template.mesh.num_vertices];
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
