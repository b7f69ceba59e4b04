//! The paper's test for the base of support (Eq. 10) as a linear programme: is g(m̄) = Σ w_i g(v_i) with w ≥ 0, Σ w = 1?
//!
//! Solved as the equivalent ray programme, which is always feasible: from the contacts' mean c, how far towards the point
//! m does the hull reach? maximise t subject to Σ w_i (x_i − c) = t (m − c), Σ w_i = 1, w, t ≥ 0. The point is supported
//! when t ≥ 1. Mehrotra's predictor-corrector interior-point method; its 3 × 3 normal equations are factored by faer.

use crate::memory;
use faer::linalg::solvers::{Ldlt, Solve};
use faer::{Col, Mat, Side};

const MAX_ITERATIONS: usize = 100;
/// Mean complementarity below which only rounding is left: the iteration then ends once the residuals stop falling.
/// They reach about 1e-13, which gives the hull's extent to about 1e-12 of its size.
const CONVERGED_GAP: f64 = 1e-10;

/// Whether `point` is a convex combination of `points`.
pub fn is_convex_combination(points: &[[f64; 2]], point: [f64; 2]) -> bool {
    if points.is_empty() {
        return false;
    }
    let n = points.len() as f64;
    let mean: [f64; 2] = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let spread = points.iter().flat_map(|p| [p[0] - mean[0], p[1] - mean[1]]).fold(0.0_f64, |m, x| m.max(x.abs()));
    let target = [point[0] - mean[0], point[1] - mean[1]];
    let distance = f64::hypot(target[0], target[1]);
    if distance <= 1e-12 * spread.max(1e-300) || distance == 0.0 {
        return true;
    }
    if spread == 0.0 {
        return false;
    }
    // Unit-sized columns: the ray as a unit vector, the points in units of their spread.
    let mut columns = memory::with_capacity(points.len() + 1);
    columns.extend(points.iter().map(|p| [(p[0] - mean[0]) / spread, (p[1] - mean[1]) / spread, 1.0]));
    columns.push([-target[0] / distance, -target[1] / distance, 0.0]);
    reach(&columns) * spread >= distance
}

/// max t of the ray programme; t is the last column's variable.
fn reach(columns: &[[f64; 3]]) -> f64 {
    let mut at = Iterate::start(columns);
    let (mut least, mut best) = (f64::INFINITY, Vec::new());
    for _ in 0..MAX_ITERATIONS {
        let residual = Residual::of(columns, &at);
        let size = residual.size();
        if residual.gap < CONVERGED_GAP && size >= least {
            break;
        }
        if size < least {
            (least, best) = (size, memory::copied(&at.x));
        }
        let Some(factor) = Factor::new(columns, &at) else { break };
        let affine = factor.direction(columns, &at, &residual, &|i| at.x[i] * at.s[i]);
        let (primal, dual) = (step_length(&at.x, &affine.x), step_length(&at.s, &affine.s));
        let ahead: f64 =
            (0..at.x.len()).map(|i| (at.x[i] + primal * affine.x[i]) * (at.s[i] + dual * affine.s[i])).sum::<f64>()
                / at.x.len() as f64;
        let centring = (ahead / residual.gap).powi(3) * residual.gap;
        let step =
            factor.direction(columns, &at, &residual, &|i| at.x[i] * at.s[i] + affine.x[i] * affine.s[i] - centring);
        let back_off = 0.9995;
        let primal = (back_off * step_length(&at.x, &step.x)).min(1.0);
        let dual = (back_off * step_length(&at.s, &step.s)).min(1.0);
        at.advance(&step, primal, dual);
    }
    let interior = best.last().copied().unwrap_or(0.0);
    vertex(columns, &best).unwrap_or(interior)
}

/// t at the programme's optimal vertex, by pivots of the simplex method from the ray and the two heaviest points. An
/// interior iterate only approaches it, on some programmes no closer than 1e-9; the vertex is exact to rounding.
fn vertex(columns: &[[f64; 3]], x: &[f64]) -> Option<f64> {
    let ([ray_x, ray_y, _], points) = columns.split_last()?;
    let points = memory::collect(points.iter().map(|p| [p[0], p[1]]));
    let mut heaviest = memory::collect(0..points.len().min(x.len()));
    heaviest.sort_unstable_by(|&i, &j| x[j].total_cmp(&x[i]));
    let ray = [-ray_x, -ray_y];
    let mut edge = Edge { ends: [points[*heaviest.first()?], points[*heaviest.get(1)?]], ray };
    for _ in 0..points.len() {
        if !(0.0..=1.0).contains(&edge.crossing()) {
            return None;
        }
        // The mean, the origin here, lies on the inner side; the point farthest beyond enters the basis.
        let farthest = points.iter().copied().max_by(|&p, &q| edge.beyond(p).total_cmp(&edge.beyond(q)))?;
        if edge.beyond(farthest) <= 1e-13 {
            return Some(edge.reach()).filter(|t| t.is_finite());
        }
        let [start, end] = edge.ends;
        let first = Edge { ends: [start, farthest], ray };
        edge = if (0.0..=1.0).contains(&first.crossing()) { first } else { Edge { ends: [farthest, end], ray } };
    }
    None
}

/// A basis of the programme: an edge between two points and the ray from the mean that crosses it.
struct Edge {
    ends: [[f64; 2]; 2],
    ray: [f64; 2],
}

impl Edge {
    fn along(&self) -> [f64; 2] {
        let [start, end] = self.ends;
        [end[0] - start[0], end[1] - start[1]]
    }

    /// Where along the edge the ray crosses its line, 0 to 1 within it.
    fn crossing(&self) -> f64 {
        cross(self.ends[0], self.ray) / cross(self.ray, self.along())
    }

