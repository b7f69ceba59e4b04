//! The quasi-static roll: where a stiff body comes to rest on level ground if it moves slowly.
//!
//! In the body's own coordinates the ground turns around it. With `down` towards the ground, the centre of mass is at
//! the height H(down) = max over the points p of down · p, p from the centre. Gravity turns `down` where H falls
//! fastest: away from the nearest point of what touches, so that the body pivots over a vertex or an edge until another
//! point touches. It rests where the centre lies over what touches.

use crate::ground::{Ground, Plane};
use crate::memory;
use crate::number::vector::{Vec3, add, cross, dot, scale, sub};
use crate::number::{Fused, Kernel, Real};
use crate::support::hull::convex_hull;
use crate::support::margin::{Margin, Nearest};

/// Vertices up to this height above the lowest are collected first, m; the higher ones are read once the body has
/// rolled so far that they may touch.
pub const BAND: f64 = 0.03;
/// Points within this height of the lowest touch, m.
const TOUCH: f64 = 1e-9;
/// Height above the lowest up to which points are stored while a body rolls, m: enough for about ten degrees.
const WIDE: f64 = 0.2;
/// Upper bound of the number of turns: a ball of a million points needs fewer.
const MOST_TURNS: usize = 10_000;

/// The points of a body relative to its centre of mass.
pub trait Cloud {
    fn offsets(&self, points: impl Iterator<Item = u32>) -> Vec<Vec3<f64>>;
    fn count(&self) -> usize;
    /// No point is farther from the centre, m.
    fn reach(&self) -> f64;
}

/// The angle between two directions, rad.
pub fn angle(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    let across = cross(a, b);
    dot(across, across).sqrt().atan2(dot(a, b))
}

/// A body that rolls.
pub struct Roller<'a, C: Cloud> {
    cloud: &'a C,
    reach: f64,
    /// The points that may touch next.
    near: Near,
    /// Read when they are first needed.
    all: Option<Points>,
}

impl<'a, C: Cloud> Roller<'a, C> {
    /// `low` are the points within [`BAND`] of the lowest in the direction `down`.
    pub fn new(down: Vec3<f64>, low: &[Vec3<f64>], cloud: &'a C) -> Self {
        Roller { cloud, reach: cloud.reach(), near: Near::new(low, down, BAND), all: None }
    }

    /// Rolls until it rests, from the orientation in which `down` is down. None for a body whose centre of mass lies
    /// outside of its own hull.
    pub fn to_rest(&mut self, down: Vec3<f64>) -> Option<Orientation> {
        self.while_within(down, down, std::f64::consts::PI)
    }

    /// [`Roller::to_rest`], or where the body has turned by more than `most` from where `start` was down.
    pub fn while_within(&mut self, down: Vec3<f64>, start: Vec3<f64>, most: f64) -> Option<Orientation> {
        let mut down = down;
        for _ in 0..MOST_TURNS {
            let stop = self.stop(down);
            if angle(start, down) > most {
                return Some(Orientation { down, height: stop.height });
            }
            let Some(way) = stop.downhill(down) else { return Some(Orientation { down, height: stop.height }) };
            down = self.turn(down, &way, stop.height)?;
        }
        None
    }

    /// All points within `band` of the lowest.
    pub fn low(&mut self, down: Vec3<f64>, band: f64) -> Vec<Vec3<f64>> {
        let bottom = self.near.points.heights(down).1 - band;
        if self.near.holds(down, bottom, self.reach) {
            return self.near.points.near(down, band);
        }
        self.all().near(down, band)
    }

    fn all(&mut self) -> &Points {
        let cloud = self.cloud;
        self.all.get_or_insert_with(|| Points::new(&cloud.offsets(0..cloud.count() as u32)))
    }

    fn stop(&mut self, down: Vec3<f64>) -> Stop {
        let stop = self.near.points.stop(down);
        if self.near.holds(down, stop.height - TOUCH, self.reach) {
            return stop;
        }
        let near = Near::new(&self.all().near(down, WIDE), down, WIDE);
        self.near = near;
        self.near.points.stop(down)
    }

    /// The direction down when the next point touches; None if none does within a right angle.
    fn turn(&mut self, down: Vec3<f64>, way: &Way, height: f64) -> Option<Vec3<f64>> {
        let turned = self.near.points.turned(down, way, height);
        if let Some(next) = turned.filter(|next| self.near.holds(*next, dot(*next, way.pivot), self.reach)) {
            return Some(next);
        }
        self.all().turned(down, way, height)
    }
}

