//! The tip test: how firmly a stiff body stands, without a simulation.
//!
//! The body stands on the hull of the vertices that are nearly as low as its lowest one. Over an edge of that hull,
//! with the centre of mass at height h and s inside, it must be lifted by E = m g (√(h² + s²) − h), and an angular
//! velocity of √(2E / I) tips it, I the inertia about the edge. With the centre outside it falls like an inverted
//! pendulum, d(t) ≈ |s| (cosh λt − 1), λ = √(m g h / I). [`roll`] finds where it comes to rest in quasi-static motion.

pub mod roll;

use crate::error::{Error, Result};
use crate::ground::{Ground, Plane};
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::number::vector::{Vec3, add_scaled, dot, scale};
use crate::number::{Data, Kernel, Real, Scalar};
use crate::options::{not_negative, positive};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::solid::{Extent, GRAVITY, Solid};
use crate::support::hull::convex_hull;
use crate::support::margin::{Margin, Nearest};
use crate::template::Template;
pub use roll::BAND;
use roll::{Cloud, Orientation, Roller, angle};
use std::f64::consts::TAU;

/// The constants of the test.
pub struct TipTest {
    /// kg/m³, one for all parts or one for each.
    pub densities: MassProperties,
    /// A body whose lowest vertex is higher than this counts as in the air, m.
    pub contact: f64,
    /// It stands on the vertices up to this height above its lowest one, m; at most [`BAND`].
    pub tolerance: f64,
    /// At rest it is tilted by this angle in each of [`HEADINGS`] directions and rolls again, rad.
    pub nudge: f64,
    /// A body tilted by more than this has fallen and is not nudged, rad.
    pub fallen: f64,
}

const HEADINGS: usize = 8;

/// How firmly one body stands; NaN for a body in the air or without a volume.
#[derive(Clone, Debug)]
pub struct Tipping {
    pub solid: Solid,
    /// As the body is posed.
    pub stance: Stance,
    /// Where the roll comes to rest.
    pub rest: Rest,
    pub stance_at_rest: Stance,
}

/// Where the roll comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Between up in the pose and up at rest, rad; 0 to π.
    pub tilt: f64,
    /// How far the centre of mass went down, m.
    pub sunk: f64,
    /// The largest tilt where it comes to rest after a nudge, or has fallen.
    pub nudged_tilt: f64,
}

impl Rest {
    fn unknown() -> Self {
        Rest { tilt: f64::NAN, sunk: f64::NAN, nudged_tilt: f64::NAN }
    }
}

/// Standing still on a polygon.
#[derive(Clone, Copy, Debug)]
pub struct Stance {
    /// h: the centre of mass above the lowest vertex, m.
    pub height: f64,
    /// s: from the centre of mass, on the ground, to the nearest edge of what the body stands on, m; positive inside.
    pub margin: f64,
    /// The least E over the edges, J; 0 with the centre outside.
    pub barrier: f64,
    /// The least angular velocity that tips it over an edge, rad/s; 0 with the centre outside.
    pub push: f64,
    /// λ about the nearest edge, 1/s.
    pub rate: f64,
}

impl TipTest {
    /// The error names the number that is out of range.
    pub fn new(densities: &[f64], contact: f64, tolerance: f64, nudge: f64, fallen: f64) -> Result<Self> {
        let densities = MassProperties { densities: densities.to_vec() };
        let test = TipTest { densities, contact, tolerance, nudge, fallen };
        test.check_numbers()?;
        Ok(test)
    }

    /// The error names the number that is out of range, or densities that do not fit the template.
    pub fn check(&self, template: &Template) -> Result<()> {
        self.densities.check(template)?;
        self.check_numbers()
    }

    fn check_numbers(&self) -> Result<()> {
        positive("contact", self.contact)?;
        if !(0.0..=BAND).contains(&self.tolerance) {
            let expected = format!("0 to {BAND} m");
            return Err(Error::Argument { name: "tolerance", expected, got: self.tolerance.to_string() });
        }
        not_negative("nudge", self.nudge)?;
        not_negative("fallen", self.fallen)
    }

    /// The footing of each lane.
    pub fn footings<R: Real>(&self, posed: &PosedBody<R>) -> Vec<Footing> {
        let extent = Extent::of(posed);
        let solids = Solid::of_lanes(posed, &extent, &self.densities, self.contact);
        let low = R::dispatch::<Low, _>((&extent,));
        let footing = |(lane, (solid, low)): (usize, (Solid, Vec<u32>))| {
            let value = |x: R::Wide| x.lane(lane).value();
            let (down, origin) = (posed.ground.normal.map(|x| -value(x)), posed.origin.map(value));
            Footing { solid, down, origin, low, bounds: extent.bounds_of(lane) }
        };
        solids.into_iter().zip(low).enumerate().map(footing).collect()
    }

