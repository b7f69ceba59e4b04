//! The hull of the contacts. A filter on SIMD lanes comes first: a contact inside the polygon of those that are extreme
//! in some directions cannot be a corner (Akl and Toussaint). The exact hull is taken of the remaining ones.

use crate::memory;
use crate::number::{Kernel, Real, Scalar};
use crate::posed::PosedBody;
use crate::support::contact::{Contacts, OneBody};
use crate::support::hull;

/// The hull of one lane's contacts.
#[derive(Default)]
pub struct Hull {
    /// The corners' samples, counter-clockwise.
    pub samples: Vec<u32>,
    /// Their positions on the ground.
    pub corners: Vec<[f64; 2]>,
    pub num_contacts: usize,
}

impl<R: Real> Contacts<R> {
    /// The hull of each lane.
    pub fn hulls(&self, posed: &PosedBody<R>) -> Vec<Hull> {
        let edges = Edges::new(self, posed, &R::dispatch::<Extremes, _>((self,)));
        R::dispatch::<Hulls, _>((self, posed, edges))
    }
}

/// 16 leave about half as many points to the exact hull as 8; more cost more than they save.
const DIRECTIONS: usize = 16;

/// In each direction the index of the extreme contact among the touches, −1 in a lane without contacts.
struct Extremes;

impl<R: Real> Kernel<(&Contacts<R>,)> for Extremes {
    type Output = [R; DIRECTIONS];

    #[inline(always)]
    fn run((contacts,): (&Contacts<R>,)) -> [R; DIRECTIONS] {
        let mut normals = [[R::zero(); 2]; DIRECTIONS];
        for (k, normal) in normals.iter_mut().enumerate() {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
            *normal = [R::of(cos), R::of(sin)];
        }
        let mut best = [R::of(-f64::MAX); DIRECTIONS];
        let mut place = [R::of(-1.0); DIRECTIONS];
        for (i, touch) in contacts.touches.iter().enumerate() {
            let here = R::of(i as f64);
            let [x, y] = touch.flat;
            for k in 0..DIRECTIONS {
                let reach = normals[k][0].mul_add(x, normals[k][1] * y);
                let ahead = touch.test.if_negative(best[k] - reach, R::zero());
                best[k] = ahead.if_negative(reach, best[k]);
                place[k] = ahead.if_negative(here, place[k]);
            }
        }
        place
    }
}

/// The edges of the extreme contacts' polygon: for points inside it all normal · x + offset are positive by more than
/// the rounding error.
struct Edges<R> {
    normals: [[R; 2]; DIRECTIONS],
    offsets: [R; DIRECTIONS],
}

impl<R: Real> Edges<R> {
    fn new(contacts: &Contacts<R>, posed: &PosedBody<R>, extremes: &[R; DIRECTIONS]) -> Self {
        let of_lane = |lane: usize| lane_edges(contacts, posed, lane, extremes);
        let lanes: Vec<_> = (0..R::LANES).map(of_lane).collect();
        let number = |k: usize, i: usize| R::from_lanes(|lane| Real::of(lanes[lane][k][i]));
        Edges {
            normals: std::array::from_fn(|k| [number(k, 0), number(k, 1)]),
            offsets: std::array::from_fn(|k| number(k, 2)),
        }
    }

    /// Bit mask of the lanes in which a point is inside.
    #[inline(always)]
    fn inside(&self, [x, y]: [R; 2]) -> u32 {
        let depth = |k: usize| self.normals[k][0].mul_add(x, self.normals[k][1].mul_add(y, self.offsets[k]));
        let mut least = depth(0);
        for k in 1..DIRECTIONS {
            least = least.at_most(depth(k));
        }
        (-least).negative()
    }
}

/// (normal, offset) of the edges in one lane, from the exact positions of the extreme contacts; with fewer corners than
/// directions edges repeat. No point is inside a polygon without area.
fn lane_edges<R: Real>(
    contacts: &Contacts<R>,
    posed: &PosedBody<R>,
    lane: usize,
    extremes: &[R; DIRECTIONS],
) -> [[f64; 3]; DIRECTIONS] {
    let nowhere = [[0.0, 0.0, -1.0]; DIRECTIONS];
    let rounding = contacts.rounding.lane(lane).value();
    let body = OneBody::new(posed, lane);
    let mut points = memory::with_capacity(DIRECTIONS);
    for place in extremes {
        let place = place.lane(lane).value();
        if place >= 0.0 {
            points.push(body.flat(contacts.touches[place as usize].sample));
        }
    }
    let corners = hull::convex_hull(&points);
    if corners.len() < 3 || !rounding.is_finite() {
        return nowhere;
    }
    std::array::from_fn(|k| {
        let (a, b) = (points[corners[k % corners.len()]], points[corners[(k + 1) % corners.len()]]);
        let length = f64::hypot(b[0] - a[0], b[1] - a[1]);
        let normal = [(a[1] - b[1]) / length, (b[0] - a[0]) / length];
        // A point's coordinates, its depth and the edge's numbers are each off by less than `rounding`.
        [normal[0], normal[1], -(normal[0] * a[0] + normal[1] * a[1]) - 4.0 * rounding]
    })
}

/// [`Contacts::hulls`]
struct Hulls;

impl<R: Real> Kernel<(&Contacts<R>, &PosedBody<'_, R>, Edges<R>)> for Hulls {
    type Output = Vec<Hull>;

    #[inline(always)]
    fn run((contacts, posed, edges): (&Contacts<R>, &PosedBody<R>, Edges<R>)) -> Vec<Hull> {
        let mut candidates = memory::filled(Vec::new(), R::LANES);
        for touch in &contacts.touches {
            let mut lanes = touch.lanes & !edges.inside(touch.flat);
            while lanes != 0 {
                memory::push(&mut candidates[lanes.trailing_zeros() as usize], touch.sample);
                lanes &= lanes - 1;
            }
        }
        let mut hulls = memory::with_capacity(R::LANES);
        for (lane, mut samples) in candidates.into_iter().enumerate() {
            let num_contacts = contacts.count(lane);
            if num_contacts == 0 {
                hulls.push(Hull::default());
                continue;
            }
            // In public order: of equal points the first is the corner.
            samples.sort_unstable();
            let body = OneBody::new(posed, lane);
            let mut positions = memory::with_capacity(samples.len());
            for &sample in &samples {
                positions.push(body.flat(sample));
            }
            let corners = hull::convex_hull(&positions);
            hulls.push(Hull {
                samples: memory::collect(corners.iter().map(|&i| samples[i])),
                corners: memory::collect(corners.iter().map(|&i| positions[i])),
                num_contacts,
            });
        }
        hulls
    }
}
