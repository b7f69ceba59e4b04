//! L_ground: pull = mean of α1 tanh(h/α2)² over the points at or above the ground, push = mean of β1 tanh(h/β2)² over
//! those below it. Both means run over all points.

use crate::error::Result;
use crate::number::vector::Vec3;
use crate::number::{Real, Room};
use crate::quantity::{Quantity, unknown_choice};
use crate::sampling::{CHUNK, Place, Points, Row, sum_row};
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
                let squared = t * t;
                (squared, R::of(2.0) * t * (one - squared))
            }
            Tanh::OfSquare => {
                // Beyond |x| = 10 the curve is 1 in double precision; the bound keeps x² finite.
                let x = x.at_least(R::of(-10.0)).at_most(R::of(10.0));
                let t = (x * x).tanh();
                (t, R::of(2.0) * x * t.neg_mul_add(t, one))
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

/// The sums of both curves as the points are looked at.
pub struct GroundSums<'a, R: Real> {
    of: &'a GroundLoss,
    pull: R::Wide,
    push: R::Wide,
}

impl GroundLoss {
    pub fn sums<R: Real>(&self) -> GroundSums<'_, R> {
        GroundSums { of: self, pull: R::Wide::zero(), push: R::Wide::zero() }
    }

    /// What the slope of each side is worth: the gradients by (pull, push) over the number of points.
    pub fn shares<R: Real>(&self, template: &Template, d_out: &[R]) -> [R; 2] {
        let share = 1.0 / self.points.count(template) as f64;
        [d_out[0] * R::of(self.alpha1 * share), d_out[1] * R::of(self.beta1 * share)]
    }

    /// The curve's value, and its slope by the height times the share of its side.
    #[inline(always)]
    fn value_and_slope<R: Real>(&self, height: R, [pull, push]: [R; 2]) -> (R, R) {
        let width = height.if_negative(R::of(1.0 / self.beta2), R::of(1.0 / self.alpha2));
        let (value, slope) = self.tanh.value_and_slope(height * width);
        (value, slope * (width * height.if_negative(push, pull)))
    }
}

impl<R: Real> GroundSums<'_, R> {
    pub fn read(&mut self, place: &Place, heights: &Row<R>) {
        let mut unused = [R::zero(); CHUNK];
        self.look(place, heights, [R::zero(); 2], &mut unused);
    }

    /// Reads and hands back at one look.
    pub fn read_and_hand_back(&mut self, place: &Place, heights: &Row<R>, shares: [R; 2], d_heights: &mut [R]) {
        let mut slopes = [R::zero(); CHUNK];
        self.look(place, heights, shares, &mut slopes);
        place.hand_back(&slopes, d_heights);
    }

    fn look(&mut self, place: &Place, heights: &Row<R>, shares: [R; 2], slopes: &mut Row<R>) {
        R::apart::<Look, _>((self.of, heights, place.len(), shares, slopes, &mut self.pull, &mut self.push));
    }

    pub fn finish(&self, template: &Template, out: &mut [R]) {
        let share = 1.0 / self.of.points.count(template) as f64;
        out[0] = R::narrow(self.pull * R::Wide::of(self.of.alpha1 * share));
        out[1] = R::narrow(self.push * R::Wide::of(self.of.beta1 * share));
    }
}

/// Both curves over a row of heights, added to their sums, and their slopes.
struct Look;

type Looked<'a, R> =
    (&'a GroundLoss, &'a Row<R>, usize, [R; 2], &'a mut Row<R>, &'a mut <R as Real>::Wide, &'a mut <R as Real>::Wide);

impl<R: Real> Room<Looked<'_, R>> for Look {
    type Output = ();

    #[inline(always)]
    fn enter((of, heights, len, shares, slopes, pull_sum, push_sum): Looked<'_, R>) {
        let (mut pull, mut push) = ([R::zero(); CHUNK], [R::zero(); CHUNK]);
        for (((&height, pull), push), slope) in heights.iter().zip(&mut pull).zip(&mut push).zip(slopes) {
            let (value, scaled) = of.value_and_slope(height, shares);
            (*pull, *push) = (height.if_negative(R::zero(), value), height.if_negative(value, R::zero()));
            *slope = scaled;
        }
        sum_row(&pull, len).add_to(pull_sum);
        sum_row(&push, len).add_to(push_sum);
    }
}

impl Quantity for GroundLoss {
    /// The vertices' heights.
    type Saved<R: Real> = Vec<R>;

    fn len(&self, _: &Template) -> usize {
        2
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Vec<R> {
        let heights = scene.heights();
        let mut sums = self.sums();
        let mut row = [R::zero(); CHUNK];
        for place in self.points.places(scene.template) {
            place.read(&heights, &mut row);
            sums.read(&place, &row);
        }
        sums.finish(scene.template, out);
        heights
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, heights: &Vec<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let shares = self.shares(scene.template, d_out);
        let mut d_heights = vec![R::zero(); heights.len()];
        let mut row = [R::zero(); CHUNK];
        for place in self.points.places(scene.template) {
            place.read(heights, &mut row);
            R::apart::<Slopes, _>((self, shares, &mut row));
            place.hand_back(&row, &mut d_heights);
        }
        scene.heights_backward(&d_heights, d_points);
    }
}

/// From heights to the slopes of both curves.
struct Slopes;

impl<R: Real> Room<(&GroundLoss, [R; 2], &mut Row<R>)> for Slopes {
    type Output = ();

    #[inline(always)]
    fn enter((of, shares, row): (&GroundLoss, [R; 2], &mut Row<R>)) {
        for height in row {
            *height = of.value_and_slope(*height, shares).1;
        }
    }
}