    /// The test of one body, in the world.
    pub fn of_body<T: Data>(&self, footing: Footing, vertices: &[T]) -> Tipping {
        let Footing { solid, down, origin, low, bounds } = footing;
        if !solid.is_grounded() {
            return Tipping::undefined(solid.moved(origin));
        }
        let vertices = Vertices { vertices: vertices.as_chunks().0, origin, centre: solid.centre, bounds };
        let low = vertices.offsets(low.into_iter());
        let stance = self.stance(&solid, down, &low);
        let mut roller = Roller::new(down, &low, &vertices);
        let (rest, stance_at_rest) = match roller.to_rest(down) {
            Some(end) => {
                let stance_at_rest = self.stance(&solid, end.down, &roller.low(end.down, self.tolerance));
                let (tilt, sunk) = (angle(down, end.down), (stance.height - end.height).max(0.0));
                (Rest { tilt, sunk, nudged_tilt: self.nudged_tilt(&mut roller, down, end, tilt) }, stance_at_rest)
            }
            None => (Rest::unknown(), Stance::unknown()),
        };
        Tipping { solid: solid.moved(origin), stance, rest, stance_at_rest }
    }

    /// The largest tilt after a nudge in any direction: a pose that rests on a facet of a millimetre does not stand
    /// firmly.
    fn nudged_tilt(&self, roller: &mut Roller<impl Cloud>, start: Vec3<f64>, end: Orientation, tilt: f64) -> f64 {
        let mut largest = tilt;
        let [e1, e2] = Ground { normal: end.down, height: 0.0 }.axes();
        for k in 0..HEADINGS {
            if largest > self.fallen || self.nudge == 0.0 {
                break;
            }
            let (sin, cos) = (TAU * k as f64 / HEADINGS as f64).sin_cos();
            let mut down = end.down;
            add_scaled(&mut down, self.nudge * cos, e1);
            add_scaled(&mut down, self.nudge * sin, e2);
            let down = scale(1.0 / dot(down, down).sqrt(), down);
            let rest = roller.while_within(down, start, self.fallen);
            largest = largest.max(rest.map_or(f64::NAN, |rest| angle(start, rest.down)));
        }
        largest
    }

    /// The stance on the lowest of some points, given relative to the centre of mass.
    fn stance(&self, solid: &Solid, down: Vec3<f64>, points: &[Vec3<f64>]) -> Stance {
        let plane = Plane { axes: Ground { normal: scale(-1.0, down), height: 0.0 }.axes() };
        let height = points.iter().map(|point| dot(down, *point)).fold(f64::NEG_INFINITY, f64::max);
        let stands = points.iter().filter(|point| dot(down, **point) >= height - self.tolerance);
        let feet = memory::collect(stands.map(|point| plane.flatten(*point)));
        let corners = memory::collect(convex_hull(&feet).into_iter().map(|i| feet[i]));
        let about = |axis: Vec3<f64>| {
            let rows: Vec3<f64> = std::array::from_fn(|k| dot(solid.inertia[k], axis));
            dot(rows, axis)
        };
        let pendulum = |axis: [f64; 2], arm: f64| Pendulum {
            weight: solid.mass * GRAVITY,
            height,
            arm,
            inertia: about(plane.raise(axis)) + solid.mass * (arm * arm + height * height),
        };
        Stance::on(&corners, height, pendulum)
    }
}

/// A body that turns about an axis on the ground.
struct Pendulum {
    /// N
    weight: f64,
    /// The centre above the axis, and beside it, m.
    height: f64,
    arm: f64,
    /// About the axis, kg m².
    inertia: f64,
}

impl Pendulum {
    /// The energy that lifts the centre until it is above the axis, J. √(h² + s²) − h without its cancellation.
    fn barrier(&self) -> f64 {
        self.weight * self.arm * self.arm / (self.height.hypot(self.arm) + self.height)
    }

    fn push(&self) -> f64 {
        (2.0 * self.barrier() / self.inertia).sqrt()
    }

    fn rate(&self) -> f64 {
        (self.weight * self.height / self.inertia).sqrt()
    }
}

impl Stance {
    fn unknown() -> Self {
        Stance { height: f64::NAN, margin: f64::NAN, barrier: f64::NAN, push: f64::NAN, rate: f64::NAN }
    }

