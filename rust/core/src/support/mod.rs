//! The base of support: the hull of the contact samples on the ground, and whether the centre of mass lies over it.

pub mod hull;
pub mod margin;
#[cfg(feature = "lp")]
pub mod program;

use crate::error::Result;
use crate::ground::values;
use crate::mass::{Centre, Method};
use crate::number::vector::{Vec3, narrow};
use crate::number::{Real, Room, Scalar};
use crate::quantity::{Quantity, unknown_choice};
use crate::scene::{self, Scene};
use crate::support::margin::{Margin, Nearest};
use crate::template::Template;

/// Which samples touch the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactRule {
    /// |h| < τ
    Paper,
    /// h < τ, and ten contacts or fewer count as none: the authors' released code.
    Released,
}

impl ContactRule {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "paper" => Ok(ContactRule::Paper),
            "released" => Ok(ContactRule::Released),
            _ => Err(unknown_choice("contact", "\"paper\", \"released\"", name)),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    pub rule: ContactRule,
    /// τ, m
    pub threshold: f64,
}

const RELEASED_MINIMUM: usize = 11;

impl Contact {
    fn touches(&self, height: f64) -> bool {
        match self.rule {
            ContactRule::Paper => height.abs() < self.threshold,
            ContactRule::Released => height < self.threshold,
        }
    }

    /// The contact samples of one lane and their positions on the ground. Always decided in double precision, so that
    /// single and double precision agree on the contact set.
    fn find<R: Real>(&self, scene: &Scene<R>, lane: usize) -> (Vec<u32>, Vec<[f64; 2]>) {
        R::apart::<Find, _>((self, scene, lane))
    }
}

/// [`Contact::find`]
struct Find;

impl<R: Real> Room<(&Contact, &Scene<'_, R>, usize)> for Find {
    type Output = (Vec<u32>, Vec<[f64; 2]>);

    #[inline(always)]
    fn enter((contact, scene, lane): (&Contact, &Scene<R>, usize)) -> (Vec<u32>, Vec<[f64; 2]>) {
        {
            let (mut samples, mut positions) = (Vec::new(), Vec::new());
            for sample in 0..scene.template.samples.len() {
                let point = scene.template.samples.wide_point(sample, scene.points);
                if contact.touches(scene.ground.signed_height(point).lane(lane).value()) {
                    samples.push(sample as u32);
                    positions.push(values(scene.plane.flatten(point).map(|x| x.lane(lane))));
                }
            }
            if contact.rule == ContactRule::Released && samples.len() < RELEASED_MINIMUM {
                return (Vec::new(), Vec::new());
            }
            (samples, positions)
        }
    }
}

/// The base of support of one body.
#[derive(Clone, Debug)]
pub struct BaseOfSupport {
    /// Corners on the ground in the world, counter-clockwise seen from above; empty without contact.
    pub polygon: Vec<Vec3<f64>>,
    /// m²
    pub area: f64,
    /// Distance from the centre of mass, on the ground, to the polygon's boundary: positive inside, −∞ without contact.
    pub margin: f64,
    pub num_contacts: usize,
}

impl BaseOfSupport {
    /// Of the body of each lane, with the centre of mass that the scene's method has found.
    pub fn of_lanes<R: Real>(scene: &Scene<R>, contact: &Contact, centre: &Centre<R>) -> Vec<Self> {
        let centre = scene.plane.flatten(centre.point);
        (0..R::LANES).map(|lane| Self::of_lane(scene, contact, scene::lane(centre, lane), lane)).collect()
    }

    fn of_lane<R: Real>(scene: &Scene<R>, contact: &Contact, centre: [f64; 2], lane: usize) -> Self {
        let (_, positions) = contact.find(scene, lane);
        let corners: Vec<[f64; 2]> = hull::convex_hull(&positions).into_iter().map(|i| positions[i]).collect();
        let margin = match Nearest::find(&corners, centre) {
            Some(nearest) => Margin::new(nearest.map(|i| corners[i]), centre).value,
            None => f64::NEG_INFINITY,
        };
        let value = |x: R::Wide| x.lane(lane).value();
        let axes = scene.plane.axes.map(|axis| axis.map(value));
        let (normal, origin, lift) =
            (scene.ground.normal.map(value), scene.origin.map(value), value(scene.ground.height));
        let place = |flat: &[f64; 2]| {
            std::array::from_fn(|k| flat[0] * axes[0][k] + flat[1] * axes[1][k] + lift * normal[k] + origin[k])
        };
        BaseOfSupport {
            polygon: corners.iter().map(place).collect(),
            area: hull::area(&corners),
            margin,
            num_contacts: positions.len(),
        }
    }