/// An orientation, and the height of the centre of mass in it.
#[derive(Clone, Copy, Debug)]
pub struct Orientation {
    pub down: Vec3<f64>,
    pub height: f64,
}

/// The points within `band` of the lowest in one direction.
struct Near {
    points: Points,
    down: Vec3<f64>,
    height: f64,
    band: f64,
}

impl Near {
    fn new(offsets: &[Vec3<f64>], down: Vec3<f64>, band: f64) -> Self {
        let points = Points::new(offsets);
        let (_, height) = points.heights(down);
        Near { points, down, height, band }
    }

    /// Whether in another direction these points include every point that is at least `height` below the centre: the
    /// others were higher by `band`, and have come down by less than `reach` times the turn.
    fn holds(&self, down: Vec3<f64>, height: f64, reach: f64) -> bool {
        let turn = sub(down, self.down);
        height > self.height - self.band + TOUCH + reach * dot(turn, turn).sqrt()
    }
}

/// x, y and z in separate arrays, so that the loops over them vectorise.
struct Points {
    axes: [Vec<f64>; 3],
}

/// The points that touch in one direction, and the height of the centre.
struct Stop {
    height: f64,
    touching: Vec<Vec3<f64>>,
}

/// The direction towards which `down` turns, a unit vector at right angles to it, and a point over which the body
/// pivots.
struct Way {
    towards: Vec3<f64>,
    pivot: Vec3<f64>,
}

impl Stop {
    /// None if the body is at rest.
    fn downhill(&self, down: Vec3<f64>) -> Option<Way> {
        let plane = Plane { axes: Ground { normal: down, height: 0.0 }.axes() };
        let flat = memory::collect(self.touching.iter().map(|point| plane.flatten(*point)));
        let corners = convex_hull(&flat);
        let feet = memory::collect(corners.iter().map(|&i| flat[i]));
        let nearest = Nearest::find(&feet, [0.0; 2])?;
        let margin = Margin::new(nearest.map(|i| feet[i]), [0.0; 2]);
        let towards = plane.raise(margin.direction.map(|x| -x));
        (margin.value < 0.0).then(|| Way { towards, pivot: self.touching[corners[nearest.ends()[0]]] })
    }
}

impl Points {
    fn new(offsets: &[Vec3<f64>]) -> Self {
        Points { axes: [0, 1, 2].map(|k| memory::collect(offsets.iter().map(|offset| offset[k]))) }
    }

    /// Distances of all points along `down`, and the largest.
    fn heights(&self, down: Vec3<f64>) -> (Vec<f64>, f64) {
        Fused::<f64>::dispatch::<Along, _>((self, down))
    }

    fn stop(&self, down: Vec3<f64>) -> Stop {
        let (heights, height) = self.heights(down);
        let touching = heights.iter().enumerate().filter(|(_, own)| **own >= height - TOUCH);
        Stop { height, touching: memory::collect(touching.map(|(point, _)| self.at(point))) }
    }

    fn at(&self, point: usize) -> Vec3<f64> {
        [0, 1, 2].map(|k| self.axes[k][point])
    }

    fn near(&self, down: Vec3<f64>, band: f64) -> Vec<Vec3<f64>> {
        let (heights, height) = self.heights(down);
        let low = heights.iter().enumerate().filter(|(_, own)| **own >= height - band);
        memory::collect(low.map(|(point, _)| self.at(point)))
    }

    /// The direction down when the first further point touches.
    fn turned(&self, down: Vec3<f64>, way: &Way, height: f64) -> Option<Vec3<f64>> {
        // At the angle θ a point touches that is a above the ground and b beyond the pivot with a cos θ = b sin θ.
        let steepest =
            Fused::<f64>::dispatch::<Steepest, _>((self, down, way.towards, height, dot(way.pivot, way.towards)));
        if steepest <= 0.0 {
            return None;
        }
        let next = add(scale(steepest, down), way.towards);
        Some(scale(1.0 / dot(next, next).sqrt(), next))
    }
}

/// [`Points::heights`]
struct Along;

impl Kernel<(&Points, Vec3<f64>)> for Along {
    type Output = (Vec<f64>, f64);