    /// The stance on a convex polygon with any number of corners; the centre of mass projects to the origin.
    fn on(corners: &[[f64; 2]], height: f64, pendulum: impl Fn([f64; 2], f64) -> Pendulum) -> Self {
        const FOOT: [f64; 2] = [0.0; 2];
        let Some(nearest) = Nearest::find(corners, FOOT).filter(|_| height > 0.0) else { return Stance::unknown() };
        let margin = Margin::new(nearest.map(|i| corners[i]), FOOT);
        // The margin grows at right angles to the axis over which the body would go.
        let [x, y] = margin.direction;
        let first = pendulum([-y, x], margin.value);
        if margin.value <= 0.0 {
            return Stance { height, margin: margin.value, barrier: 0.0, push: 0.0, rate: first.rate() };
        }
        let mut stance =
            Stance { height, margin: margin.value, barrier: first.barrier(), push: first.push(), rate: first.rate() };
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let length = f64::hypot(b[0] - a[0], b[1] - a[1]);
            let axis = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
            let arm = a[0] * axis[1] - a[1] * axis[0];
            stance.push = stance.push.min(pendulum(axis, arm).push());
        }
        stance
    }
}

impl Tipping {
    pub const ROW: usize = 26;

    /// A body that is not finite.
    pub fn nowhere() -> Self {
        Self::undefined(Solid::nowhere())
    }

    fn undefined(solid: Solid) -> Self {
        let unknown = Stance::unknown();
        Tipping { solid: solid.or_nowhere(), stance: unknown, rest: Rest::unknown(), stance_at_rest: unknown }
    }

    /// status, mass, centre, inertia row by row, lowest; height, margin, barrier, push, rate; tilt and drop (J) to rest,
    /// the tilt after nudges; margin, barrier and push at rest.
    pub fn row(&self) -> [f64; Self::ROW] {
        let Tipping { solid, stance, rest, stance_at_rest: end } = self;
        let mut row = [0.0; Self::ROW];
        row[..15].copy_from_slice(&solid.row());
        row[15..20].copy_from_slice(&[stance.height, stance.margin, stance.barrier, stance.push, stance.rate]);
        row[20..23].copy_from_slice(&[rest.tilt, solid.mass * GRAVITY * rest.sunk, rest.nudged_tilt]);
        row[23..].copy_from_slice(&[end.margin, end.barrier, end.push]);
        row
    }
}

/// A body on its ground, in local coordinates.
#[derive(Clone)]
pub struct Footing {
    solid: Solid,
    down: Vec3<f64>,
    origin: Vec3<f64>,
    /// The vertices within [`BAND`] of the lowest.
    low: Vec<u32>,
    bounds: [Vec3<f64>; 2],
}

impl Footing {
    /// Of a body that is not finite.
    pub fn nowhere() -> Self {
        let nan = [f64::NAN; 3];
        Footing { solid: Solid::nowhere(), down: nan, origin: nan, low: Vec::new(), bounds: [nan; 2] }
    }
}

/// The vertices of one body relative to its centre of mass.
struct Vertices<'a, T> {
    vertices: &'a [[T; 3]],
    origin: Vec3<f64>,
    centre: Vec3<f64>,
    bounds: [Vec3<f64>; 2],
}

impl<T: Data> Cloud for Vertices<'_, T> {
    fn offsets(&self, vertices: impl Iterator<Item = u32>) -> Vec<Vec3<f64>> {
        // The local origin is exact in the caller's precision and near, so nothing rounds before the centre is
        // subtracted.
        let offset = |vertex: u32| {
            let point = self.vertices[vertex as usize];
            [0, 1, 2].map(|k| (point[k].value() - self.origin[k]) - self.centre[k])
        };
        memory::collect(vertices.map(offset))
    }

    fn count(&self) -> usize {
        self.vertices.len()
    }

    /// To the farthest corner of the box around the body.
    fn reach(&self) -> f64 {
        let [low, high] = self.bounds;
        let far: Vec3<f64> = std::array::from_fn(|k| f64::max(self.centre[k] - low[k], high[k] - self.centre[k]));
        dot(far, far).sqrt()
    }
}

/// For each lane its vertices within [`BAND`] of the lowest.
struct Low;

impl<R: Real> Kernel<(&Extent<R>,)> for Low {
    type Output = Vec<Vec<u32>>;

    #[inline(always)]
    fn run((extent,): (&Extent<R>,)) -> Vec<Vec<u32>> {
        let limit = extent.lowest + R::of(BAND);
        let mut low = memory::filled(Vec::new(), R::LANES);
        for (vertex, &height) in extent.heights.iter().enumerate() {
            let mut lanes = (height - limit).negative();
            while lanes != 0 {
                memory::push(&mut low[lanes.trailing_zeros() as usize], vertex as u32);
                lanes &= lanes - 1;
            }
        }
        low
    }
}
