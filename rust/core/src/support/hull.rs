//! Convex hull in the plane: Andrew's monotone chain with exact orientation tests, so that duplicates, collinear and
//! nearly collinear points need no tolerance.

use crate::memory;
use robust::{Coord, orient2d};

/// Indices of the hull's corners, counter-clockwise from the lowest x; no corner is repeated or lies on an edge.
/// One distinct point gives one corner, collinear points give their two ends. Of equal points the first is the corner.
pub fn convex_hull(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order = memory::collect(0..points.len());
    // −0 + 0 is 0: a total order tells the two zeros apart, which would break the chain.
    let along = |i: usize, j: usize, k: usize| (points[i][k] + 0.0).total_cmp(&(points[j][k] + 0.0));
    order.sort_unstable_by(|&i, &j| along(i, j, 0).then(along(i, j, 1)).then(i.cmp(&j)));
    order.dedup_by_key(|i| points[*i]);
    if order.len() < 3 {
        return order;
    }
    let mut lower = chain(points, order.iter().copied());
    let mut upper = chain(points, order.iter().rev().copied());
    lower.pop();
    upper.pop();
    memory::extend(&mut lower, upper);
    lower
}

/// One side of the hull: every turn is strictly to the left.
fn chain(points: &[[f64; 2]], order: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut chain: Vec<usize> = Vec::new();
    for next in order {
        while let [.., a, b] = chain[..] {
            if turn(points[a], points[b], points[next]) > 0.0 {
                break;
            }
            chain.pop();
        }
        memory::push(&mut chain, next);
    }
    chain
}

/// Positive where `c` lies to the left of a → b, negative to the right, 0 on the line; the sign is exact.
pub(super) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    orient2d(a, b, c)
}

/// Area of a counter-clockwise polygon.
pub fn area(corners: &[[f64; 2]]) -> f64 {
    let Some(&[x0, y0]) = corners.first() else { return 0.0 };
    let doubled: f64 = corners
        .windows(2)
        .map(|pair| (pair[0][0] - x0) * (pair[1][1] - y0) - (pair[1][0] - x0) * (pair[0][1] - y0))
        .sum();
    doubled / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degenerate_sets_have_degenerate_hulls() {
        assert!(convex_hull(&[]).is_empty());
        assert_eq!(convex_hull(&[[1.0, 2.0]; 5]).len(), 1);
        let line: Vec<_> = (0..9).map(|i| [i as f64 * 0.1, i as f64 * 0.2]).collect();
        let ends = convex_hull(&line);
        assert_eq!(ends.len(), 2);
        assert_eq!(area(&[line[ends[0]], line[ends[1]]]), 0.0);
    }

    #[test]
    fn both_zeros_are_one() {
        let points = [[0.0, -0.0], [-0.0, 1.0], [-1.0, 0.0], [0.0, 0.5], [-0.0, -0.0]];
        assert_eq!(convex_hull(&points), [2, 0, 1]);
    }

    #[test]
    fn a_filled_square_has_four_corners() {
        let grid: Vec<_> = (0..121).map(|i| [(i / 11) as f64, (i % 11) as f64]).collect();
        let corners: Vec<_> = convex_hull(&grid).into_iter().map(|i| grid[i]).collect();
        assert_eq!(corners, [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]);
        assert_eq!(area(&corners), 100.0);
    }
}
