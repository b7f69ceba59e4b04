//! The terms of a training or fitting step together: (stability, pull, push) or (balance, pull, push).
//!
//! Stability and ground look at the samples together.

use crate::losses::balance::{Balance, BalanceCost};
use crate::losses::ground::GroundLoss;
use crate::losses::stability::{StabilityLoss, distance_on_ground};
use crate::mass::Centre;
use crate::number::Real;
use crate::number::vector::{Vec3, scale};
use crate::pressure::{Cop, LoadSums};
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Points};
use crate::scene::Scene;
use crate::template::Template;

pub struct StabilityTerms {
    pub stability: StabilityLoss,
    pub ground: GroundLoss,
}

impl StabilityTerms {
    /// Values, and what the stability's backward needs. With `d_ground` the ground's backward is done at the same look at
    /// the samples: its gradient by the vertices' heights is added there.
    fn look<R: Real>(
        &self,
        scene: &Scene<R>,
        out: &mut [R],
        mut d_ground: Option<([R; 2], &mut [R])>,
    ) -> (Centre<R>, Cop<R>, Vec<R>) {
        let heights = scene.heights();
        let mut loads = LoadSums::new(self.stability.pressure, &heights);
        let mut ground = self.ground.sums();
        let mut row = [R::zero(); CHUNK];
        for place in Points::Samples.places(scene.template) {
            place.read(&heights, &mut row);
            loads.read(&place, &row);
            if self.ground.points == Points::Samples {
                match &mut d_ground {
                    Some((shares, d_heights)) => ground.read_and_hand_back(&place, &row, *shares, d_heights),
                    None => ground.read(&place, &row),
                }
            }
        }
        if self.ground.points == Points::Vertices {
            for place in Points::Vertices.places(scene.template) {
                place.read(&heights, &mut row);
                match &mut d_ground {
                    Some((shares, d_heights)) => ground.read_and_hand_back(&place, &row, *shares, d_heights),
                    None => ground.read(&place, &row),
                }
            }
        }
        let (centre, cop) = (self.stability.method.forward(scene), loads.finish(scene));
        out[0] = R::narrow(distance_on_ground(scene, &centre, &cop).0);
        ground.finish(scene.template, &mut out[1..]);
        (centre, cop, heights)
    }
}

impl Quantity for StabilityTerms {
    type Saved<R: Real> = (Centre<R>, Cop<R>, Vec<R>);

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Self::Saved<R> {
        self.look(scene, out, None)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.stability.backward(scene, saved, &d_out[..1], d_points);
        self.ground.backward(scene, &saved.2, &d_out[1..], d_points);
    }

    fn forward_and_backward<R: Real>(&self, scene: &Scene<R>, d_out: &[R], out: &mut [R], d_points: &mut [Vec3<R>]) {
        let mut d_heights = vec![R::zero(); scene.template.mesh.num_vertices];
        let shares = self.ground.shares(scene.template, &d_out[1..]);
        let (centre, cop, heights) = self.look(scene, out, Some((shares, &mut d_heights)));
        let d_centre = scale(d_out[0].widen(), distance_on_ground(scene, &centre, &cop).1);
        cop.backward(scene, &heights, scale(R::Wide::of(-1.0), d_centre), d_heights, d_points);
        self.stability.method.backward(scene, &centre, d_centre, d_points);
    }
}

pub struct BalanceTerms {
    pub balance: BalanceCost,
    pub ground: GroundLoss,
}

impl Quantity for BalanceTerms {
    type Saved<R: Real> = (Balance<R>, Vec<R>);

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Self::Saved<R> {
        let (first, rest) = out.split_at_mut(1);
        (self.balance.forward(scene, first), self.ground.forward(scene, rest))
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.ground.backward(scene, &saved.1, &d_out[1..], d_points);
        self.balance.backward(scene, &saved.0, &d_out[..1], d_points);
    }
}
