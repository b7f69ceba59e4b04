//! L_stability = ‖g(m̄) − g(s̄)‖₂: the distance, on the ground, from the centre of mass to the centre of pressure, metres.

use crate::mass::{Centre, Method};
use crate::number::Real;
use crate::number::vector::{Vec3, dot, scale, sub};
use crate::pressure::{CenterOfPressure, CopPass};
use crate::quantity::Quantity;
use crate::sampling::Points;
use crate::scene::Scene;
use crate::template::Template;

pub struct StabilityLoss {
    pub method: Method,
    pub pressure: CenterOfPressure,
}

/// g(m̄) − g(s̄) and its length.
fn offset<W: Real>(scene: &Scene<impl Real<Wide = W>>, centre: &Centre<W>, cop: Vec3<W>) -> (Vec3<W>, W) {
    let offset = scene.ground.along(sub(centre.point, cop));
    (offset, dot(offset, offset).sqrt())
}

impl StabilityLoss {
    /// The loss from a centre of mass and a finished pressure pass.
    pub fn loss<R: Real>(&self, scene: &Scene<R>, centre: &Centre<R::Wide>, cop: &CopPass<R>) -> R {
        R::narrow(offset(scene, centre, cop.point).1)
    }

    /// Its gradient by both: the unit offset, 0 where the two points coincide. The pressure pass hands its part back.
    pub fn loss_backward<R: Real>(
        &self,
        scene: &Scene<R>,
        centre: &Centre<R::Wide>,
        cop: &CopPass<R>,
        d_loss: R,
        d_points: &mut [Vec3<R>],
    ) -> CopPass<R> {
        let (offset, length) = offset(scene, centre, cop.point);
        let d_centre = scale(d_loss.widen() / length.at_least(R::Wide::of(1e-300)), offset);
        self.method.backward(scene, centre, d_centre, d_points);
        cop.handing_back(d_centre.map(|d| -d))
    }
}

impl Quantity for StabilityLoss {
    type Saved<R: Real> = (Centre<R::Wide>, CopPass<R>);

    fn len(&self, _: &Template) -> usize {
        1
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Self::Saved<R> {
        let centre = self.method.forward(scene);
        let mut cop = self.pressure.pass();
        Points::Samples.read(scene, &mut cop);
        cop.finish(scene);
        out[0] = self.loss(scene, &centre, &cop);
        (centre, cop)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let cop = self.loss_backward(scene, &saved.0, &saved.1, d_out[0], d_points);
        Points::Samples.hand_back(scene, &cop, d_points);
    }
}
