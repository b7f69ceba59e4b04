//! L_ground: pull = mean of α1 tanh(h/α2)² over the points at or above the ground, push = mean of β1 tanh(h/β2)² over
//! those below it. Both means run over all points.

use crate::error::Result;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::quantity::{Quantity, unknown_choice};
use crate::sampling::{CHUNK, Chunk, Pass, Points};
use crate::scene::Scene;
use crate::template::Template;

/// How "tanh x squared" is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tanh {
    /// (tanh x)², the paper's.
    Squared,
    /// tanh(x²)
    OfSquare,
}

impl Tanh {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "tanh_squared" => Ok(Tanh::Squared),
            "tanh_of_square" => Ok(Tanh::OfSquare),
            _ => Err(unknown_choice("curve", "\"tanh_squared\", \"tanh_of_square\"", name)),
        }
    }

    /// The curve and its derivative by x.
    #[inline(always)]
    fn value_and_slope<R: Real>(self, x: R) -> (R, R) {
        let one = R::of(1.0);
        match self {
            Tanh::Squared => {
                let t = x.tanh();
                (t * t, R::of(2.0) * t * (one - t * t))
            }
            Tanh::OfSquare => {
                // Beyond |x| = 10 the curve is 1 in double precision; the bound keeps x² finite.
                let x = x.at_least(R::of(-10.0)).at_most(R::of(10.0));
                let t = (x * x).tanh();
                (t, R::of(2.0) * x * (one - t * t))
            }
        }
    }
}

pub struct GroundLoss {
    pub points: Points,
    pub tanh: Tanh,
    pub alpha1: f64,
    /// m
    pub alpha2: f64,
    pub beta1: f64,
    /// m
    pub beta2: f64,
}

/// The pass that sums both curves.
pub struct GroundPass<'a, R: Real> {
    of: &'a GroundLoss,
    pull: R::Wide,
    push: R::Wide,
    /// The gradients by (pull, push) to hand back, already divided by the number of points.
    d_sums: [R; 2],
}

impl GroundLoss {
    pub fn pass<R: Real>(&self) -> GroundPass<'_, R> {
        GroundPass { of: self, pull: R::Wide::zero(), push: R::Wide::zero(), d_sums: [R::zero(); 2] }
    }

    pub fn backward_pass<R: Real>(&self, template: &Template, d_out: &[R]) -> GroundPass<'_, R> {
        let share = 1.0 / self.points.count(template) as f64;
        let d_sums = [d_out[0] * R::of(self.alpha1 * share), d_out[1] * R::of(self.beta1 * share)];
        GroundPass { d_sums, ..self.pass() }
    }

    /// h over the width of its side, and that side's 1/width.
    #[inline(always)]
    fn scaled<R: Real>(&self, height: R) -> (R, R) {
        let width = height.if_negative(R::of(1.0 / self.beta2), R::of(1.0 / self.alpha2));
        (height * width, width)
    }
}

impl<R: Real> GroundPass<'_, R> {
    pub fn finish(&self, template: &Template, out: &mut [R]) {
        let share = 1.0 / self.of.points.count(template) as f64;
        out[0] = R::narrow(self.pull * R::Wide::of(self.of.alpha1 * share));
        out[1] = R::narrow(self.push * R::Wide::of(self.of.beta1 * share));
    }
}

impl<R: Real> Pass<R> for GroundPass<'_, R> {
    fn read(&mut self, chunk: &Chunk<R>) {
        let mut curve = [R::zero(); CHUNK];
        for (curve, &height) in curve.iter_mut().zip(&chunk.height) {
            *curve = self.of.tanh.value_and_slope(self.of.scaled(height).0).0;
        }
        let (mut pull, mut push) = (R::zero(), R::zero());
        for (&height, &curve) in chunk.height.iter().zip(&curve).take(chunk.len) {
            pull = pull + height.if_negative(R::zero(), curve);
            push = push + height.if_negative(curve, R::zero());
        }
        pull.add_to(&mut self.pull);
        push.add_to(&mut self.push);
    }

    fn hand_back(&self, chunk: &Chunk<R>, d_chunk: &mut Chunk<R>) {
        let [d_pull, d_push] = self.d_sums;
        for i in 0..CHUNK {
            let height = chunk.height[i];
            let (x, width) = self.of.scaled(height);
            let slope = self.of.tanh.value_and_slope(x).1 * width;
            d_chunk.height[i] = d_chunk.height[i] + height.if_negative(d_push, d_pull) * slope;
        }
    }
}

impl Quantity for GroundLoss {
    type Saved<R: Real> = ();

    fn len(&self, _: &Template) -> usize {
        2
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) {
        let mut pass = self.pass();
        self.points.read(scene, &mut pass);
        pass.finish(scene.template, out);
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.points.hand_back(scene, &self.backward_pass(scene.template, d_out), d_points);
    }
}
