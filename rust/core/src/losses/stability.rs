//! L_stability = ‖g(m̄) − g(s̄)‖₂ (Eq. 4): the distance, on the ground, from the centre of mass to the centre of pressure,
//! metres.

use crate::error::Result;
use crate::mass::{Centre, Method};
use crate::memory;
use crate::number::Real;
use crate::number::vector::{Vec3, dot, scale, sub};
use crate::posed::PosedBody;
use crate::pressure::{CenterOfPressure, Cop};
use crate::quantity::Quantity;
use crate::template::Template;

/// L_stability (Eq. 4) as a quantity, metres.
///
/// ```
/// use ipman::Batch;
/// use ipman::losses::stability::StabilityLoss;
/// use ipman::mass::Method;
/// use ipman::pressure::{CenterOfPressure, PressureCurve};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let pressure = CenterOfPressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 }, epsilon: 0.0 };
/// let loss = batch.value(&StabilityLoss { method: Method::Exact, pressure })?[0];
/// assert!(loss < 0.1, "a cube stands in balance");
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct StabilityLoss {
    pub method: Method,
    pub pressure: CenterOfPressure,
}

/// (Eq. 4) The loss from m̄ and s̄, and its gradient by m̄; that by s̄ is the opposite. It is the unit offset, 0 where the
/// two points coincide.
pub fn distance_on_ground<R: Real>(posed: &PosedBody<R>, centre: &Centre<R>, cop: &Cop<R>) -> (R::Wide, Vec3<R::Wide>) {
    let offset = posed.ground.along(sub(centre.point, cop.point));
    let length = dot(offset, offset).sqrt();
    (length, scale(R::Wide::of(1.0) / length.at_least(R::Wide::of(1e-300)), offset))
}

impl StabilityLoss {
    /// The backward. `d_heights` may already hold a gradient by the vertices' heights; it is added, too.
    pub fn backward_with<R: Real>(
        &self,
        posed: &PosedBody<R>,
        (centre, cop, heights): &(Centre<R>, Cop<R>, Vec<R>),
        d_out: R,
        d_heights: Vec<R>,
        d_points: &mut [Vec3<R>],
    ) {
        let d_centre = scale(d_out.widen(), distance_on_ground(posed, centre, cop).1);
        cop.backward(posed, heights, scale(R::Wide::of(-1.0), d_centre), d_heights, d_points);
        self.method.backward(posed, centre, d_centre, d_points);
    }
}

impl Quantity for StabilityLoss {
    /// m̄, s̄ and the vertices' heights.
    type Saved<R: Real> = (Centre<R>, Cop<R>, Vec<R>);

    fn num_outputs(&self, _: &Template) -> usize {
        1
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.pressure.check(template)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R> {
        let heights = posed.heights();
        let centre = self.method.forward(posed);
        let cop = self.pressure.locate(posed, &heights);
        out[0] = R::narrow(distance_on_ground(posed, &centre, &cop).0);
        (centre, cop, heights)
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.backward_with(posed, saved, d_out[0], memory::filled(R::zero(), saved.2.len()), d_points);
    }
}
