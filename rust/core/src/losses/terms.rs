//! The terms of a training or fitting step together: (stability, pull, push) or (balance, pull, push).
//!
//! Stability and ground share one pass over the samples.

use crate::losses::balance::{Balance, BalanceCost};
use crate::losses::ground::GroundLoss;
use crate::losses::stability::StabilityLoss;
use crate::mass::Centre;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::pressure::CopPass;
use crate::quantity::Quantity;
use crate::sampling::Points;
use crate::scene::Scene;
use crate::template::Template;

pub struct StabilityTerms {
    pub stability: StabilityLoss,
    pub ground: GroundLoss,
}

impl Quantity for StabilityTerms {
    type Saved<R: Real> = (Centre<R::Wide>, CopPass<R>);

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Self::Saved<R> {
        let centre = self.stability.method.forward(scene);
        let mut cop = self.stability.pressure.pass();
        let mut ground = self.ground.pass();
        if self.ground.points == Points::Samples {
            Points::Samples.read(scene, &mut (&mut cop, &mut ground));
        } else {
            Points::Samples.read(scene, &mut cop);
            self.ground.points.read(scene, &mut ground);
        }
        cop.finish(scene);
        out[0] = self.stability.loss(scene, &centre, &cop);
        ground.finish(scene.template, &mut out[1..]);
        (centre, cop)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let mut cop = self.stability.loss_backward(scene, &saved.0, &saved.1, d_out[0], d_points);
        let mut ground = self.ground.backward_pass(scene.template, &d_out[1..]);
        if self.ground.points == Points::Samples {
            Points::Samples.hand_back(scene, &(&mut cop, &mut ground), d_points);
        } else {
            Points::Samples.hand_back(scene, &cop, d_points);
            self.ground.points.hand_back(scene, &ground, d_points);
        }
    }
}

pub struct BalanceTerms {
    pub balance: BalanceCost,
    pub ground: GroundLoss,
}

impl Quantity for BalanceTerms {
    type Saved<R: Real> = Balance<R::Wide>;

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Balance<R::Wide> {
        let (first, rest) = out.split_at_mut(1);
        self.ground.forward(scene, rest);
        self.balance.forward(scene, first)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Balance<R::Wide>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.ground.backward(scene, &(), &d_out[1..], d_points);
        self.balance.backward(scene, saved, &d_out[..1], d_points);
    }
}
