//! The signed margin: metres from a point to the boundary of a convex polygon, positive inside.

use crate::number::Scalar;
use crate::support::hull::turn;

/// Where on the boundary the nearest point lies: within an edge that runs counter-clockwise, or at a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nearest<P> {
    Edge(P, P),
    Corner(P),
}

impl<P: Copy> Nearest<P> {
    pub fn map<Q>(self, f: impl Fn(P) -> Q) -> Nearest<Q> {
        match self {
            Nearest::Edge(a, b) => Nearest::Edge(f(a), f(b)),
            Nearest::Corner(a) => Nearest::Corner(f(a)),
        }
    }

    /// The edge's ends; a corner counts for both.
    pub fn ends(self) -> [P; 2] {
        match self {
            Nearest::Edge(a, b) => [a, b],
            Nearest::Corner(a) => [a, a],
        }
    }
}

impl Nearest<usize> {
    /// For a counter-clockwise polygon with any number of corners; None without corners. Two corners are an edge
    /// traversed both ways, so every point is outside or on it.
    pub fn find(corners: &[[f64; 2]], point: [f64; 2]) -> Option<Self> {
        if corners.len() < 2 {
            return corners.first().map(|_| Nearest::Corner(0));
        }
        let edges = (0..corners.len()).map(|a| (a, (a + 1) % corners.len()));
        // From outside, only edges with the point on their right can be nearest. Deciding this exactly instead of by
        // distance keeps the sign correct for thin hulls, whose two sides are equally far away.
        let faces = |&(a, b): &(usize, usize)| turn(corners[a], corners[b], point) < 0.0;
        let outside = edges.clone().any(|edge| faces(&edge));
        let candidates = edges.filter(|edge| !outside || faces(edge));
        let feet = candidates.map(|(a, b)| (a, b, to_segment(corners[a], corners[b], point)));
        let (a, b, (foot, _)) = feet.min_by(|x, y| x.2.1.total_cmp(&y.2.1))?;
        Some(match foot {
            t if t <= 0.0 => Nearest::Corner(a),
            t if t >= 1.0 => Nearest::Corner(b),
            _ => Nearest::Edge(a, b),
        })
    }
}

/// The foot's position along the segment, unclamped, and the distance to the segment.
fn to_segment(a: [f64; 2], b: [f64; 2], point: [f64; 2]) -> (f64, f64) {
    let edge = [b[0] - a[0], b[1] - a[1]];
    let arm = [point[0] - a[0], point[1] - a[1]];
    let foot = (arm[0] * edge[0] + arm[1] * edge[1]) / (edge[0] * edge[0] + edge[1] * edge[1]);
    let t = foot.clamp(0.0, 1.0);
    (foot, f64::hypot(arm[0] - t * edge[0], arm[1] - t * edge[1]))
}

/// A margin and its derivatives: `direction` by the point, −share · `direction` by each end of the nearest edge.
pub struct Margin<S> {
    pub value: S,
    pub direction: [S; 2],
    pub shares: [S; 2],
}

impl<S: Scalar> Margin<S> {
    pub fn new(nearest: Nearest<[S; 2]>, point: [S; 2]) -> Self {
        match nearest {
            Nearest::Edge(a, b) => Self::to_edge(a, b, point),
            Nearest::Corner(a) => Self::to_corner(a, point),
        }
    }

    /// Distance to the edge's line along its inward normal.
    fn to_edge(a: [S; 2], b: [S; 2], point: [S; 2]) -> Self {
        let edge = [b[0] - a[0], b[1] - a[1]];
        let arm = [point[0] - a[0], point[1] - a[1]];
        let squared = edge[0] * edge[0] + edge[1] * edge[1];
        let length = squared.sqrt();
        let normal = [-edge[1] / length, edge[0] / length];
        let share = (arm[0] * edge[0] + arm[1] * edge[1]) / squared;
        Margin {
            value: normal[0] * arm[0] + normal[1] * arm[1],
            direction: normal,
            shares: [S::of(1.0) - share, share],
        }
    }

    /// A corner is nearest only from outside.
    fn to_corner(a: [S; 2], point: [S; 2]) -> Self {
        let arm = [point[0] - a[0], point[1] - a[1]];
        let distance = (arm[0] * arm[0] + arm[1] * arm[1]).sqrt();
        let inverse = S::of(-1.0) / distance.at_least(S::of(1e-300));
        Margin { value: -distance, direction: arm.map(|x| x * inverse), shares: [S::of(1.0), S::zero()] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn margin(corners: &[[f64; 2]], point: [f64; 2]) -> f64 {
        Margin::new(Nearest::find(corners, point).unwrap().map(|i| corners[i]), point).value
    }

    #[test]
    fn a_rectangle_has_the_margins_that_a_ruler_gives() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]];
        assert_eq!(margin(&corners, [2.0, 0.5]), 0.5);
        assert_eq!(margin(&corners, [3.75, 1.0]), 0.25);
        assert_eq!(margin(&corners, [2.0, -1.0]), -1.0);
        assert_eq!(margin(&corners, [7.0, 6.0]), -5.0);
        assert_eq!(margin(&corners, [0.0, 1.0]), 0.0);
        assert_eq!(margin(&corners, [0.0, 0.0]), 0.0);
    }

    #[test]
    fn a_segment_and_a_point_have_no_inside() {
        let segment = [[0.0, 0.0], [2.0, 0.0]];
        assert_eq!(margin(&segment, [1.0, 0.3]), -0.3);
        assert_eq!(margin(&segment, [1.0, -0.3]), -0.3);
        assert_eq!(margin(&segment, [1.0, 0.0]), 0.0);
        assert_eq!(margin(&segment, [5.0, 4.0]), -5.0);
        assert_eq!(margin(&[[1.0, 1.0]], [1.0, 3.0]), -2.0);
        assert_eq!(Nearest::find(&[], [0.0, 0.0]), None);
    }
}
