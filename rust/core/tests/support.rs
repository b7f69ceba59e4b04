//! The hull against parry's, and the linear programme against the hull.

use ipman::support::hull::{area, convex_hull};
use ipman::support::margin::{Margin, Nearest};
use ipman::support::program::is_convex_combination;
use parry2d_f64::math::Vector as Point;
use parry2d_f64::transformation::convex_hull as parry_hull;
use proptest::prelude::*;

fn margin(points: &[[f64; 2]], at: [f64; 2]) -> f64 {
    let corners: Vec<_> = convex_hull(points).into_iter().map(|i| points[i]).collect();
    Margin::new(Nearest::find(&corners, at).unwrap().map(|i| corners[i]), at).value
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn hulls_agree_with_parry(points in prop::collection::vec(prop::array::uniform2(-0.5..0.5_f64), 3..400)) {
        let ours: Vec<_> = convex_hull(&points).into_iter().map(|i| points[i]).collect();
        let theirs = parry_hull(&points.iter().map(|p| Point::new(p[0], p[1])).collect::<Vec<_>>());
        let theirs: Vec<[f64; 2]> = theirs.iter().map(|p| [p.x, p.y]).collect();
        prop_assert!((area(&ours) - area(&theirs)).abs() < 1e-14);
        // Every point is inside, and the corners turn left.
        prop_assert!(points.iter().all(|&p| margin(&points, p) > -1e-15));
    }

    /// Grids are full of duplicates and of collinear points.
    #[test]
    fn hulls_of_grids_hold_all_points(points in prop::collection::vec(prop::array::uniform2(0..4_i32), 1..40)) {
        let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(|x| 0.1 * x as f64)).collect();
        let corners = convex_hull(&points);
        let mut distinct: Vec<_> = corners.iter().map(|&i| points[i].map(f64::to_bits)).collect();
        distinct.sort();
        distinct.dedup();
        prop_assert_eq!(distinct.len(), corners.len());
        prop_assert!(points.iter().all(|&p| margin(&points, p) > -1e-15));
    }

    #[test]
    fn the_linear_programme_agrees_with_the_hull(
        points in prop::collection::vec(prop::array::uniform2(-0.3..0.3_f64), 1..500),
        at in prop::array::uniform2(-0.4..0.4_f64),
        pick in 0..500_usize,
        gap in -1e-3..1e-3_f64,
    ) {
        prop_assert_eq!(is_convex_combination(&points, at), margin(&points, at) >= 0.0);
        // Close to the boundary: a little inside or outside of some hull edge's middle.
        let corners = convex_hull(&points);
        if corners.len() > 2 {
            let (a, b) = (points[corners[pick % corners.len()]], points[corners[(pick + 1) % corners.len()]]);
            let edge = [b[0] - a[0], b[1] - a[1]];
            let length = edge[0].hypot(edge[1]);
            let near = |gap: f64| [(a[0] + b[0]) / 2.0 - gap * edge[1] / length, (a[1] + b[1]) / 2.0 + gap * edge[0] / length];
            for gap in [gap, 2e-9, -2e-9] {
                let signed = margin(&points, near(gap));
                if signed.abs() > 1e-9 {
                    prop_assert_eq!(is_convex_combination(&points, near(gap)), signed > 0.0, "gap {} margin {}", gap, signed);
                }
            }
        }
    }

    /// A hull without area has no inside, however close the point is: a segment, and slivers of three.
    #[test]
    fn thin_hulls_have_no_inside(
        ends in prop::array::uniform2(prop::array::uniform2(-1.0..1.0_f64)),
        along in 0.05..0.95_f64,
        away in prop_oneof![1e-6..1e-2_f64, -1e-2..-1e-6_f64],
    ) {
        let [a, b] = ends;
        let edge = [b[0] - a[0], b[1] - a[1]];
        let length = edge[0].hypot(edge[1]);
        prop_assume!(length > 0.01);
        let at = [a[0] + along * edge[0] - away * edge[1] / length, a[1] + along * edge[1] + away * edge[0] / length];
        let middle = [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
        for points in [vec![a, b], vec![b, a, b], vec![a, middle, b]] {
            let signed = margin(&points, at);
            prop_assert!((signed + away.abs()).abs() < 1e-15, "{} {}", signed, away);
        }
    }
}