    pub fn has_contact(&self) -> bool {
        self.num_contacts > 0
    }

    /// The paper's BoSE: the centre of mass lies over the base of support.
    pub fn inside(&self) -> bool {
        self.margin >= 0.0
    }
}

/// BoSE by the paper's linear programme: g(m̄) is a convex combination of the contact points.
#[cfg(feature = "lp")]
pub fn is_supported_lp(scene: &Scene<f64>, contact: &Contact, method: Method) -> bool {
    let (_, positions) = contact.find(scene, 0);
    program::is_convex_combination(&positions, scene.plane.flatten(method.forward(scene).point))
}

/// The signed margin as a differentiable quantity, m.
pub struct SupportMargin {
    pub contact: Contact,
    pub method: Method,
}

/// For each lane the samples that span the nearest boundary, as the boundary's two ends, and the centre of mass.
pub struct SavedMargin<R: Real> {
    centre: Centre<R>,
    nearest: Vec<Option<Nearest<u32>>>,
}

impl SupportMargin {
    #[inline(always)]
    fn nearest<R: Real>(&self, scene: &Scene<R>, centre: &Centre<R>, lane: usize) -> Option<Nearest<u32>> {
        let (samples, positions) = self.contact.find(scene, lane);
        let corners = hull::convex_hull(&positions);
        let polygon: Vec<_> = corners.iter().map(|&i| positions[i]).collect();
        let point = values(scene.plane.flatten(centre.point).map(|x| x.lane(lane)));
        Some(Nearest::find(&polygon, point)?.map(|i| samples[corners[i]]))
    }

    /// The margin and its derivatives, with the nearest boundary held.
    #[inline(always)]
    fn margin<R: Real>(
        scene: &Scene<R>,
        centre: &Centre<R>,
        nearest: Nearest<u32>,
        lane: usize,
    ) -> Margin<<R::Wide as Real>::Scalar> {
        let flatten = |point| scene.plane.flatten(point).map(|x: R::Wide| x.lane(lane));
        let samples = &scene.template.samples;
        let ends = nearest.map(|sample| flatten(samples.wide_point(sample as usize, scene.points)));
        Margin::new(ends, flatten(centre.point))
    }
}

impl Quantity for SupportMargin {
    type Saved<R: Real> = SavedMargin<R>;

    fn len(&self, _: &Template) -> usize {
        1
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> SavedMargin<R> {
        let centre = self.method.forward(scene);
        let nearest: Vec<_> = (0..R::LANES).map(|lane| self.nearest(scene, &centre, lane)).collect();
        let lanes = R::Wide::from_lanes(|lane| match nearest[lane] {
            Some(nearest) => Self::margin(scene, &centre, nearest, lane).value,
            None => Real::of(f64::NEG_INFINITY),
        });
        out[0] = R::narrow(lanes);
        SavedMargin { centre, nearest }
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &SavedMargin<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let margins: Vec<_> =
            (0..R::LANES).map(|lane| Some(Self::margin(scene, &saved.centre, saved.nearest[lane]?, lane))).collect();
        // The direction of each lane's derivative; no contact, no derivative.
        let direction: [R::Wide; 2] = std::array::from_fn(|k| {
            R::Wide::from_lanes(|lane| margins[lane].as_ref().map_or(Real::zero(), |margin| margin.direction[k]))
        });
        let d_centre = scene.plane.raise(direction.map(|x| x * d_out[0].widen()));
        self.method.backward(scene, &saved.centre, d_centre, d_points);
        for lane in 0..R::LANES {
            let (Some(nearest), Some(margin)) = (saved.nearest[lane], &margins[lane]) else { continue };
            for (sample, share) in nearest.ends().into_iter().zip(margin.shares) {
                let only = |x: R::Wide| {
                    R::Wide::from_lanes(|l| if l == lane { -(share * x.lane(lane)) } else { Real::zero() })
                };
                let d_point = narrow::<R>(d_centre.map(only));
                scene.template.samples.point_backward(sample as usize, d_point, d_points);
            }
        }
    }
}
