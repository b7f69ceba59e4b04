//! A quantity: numbers of one body, with their gradient by the body's points. Every differentiable module has one or
//! more; [`crate::registry`] lists them by name.

use crate::error::Result;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::posed::PosedBody;
use crate::template::Template;

pub trait Quantity: Send + Sync + 'static {
    /// Intermediate results that the forward saves for the backward.
    type Saved<R: Real>;

    /// How many numbers it has per body.
    fn num_outputs(&self, template: &Template) -> usize;

    /// The error names the option that is out of range.
    fn check(&self, template: &Template) -> Result<()>;

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R>;

    /// Adds Σ d_out · ∂out/∂points to `d_points`, the virtual vertices' included.
    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]);

    /// Both together; to be overridden by quantities that can share work between them.
    fn forward_and_backward<R: Real>(
        &self,
        posed: &PosedBody<R>,
        d_out: &[R],
        out: &mut [R],
        d_points: &mut [Vec3<R>],
    ) {
        let saved = self.forward(posed, out);
        self.backward(posed, &saved, d_out, d_points);
    }
}