    /// The distance along the ray to the crossing.
    fn reach(&self) -> f64 {
        cross(self.ends[0], self.along()) / cross(self.ray, self.along())
    }

    /// Positive for a point on the other side of the edge's line than the mean.
    fn beyond(&self, point: [f64; 2]) -> f64 {
        let from_start = [point[0] - self.ends[0][0], point[1] - self.ends[0][1]];
        cross(self.along(), from_start) * cross(self.along(), self.ends[0]).signum()
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Primal x, dual y and slack s, or a direction of them.
struct Iterate {
    x: Vec<f64>,
    y: [f64; 3],
    s: Vec<f64>,
}

/// min −t, that is: cost −1 on the last column, 0 on the others.
fn cost(i: usize, n: usize) -> f64 {
    if i + 1 == n { -1.0 } else { 0.0 }
}

impl Iterate {
    /// Uniform weights and t = 0 satisfy the equations; a small positive t keeps the iterate interior.
    fn start(columns: &[[f64; 3]]) -> Self {
        let n = columns.len();
        let mut x = memory::filled(1.0 / (n - 1) as f64, n);
        x[n - 1] = 0.1;
        Iterate { x, y: [0.0, 0.0, -2.0], s: memory::filled(1.0, n) }
    }

    fn advance(&mut self, step: &Iterate, primal: f64, dual: f64) {
        for i in 0..self.x.len() {
            self.x[i] += primal * step.x[i];
            self.s[i] += dual * step.s[i];
        }
        for k in 0..3 {
            self.y[k] += dual * step.y[k];
        }
    }
}

struct Residual {
    /// b − A x
    primal: [f64; 3],
    /// c − Aᵀy − s
    dual: Vec<f64>,
    /// Mean of x s.
    gap: f64,
}

impl Residual {
    fn of(columns: &[[f64; 3]], at: &Iterate) -> Self {
        let n = columns.len();
        let mut primal = [0.0, 0.0, 1.0];
        for (column, x) in columns.iter().zip(&at.x) {
            for k in 0..3 {
                primal[k] -= column[k] * x;
            }
        }
        let dual = memory::collect((0..n).map(|i| cost(i, n) - dot(columns[i], at.y) - at.s[i]));
        let gap = at.x.iter().zip(&at.s).map(|(x, s)| x * s).sum::<f64>() / n as f64;
        Residual { primal, dual, gap }
    }

    fn size(&self) -> f64 {
        let largest = |m: f64, x: &f64| m.max(x.abs());
        let n = self.dual.len() as f64;
        self.primal.iter().fold(self.dual.iter().fold(self.gap * n, largest), largest)
    }
}

/// The factored normal equations A X S⁻¹ Aᵀ.
struct Factor(Ldlt<f64>);

impl Factor {
    fn new(columns: &[[f64; 3]], at: &Iterate) -> Option<Self> {
        let mut normal = Mat::<f64>::zeros(3, 3);
        for (i, column) in columns.iter().enumerate() {
            let weight = at.x[i] / at.s[i];
            for r in 0..3 {
                for c in 0..3 {
                    normal[(r, c)] += weight * column[r] * column[c];
                }
            }
        }
        // Collinear contacts leave a direction that no column spans.
        let trace: f64 = (0..3).map(|k| normal[(k, k)]).sum();
        for k in 0..3 {
            normal[(k, k)] += 1e-16 * trace;
        }
        Some(Factor(normal.ldlt(Side::Lower).ok()?))
    }

    /// The Newton direction for complementarity residuals x_i s_i → x_i s_i − `excess(i)`.
    fn direction(
        &self,
        columns: &[[f64; 3]],
        at: &Iterate,
        residual: &Residual,
        excess: &dyn Fn(usize) -> f64,
    ) -> Iterate {
        let n = columns.len();
        let mut right = Col::<f64>::from_fn(3, |k| residual.primal[k]);
        for (i, column) in columns.iter().enumerate() {
            let weight = (at.x[i] * residual.dual[i] + excess(i)) / at.s[i];
            for k in 0..3 {
                right[k] += column[k] * weight;
            }
        }
        let y = self.0.solve(&right);
        let y = [y[0], y[1], y[2]];
        let s = memory::collect((0..n).map(|i| residual.dual[i] - dot(columns[i], y)));
        let x = memory::collect((0..n).map(|i| (-excess(i) - at.x[i] * s[i]) / at.s[i]));
        Iterate { x, y, s }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The longest step, at most 1, that keeps every entry positive.
fn step_length(value: &[f64], step: &[f64]) -> f64 {
    value.iter().zip(step).filter(|(_, d)| **d < 0.0).fold(1.0, |least: f64, (v, d)| least.min(-v / d))
}

#[cfg(test)]
mod tests {
    use super::is_convex_combination;

    #[test]
    fn a_square_holds_what_lies_in_it() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!(is_convex_combination(&square, [0.5, 0.5]));
        assert!(is_convex_combination(&square, [1.0 - 1e-9, 0.3]));
        assert!(!is_convex_combination(&square, [1.0 + 1e-9, 0.3]));
        assert!(!is_convex_combination(&square, [3.0, -4.0]));
        assert!(!is_convex_combination(&[], [0.0, 0.0]));
        assert!(is_convex_combination(&[[1.0, 2.0]; 3], [1.0, 2.0]));
        assert!(!is_convex_combination(&[[1.0, 2.0]; 3], [1.0, 2.1]));
        let line: Vec<_> = (0..20).map(|i| [i as f64 * 0.01, i as f64 * 0.02]).collect();
        assert!(is_convex_combination(&line, [0.05, 0.10]));
        assert!(!is_convex_combination(&line, [0.05, 0.11]));
        assert!(!is_convex_combination(&line, [0.2, 0.4]));
    }
}
