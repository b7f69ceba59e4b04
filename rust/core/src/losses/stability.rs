//! L_stability = ‖g(m̄) − g(s̄)‖₂ (Eq. 4): the distance, on the ground, from the centre of mass to the centre of pressure,
//! metres.

use super::term::{ByHeights, Description, Gradient, Named, Shared, Term};
use crate::error::Result;
use crate::mass::{Centre, Method};
use crate::number::Real;
use crate::number::vector::{Vec3, dot, scale, sub};
use crate::points::PointChunk;
use crate::posed::PosedBody;
use crate::pressure::{CenterOfPressure, Cop, LoadSums, PressureCurve};
use crate::quantity::Quantity;
use crate::sampling::Row;
use crate::template::Template;

/// L_stability (Eq. 4), metres.
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

impl Named for StabilityLoss {
    const DESCRIPTION: &'static Description = &Description {
        name: "stability",
        numbers: &["stability"],
        along_normal: false,
        modes: &["method"],
        options: &["alpha", "gamma", "epsilon"],
    };

    fn named(modes: &[&str], options: &[f64]) -> Result<Self> {
        let (&[method], &[alpha, gamma, epsilon]) = (modes, options) else { unreachable!("as many as described") };
        let pressure = CenterOfPressure { curve: PressureCurve { alpha, gamma }, epsilon };
        Ok(StabilityLoss { method: Method::named(method)?, pressure })
    }
}

impl Term for StabilityLoss {
    type Sums<R: Real> = LoadSums<R>;
    /// s̄
    type Saved<R: Real> = Cop<R>;

    fn description(&self) -> &'static Description {
        Self::DESCRIPTION
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.pressure.check(template)
    }

    fn reads_samples(&self) -> bool {
        true
    }

    fn begin<R: Real>(&self, shared: &Shared<R>, _: &[R], _: &mut ByHeights<R>) -> LoadSums<R> {
        LoadSums::new(self.pressure, shared.template(), &shared.heights)
    }

    fn add<R: Real>(&self, sums: &mut LoadSums<R>, chunk: &PointChunk, heights: &Row<R>, _: &mut ByHeights<R>) {
        sums.add(chunk, heights);
    }

    fn finish<R: Real>(&self, shared: &Shared<R>, sums: LoadSums<R>, out: &mut [R]) -> Cop<R> {
        let cop = sums.finish(shared.posed);
        out[0] = R::narrow(distance_on_ground(shared.posed, shared.centre(self.method), &cop).0);
        cop
    }

    fn backward<R: Real>(&self, shared: &Shared<R>, cop: &Cop<R>, d_out: &[R], gradient: &mut Gradient<R>) {
        let (posed, centre) = (shared.posed, shared.centre(self.method));
        let d_centre = scale(d_out[0].widen(), distance_on_ground(posed, centre, cop).1);
        let (d_heights, d_points) = gradient.heights_and_points();
        cop.backward(posed, &shared.heights, scale(R::Wide::of(-1.0), d_centre), d_heights, d_points);
        self.method.backward(posed, centre, d_centre, d_points);
    }
}
