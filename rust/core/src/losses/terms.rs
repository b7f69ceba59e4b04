//! The terms of a training or fitting step together: (stability, pull, push), Eqs. 4, 6 and 7, or (balance, pull, push).
//!
//! Stability and ground share one pass over the samples.

use crate::error::Result;
use crate::losses::balance::{Balance, BalanceCost};
use crate::losses::ground::{GroundLoss, GroundSums};
use crate::losses::stability::{StabilityLoss, distance_on_ground};
use crate::mass::Centre;
use crate::memory;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::points::Points;
use crate::posed::PosedBody;
use crate::pressure::{Cop, LoadSums};
use crate::quantity::Quantity;
use crate::sampling::CHUNK;
use crate::template::Template;

/// The first term, pull and push.
pub const NUM_TERMS: usize = 3;

/// The terms (first, pull, push). The gradients of pull and push are parallel to the ground's normal.
pub trait Terms: Quantity {
    /// The values; the gradient of the first term, added to `d_first`, the virtual vertices' included; and the gradients
    /// of pull and push by the vertices' heights, added to `d_ground`.
    fn forward_and_jacobian<R: Real>(
        &self,
        posed: &PosedBody<R>,
        out: &mut [R],
        d_first: &mut [Vec3<R>],
        d_ground: [&mut [R]; 2],
    );
}

/// (stability, pull, push) in one pass; the values are those of the separate losses.
///
/// ```
/// use ipman::Batch;
/// use ipman::losses::ground::{GroundLoss, Tanh};
/// use ipman::losses::stability::StabilityLoss;
/// use ipman::losses::terms::StabilityTerms;
/// use ipman::mass::Method;
/// use ipman::points::Points;
/// use ipman::pressure::{CenterOfPressure, PressureCurve};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let pressure = CenterOfPressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 }, epsilon: 0.0 };
/// let stability = StabilityLoss { method: Method::Pcom, pressure };
/// let (alpha1, alpha2, beta1, beta2) = (1.0, 0.15, 10.0, 0.15);
/// let ground = GroundLoss { points: Points::Samples, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 };
/// let alone = [batch.value(&stability)?, batch.value(&ground)?].concat();
/// assert_eq!(batch.value(&StabilityTerms { stability, ground })?, alone);
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct StabilityTerms {
    pub stability: StabilityLoss,
    pub ground: GroundLoss,
}

impl StabilityTerms {
    /// The values, with what the stability's backward needs. If `ground` requests gradients, they come from the same
    /// pass over the samples.
    fn one_pass<R: Real>(
        &self,
        posed: &PosedBody<R>,
        mut ground: GroundSums<R>,
        out: &mut [R],
    ) -> (Centre<R>, Cop<R>, Vec<R>) {
        let heights = posed.heights();
        let mut loads = LoadSums::new(self.stability.pressure, posed.template, &heights);
        let mut row = [R::zero(); CHUNK];
        for chunk in Points::Samples.chunks(posed.template) {
            chunk.gather(&heights, &mut row);
            loads.add(&chunk, &row);
            if self.ground.points == Points::Samples {
                ground.add(&chunk, &row);
            }
        }
        if self.ground.points == Points::Vertices {
            ground.add_all(posed.template, &heights);
        }
        let (centre, cop) = (self.stability.method.forward(posed), loads.finish(posed));
        out[0] = R::narrow(distance_on_ground(posed, &centre, &cop).0);
        ground.finish(posed.template, &mut out[1..]);
        (centre, cop, heights)
    }
}

impl Quantity for StabilityTerms {
    type Saved<R: Real> = (Centre<R>, Cop<R>, Vec<R>);

    fn num_outputs(&self, _: &Template) -> usize {
        NUM_TERMS
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.stability.check(template)?;
        self.ground.check(template)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R> {
        self.one_pass(posed, self.ground.sums(), out)
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.stability.backward(posed, saved, &d_out[..1], d_points);
        self.ground.backward(posed, &saved.2, &d_out[1..], d_points);
    }

    fn forward_and_backward<R: Real>(
        &self,
        posed: &PosedBody<R>,
        d_out: &[R],
        out: &mut [R],
        d_points: &mut [Vec3<R>],
    ) {
        let mut d_heights = memory::filled(R::zero(), posed.template.mesh.num_vertices);
        let ground = self.ground.sums_and_gradient(posed.template, &d_out[1..], &mut d_heights);
        let saved = self.one_pass(posed, ground, out);
        self.stability.backward_with(posed, &saved, d_out[0], d_heights, d_points);
    }
}

impl Terms for StabilityTerms {
    fn forward_and_jacobian<R: Real>(
        &self,
        posed: &PosedBody<R>,
        out: &mut [R],
        d_first: &mut [Vec3<R>],
        d_ground: [&mut [R]; 2],
    ) {
        let saved = self.one_pass(posed, self.ground.sums_and_jacobian(posed.template, d_ground), out);
        self.stability.backward(posed, &saved, &[R::of(1.0)], d_first);
    }
}

/// (balance, pull, push).
pub struct BalanceTerms {
    pub balance: BalanceCost,
    pub ground: GroundLoss,
}

impl Quantity for BalanceTerms {
    type Saved<R: Real> = (Balance<R>, Vec<R>);

    fn num_outputs(&self, _: &Template) -> usize {
        NUM_TERMS
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.balance.check(template)?;
        self.ground.check(template)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R> {
        let (first, rest) = out.split_at_mut(1);
        (self.balance.forward(posed, first), self.ground.forward(posed, rest))
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.ground.backward(posed, &saved.1, &d_out[1..], d_points);
        self.balance.backward(posed, &saved.0, &d_out[..1], d_points);
    }
}

impl Terms for BalanceTerms {
    fn forward_and_jacobian<R: Real>(
        &self,
        posed: &PosedBody<R>,
        out: &mut [R],
        d_first: &mut [Vec3<R>],
        d_ground: [&mut [R]; 2],
    ) {
        let (first, rest) = out.split_at_mut(1);
        let saved = self.balance.forward(posed, first);
        self.balance.backward(posed, &saved, &[R::of(1.0)], d_first);
        let mut ground = self.ground.sums_and_jacobian(posed.template, d_ground);
        ground.add_all(posed.template, &posed.heights());
        ground.finish(posed.template, rest);
    }
}
