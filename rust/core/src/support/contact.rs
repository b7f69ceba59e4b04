//! Contact: which samples touch the ground. Single and double precision agree on the contacts: a sample whose height in
//! single precision is closer to τ than the rounding error is decided in double precision.

use crate::error::{Result, unknown_choice};
use crate::ground::Plane;
use crate::memory;
use crate::number::{Data, Kernel, Real, Scalar, WideScalar};
use crate::options::positive;
use crate::posed::PosedBody;

/// Which samples touch the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactRule {
    /// |h| < τ, the paper's set C (section 3.2).
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

    /// The distance that is compared with τ.
    #[inline(always)]
    fn distance<R: Real>(self, height: R) -> R {
        match self {
            ContactRule::Paper => height.abs(),
            ContactRule::Released => height,
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

/// The samples that touch the ground in any lane.
pub struct Contacts<R: Real> {
    pub(super) touches: Vec<Touch<R>>,
    /// Number of contacts of each lane, an integer.
    count: R,
    rule: ContactRule,
    /// Upper bound of the rounding error of a height or of a coordinate on the ground, m.
    pub(super) rounding: R,
}

pub(super) struct Touch<R> {
    pub sample: u32,
    /// Bit mask of the lanes in which it touches.
    pub lanes: u32,
    /// Negative in the lanes in which it touches.
    pub test: R,
    /// Its position on the ground, in the precision of R.
    pub flat: [R; 2],
}

impl Contact {
    pub fn check(&self) -> Result<()> {
        positive("threshold", self.threshold)
    }

    pub fn find<R: Real>(&self, posed: &PosedBody<R>) -> Contacts<R> {
        R::dispatch::<Find, _>((self, posed))
    }

    /// The lanes among `lanes` in which a sample touches, decided in double precision.
    #[inline(always)]
    fn decide<R: Real>(&self, posed: &PosedBody<R>, sample: usize, lanes: u32) -> u32 {
        let height = posed.ground.signed_height(posed.template.samples.wide_point(sample, posed.points));
        let mut touching = 0;
        for lane in 0..R::LANES {
            let touches = self.rule.distance(height.lane(lane)).value() < self.threshold;
            touching |= u32::from(touches) << lane;
        }
        touching & lanes
    }
}

/// [`Contact::find`]
struct Find;

impl<R: Real> Kernel<(&Contact, &PosedBody<'_, R>)> for Find {
    type Output = Contacts<R>;

    #[inline(always)]
    fn run((contact, posed): (&Contact, &PosedBody<R>)) -> Contacts<R> {
        let all = u32::MAX >> (32 - R::LANES);
        let walk = &posed.template.samples.walk;
        let plane = posed.narrow_plane();
        let threshold = R::of(contact.threshold);
        let rounding = rounding(posed, contact.threshold);
        let high = threshold + rounding;
        let heights = posed.heights();
        let above = lanes_above(&heights, high);
        let mut touches = Vec::new();
        let mut count = R::zero();
        for chunk in &walk.chunks {
            let (groups, size) = walk.groups(chunk);
            for (group, &[a, b, c]) in groups.iter().enumerate() {
                let [a, b, c] = [a as usize, b as usize, c as usize];
                if above[a] & above[b] & above[c] == all {
                    continue;
                }
                let start = heights[a];
                let (to_b, to_c) = (heights[b] - start, heights[c] - start);
                let flat_a = plane.flatten(posed.points[a]);
                let (flat_b, flat_c) = (plane.flatten(posed.points[b]), plane.flatten(posed.points[c]));
                let edges_x = (flat_b[0] - flat_a[0], flat_c[0] - flat_a[0]);
                let edges_y = (flat_b[1] - flat_a[1], flat_c[1] - flat_a[1]);
                for place in chunk.samples.start + group * size..chunk.samples.start + (group + 1) * size {
                    let [_, v, w] = walk.weights::<R>(place);
                    let distance = contact.rule.distance(w.mul_add(to_c, v.mul_add(to_b, start)));
                    let inside = (distance + rounding - threshold).negative();
                    let outside = (high - distance).negative();
                    let mut test = distance - threshold;
                    let mut lanes = inside;
                    let unsure = all & !(inside | outside);
                    if unsure != 0 {
                        lanes |= contact.decide(posed, walk.order[place] as usize, unsure);
                        test = R::from_lanes(|lane| Real::of(if lanes >> lane & 1 == 1 { -1.0 } else { 1.0 }));
                    }
                    if lanes != 0 {
                        count = count + test.if_negative(R::of(1.0), R::zero());
                        let x = w.mul_add(edges_x.1, v.mul_add(edges_x.0, flat_a[0]));
                        let y = w.mul_add(edges_y.1, v.mul_add(edges_y.0, flat_a[1]));
                        memory::push(&mut touches, Touch { sample: walk.order[place], lanes, test, flat: [x, y] });
                    }
                }
            }
        }
        Contacts { touches, count, rule: contact.rule, rounding }
    }
}

/// Upper bound of the rounding error of any sample's height or coordinate on the ground, m. Both are computed by a dot
/// product with a vertex and two interpolations: about 20 roundings of at most half ε times the longest vector plus the
/// ground's height each. The bound is three times their sum.
#[inline(always)]
fn rounding<R: Real>(posed: &PosedBody<R>, threshold: f64) -> R {
    let mut longest = R::zero();
    for vertex in &posed.points[..posed.template.mesh.num_vertices] {
        longest = longest.at_least(vertex[0].abs() + vertex[1].abs() + vertex[2].abs());
    }
    let height = R::narrow(posed.ground.height).abs();
    R::of(32.0 * R::Data::EPSILON) * (longest + height + R::of(threshold.abs()))
}

/// For each vertex the lanes in which it is certainly too high for contact: a face with three such vertices has none.
#[inline(always)]
fn lanes_above<R: Real>(heights: &[R], high: R) -> Vec<u32> {
    let mut above = memory::with_capacity(heights.len());
    for &height in heights {
        above.push((high - height).negative());
    }
    above
}

impl<R: Real> Contacts<R> {
    /// Number of contacts of a lane.
    pub fn count(&self, lane: usize) -> usize {
        let count = self.count.lane(lane).value() as usize;
        if self.rule == ContactRule::Released && count < RELEASED_MINIMUM { 0 } else { count }
    }

    /// The contacts' positions on the ground in one lane, in double precision.
    #[cfg(feature = "lp")]
    pub fn positions(&self, posed: &PosedBody<R>, lane: usize) -> Vec<[f64; 2]> {
        if self.count(lane) == 0 {
            return Vec::new();
        }
        let body = OneBody::new(posed, lane);
        let touches = self.touches.iter().filter(|touch| touch.lanes >> lane & 1 == 1);
        memory::collect(touches.map(|touch| body.flat(touch.sample)))
    }
}

/// One lane of a posed body, in double precision.
pub(super) struct OneBody<'a, R: Real> {
    posed: &'a PosedBody<'a, R>,
    lane: usize,
    plane: Plane<WideScalar<R>>,
}

impl<'a, R: Real> OneBody<'a, R> {
    #[inline(always)]
    pub fn new(posed: &'a PosedBody<'a, R>, lane: usize) -> Self {
        let of = |vector: [R::Wide; 3]| [vector[0].lane(lane), vector[1].lane(lane), vector[2].lane(lane)];
        OneBody { posed, lane, plane: Plane { axes: [of(posed.plane.axes[0]), of(posed.plane.axes[1])] } }
    }

    /// A sample's position on the ground.
    #[inline(always)]
    pub fn flat(&self, sample: u32) -> [f64; 2] {
        let point = self.posed.template.samples.point_of_lane(sample as usize, self.posed.points, self.lane);
        let [x, y] = self.plane.flatten(point);
        [x.value(), y.value()]
    }
}