    #[inline(always)]
    fn run((points, down): (&Points, Vec3<f64>)) -> (Vec<f64>, f64) {
        let [x, y, z] = &points.axes;
        let mut out = memory::filled(0.0, x.len());
        for (((out, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
            *out = x * down[0] + y * down[1] + z * down[2];
        }
        let height = largest(&out, f64::NEG_INFINITY);
        (out, height)
    }
}

/// Number of interleaved maxima.
const WIDTH: usize = 16;

#[inline(always)]
fn largest(numbers: &[f64], least: f64) -> f64 {
    let (whole, rest) = numbers.as_chunks::<WIDTH>();
    let mut best = [least; WIDTH];
    for numbers in whole {
        for k in 0..WIDTH {
            best[k] = if numbers[k] > best[k] { numbers[k] } else { best[k] };
        }
    }
    let mut all = least;
    for &own in best.iter().chain(rest) {
        all = if own > all { own } else { all };
    }
    all
}

/// The largest b / a of [`Points::turned`].
struct Steepest;

impl Kernel<(&Points, Vec3<f64>, Vec3<f64>, f64, f64)> for Steepest {
    type Output = f64;

    #[inline(always)]
    fn run((points, down, towards, height, pivot): (&Points, Vec3<f64>, Vec3<f64>, f64, f64)) -> f64 {
        let [x, y, z] = &points.axes;
        let mut slopes = memory::filled(0.0, x.len());
        for (((out, &x), &y), &z) in slopes.iter_mut().zip(x).zip(y).zip(z) {
            *out = slope([x, y, z], down, towards, height, pivot);
        }
        largest(&slopes, 0.0)
    }
}

/// b / a of one point; 0 for one that touches already.
#[inline(always)]
fn slope([x, y, z]: Vec3<f64>, down: Vec3<f64>, towards: Vec3<f64>, height: f64, pivot: f64) -> f64 {
    let above = height - (x * down[0] + y * down[1] + z * down[2]);
    let beyond = x * towards[0] + y * towards[1] + z * towards[2] - pivot;
    if above > TOUCH { beyond / above } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Points3(Vec<Vec3<f64>>);

    impl Cloud for Points3 {
        fn offsets(&self, points: impl Iterator<Item = u32>) -> Vec<Vec3<f64>> {
            points.map(|point| self.0[point as usize]).collect()
        }
        fn count(&self) -> usize {
            self.0.len()
        }
        fn reach(&self) -> f64 {
            self.0.iter().map(|p| dot(*p, *p).sqrt()).fold(0.0, f64::max)
        }
    }

    /// Points on an ellipsoid with half axes 0.25, 0.85 and 0.15 m, spread by the golden angle.
    fn ellipsoid(count: usize) -> Points3 {
        let point = |k: usize| {
            let y = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
            let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
            let r = (1.0 - y * y).sqrt();
            [0.25 * r * cos, 0.85 * y, 0.15 * r * sin]
        };
        Points3((0..count).map(point).collect())
    }

    #[test]
    fn looking_at_the_near_points_only_changes_nothing() {
        let cloud = ellipsoid(3000);
        for tilt in [0.1_f64, 0.5, 1.2, 2.0] {
            let down = [0.3 * tilt.sin(), -tilt.cos(), tilt.sin()];
            let down = scale(1.0 / dot(down, down).sqrt(), down);
            let low = Points::new(&cloud.0).near(down, BAND);
            assert!(low.len() < cloud.count() / 2);
            // With all points near from the start, no point is ever read again.
            let whole = Points3(cloud.0.clone());
            let mut roller = Roller::new(down, &low, &cloud);
            let rest = roller.to_rest(down).unwrap();
            let wanted = Roller::new(down, &cloud.0, &whole).to_rest(down).unwrap();
            assert_eq!((rest.down, rest.height), (wanted.down, wanted.height));
            assert_eq!(roller.low(rest.down, 0.01), Points::new(&cloud.0).near(rest.down, 0.01));
            assert!((rest.down[2].abs() - 1.0).abs() < 1e-2, "lies on its flat side: {:?}", rest.down);
        }
    }

    #[test]
    fn a_centre_outside_of_the_hull_never_rests() {
        let corners = [[0.1, -0.2, 0.1], [0.3, -0.2, 0.1], [0.1, -0.2, 0.3], [0.1, -0.1, 0.1]];
        let cloud = Points3(corners.to_vec());
        assert!(Roller::new([0.0, -1.0, 0.0], &corners, &cloud).to_rest([0.0, -1.0, 0.0]).is_none());
    }
}
