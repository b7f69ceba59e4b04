//! The base of support: the hull of the contact samples on the ground (section 3.2), and whether the centre of mass lies
//! over it (BoSE, Eq. 10).

mod contact;
mod extremes;
pub mod hull;
pub mod margin;
#[cfg(feature = "lp")]
pub mod program;

pub use contact::{Contact, ContactRule};

use crate::error::Result;
use crate::mass::{Centre, Method};
use crate::memory;
use crate::number::vector::{Vec3, narrow};
use crate::number::{Real, Scalar, WideScalar};
use crate::posed::{self, PosedBody};
use crate::quantity::Quantity;
use crate::support::extremes::Hull;
use crate::support::margin::{Margin, Nearest};
use crate::template::Template;

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
    /// The base of support of each lane, given its centre of mass.
    pub fn new<R: Real>(posed: &PosedBody<R>, contact: &Contact, centre: &Centre<R>) -> Vec<Self> {
        let centre = posed.plane.flatten(centre.point);
        let hulls = contact.find(posed).hulls(posed);
        hulls
            .iter()
            .enumerate()
            .map(|(lane, hull)| Self::of_hull(posed, hull, posed::lane(centre, lane), lane))
            .collect()
    }

    fn of_hull<R: Real>(posed: &PosedBody<R>, hull: &Hull, centre: [f64; 2], lane: usize) -> Self {
        let margin = match Nearest::find(&hull.corners, centre) {
            Some(nearest) => Margin::new(nearest.map(|i| hull.corners[i]), centre).value,
            None => f64::NEG_INFINITY,
        };
        let value = |x: R::Wide| x.lane(lane).value();
        let [e1, e2, normal, origin] =
            [posed.plane.axes[0], posed.plane.axes[1], posed.ground.normal, posed.origin].map(|v| v.map(value));
        let lift = value(posed.ground.height);
        let place = |&[x, y]: &[f64; 2]| std::array::from_fn(|k| x * e1[k] + y * e2[k] + lift * normal[k] + origin[k]);
        BaseOfSupport {
            polygon: memory::collect(hull.corners.iter().map(place)),
            area: hull::area(&hull.corners),
            margin,
            num_contacts: hull.num_contacts,
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

/// BoSE of each lane by the paper's linear programme: g(m̄) is a convex combination of the contact points.
#[cfg(feature = "lp")]
pub fn is_supported_lp<R: Real>(posed: &PosedBody<R>, contact: &Contact, method: Method) -> Vec<bool> {
    let centre = posed.plane.flatten(method.forward(posed).point);
    let contacts = contact.find(posed);
    let supported = |lane| program::is_convex_combination(&contacts.positions(posed, lane), posed::lane(centre, lane));
    (0..R::LANES).map(supported).collect()
}

/// The signed margin as a differentiable quantity, m.
///
/// ```
/// use ipman::Batch;
/// use ipman::mass::Method;
/// use ipman::support::{Contact, ContactRule, SupportMargin};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };
/// let margin = batch.value(&SupportMargin { contact, method: Method::Exact })?[0];
/// // From the middle of the base to its edge; the hull of the samples is slightly smaller than the base.
/// assert!(margin > 0.4 && margin <= 0.5);
/// # Ok::<(), ipman::Error>(())
/// ```
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
    fn nearest<R: Real>(&self, posed: &PosedBody<R>, centre: &Centre<R>) -> Vec<Option<Nearest<u32>>> {
        let point = posed.plane.flatten(centre.point);
        let hulls = self.contact.find(posed).hulls(posed);
        let nearest = |(lane, hull): (usize, &Hull)| {
            Some(Nearest::find(&hull.corners, posed::lane(point, lane))?.map(|i| hull.samples[i]))
        };
        hulls.iter().enumerate().map(nearest).collect()
    }

    /// The margin and its derivatives, for a fixed nearest boundary.
    #[inline(always)]
    fn margin<R: Real>(
        posed: &PosedBody<R>,
        centre: &Centre<R>,
        nearest: Nearest<u32>,
        lane: usize,
    ) -> Margin<WideScalar<R>> {
        let flatten = |point| posed.plane.flatten(point).map(|x: R::Wide| x.lane(lane));
        let samples = &posed.template.samples;
        let ends = nearest.map(|sample| flatten(samples.wide_point(sample as usize, posed.points)));
        Margin::new(ends, flatten(centre.point))
    }
}

impl Quantity for SupportMargin {
    type Saved<R: Real> = SavedMargin<R>;

    fn num_outputs(&self, _: &Template) -> usize {
        1
    }

    fn check(&self, _: &Template) -> Result<()> {
        self.contact.check()
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> SavedMargin<R> {
        let centre = self.method.forward(posed);
        let nearest = self.nearest(posed, &centre);
        let lanes = R::Wide::from_lanes(|lane| match nearest[lane] {
            Some(nearest) => Self::margin(posed, &centre, nearest, lane).value,
            None => Real::of(f64::NEG_INFINITY),
        });
        out[0] = R::narrow(lanes);
        SavedMargin { centre, nearest }
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &SavedMargin<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let margins: Vec<_> =
            (0..R::LANES).map(|lane| Some(Self::margin(posed, &saved.centre, saved.nearest[lane]?, lane))).collect();
        // The direction of each lane's derivative; no contact, no derivative.
        let direction: [R::Wide; 2] = std::array::from_fn(|k| {
            R::Wide::from_lanes(|lane| margins[lane].as_ref().map_or(Real::zero(), |margin| margin.direction[k]))
        });
        let d_centre = posed.plane.raise(direction.map(|x| x * d_out[0].widen()));
        self.method.backward(posed, &saved.centre, d_centre, d_points);
        for lane in 0..R::LANES {
            let (Some(nearest), Some(margin)) = (saved.nearest[lane], &margins[lane]) else { continue };
            for (sample, share) in nearest.ends().into_iter().zip(margin.shares) {
                let only = |x: R::Wide| {
                    R::Wide::from_lanes(|l| if l == lane { -(share * x.lane(lane)) } else { Real::zero() })
                };
                let d_point = narrow::<R>(d_centre.map(only));
                posed.template.samples.point_backward(sample as usize, d_point, d_points);
            }
        }
    }
}
