//! Newton's method for the exponent λ that puts the loaded mean of the samples on the centre of mass.

use super::loads::{Exponent, Load, Supports, Weigh};
use crate::number::vector::Vec3;
use crate::number::{Data, Kernel, Real};
use crate::posed::PosedBody;
use crate::pressure::PressureCurve;
use crate::sampling::Walk;

/// The solved problem.
pub(super) struct Solution<R: Real> {
    pub(super) supports: Supports<R>,
    /// The load of the pressure alone, at λ = 0.
    pub(super) still: Load<R>,
    pub(super) lambda: [R::Wide; 2],
    /// Σ w_i x_i − m, nearly.
    pub(super) mean: [R::Wide; 2],
    pub(super) cost: R::Wide,
}

/// The load, F, its gradient and its Hessian (xx, xy, yy) at one λ, and the loaded mean of the arms.
#[derive(Clone, Copy)]
struct Objective<W> {
    value: W,
    gradient: [W; 2],
    hessian: [W; 3],
    mean: [W; 2],
}

/// Newton steps and halvings together. Balanced bodies need 5 or 6; a centre of mass metres outside needs about 40.
const MAX_STEPS: usize = 100;

/// Residual in metres from which one more full Newton step reaches the rounding error: the step squares the residual
/// relative to the length over which the loads change, a few centimetres.
#[inline(always)]
fn tolerance<R: Real>() -> R::Wide {
    R::Wide::of(0.03 * R::Data::EPSILON.sqrt())
}

/// F at λ, up to the constant log Σρ, from sums about an anchor.
#[inline(always)]
fn objective<R: Real>(
    curve: &PressureCurve,
    sigma: f64,
    supports: &Supports<R>,
    walk: &Walk,
    lambda: [R::Wide; 2],
    anchor: [R; 2],
    idle: R,
) -> (Objective<R::Wide>, Load<R>) {
    let exponent = Exponent::new(curve, lambda, anchor);
    let (load, sums) = R::dispatch::<Weigh, _>((supports, walk, curve, exponent, idle));
    let inverse = R::Wide::of(1.0) / load.total;
    let [x, y] = [sums[0] * inverse, sums[1] * inverse];
    let [xx, xy, yy] = [sums[2] * inverse, sums[3] * inverse, sums[4] * inverse];
    let anchor = [anchor[0].widen(), anchor[1].widen()];
    let mean = [anchor[0] + x, anchor[1] + y];
    let blur = R::Wide::of(sigma * sigma);
    let half = R::Wide::of(0.5) * blur * (lambda[0] * lambda[0] + lambda[1] * lambda[1]);
    let shift = load.top.widen() * R::Wide::of(std::f64::consts::LN_2);
    let objective = Objective {
        value: load.total.ln() + shift + (lambda[0] * anchor[0] + lambda[1] * anchor[1]) + half,
        gradient: [mean[0] + blur * lambda[0], mean[1] + blur * lambda[1]],
        hessian: [xx - x * x + blur, xy - x * y, yy - y * y + blur],
        mean,
    };
    (objective, load)
}

/// Newton with backtracking, each lane with its own step length, and one full step at the end, which also gives a dual
/// number's derivative of λ. Arms are taken from the mean of the previous step, because exponents are most accurate
/// where arms are short.
pub(super) struct Solve;

impl<R: Real> Kernel<(&PressureCurve, f64, &PosedBody<'_, R>, Vec3<R::Wide>)> for Solve {
    type Output = Solution<R>;

    #[inline(always)]
    fn run((curve, sigma, posed, centre): (&PressureCurve, f64, &PosedBody<R>, Vec3<R::Wide>)) -> Solution<R> {
        let supports = Supports::new(posed, centre);
        let walk = &posed.template.samples.walk;
        let one = R::Wide::of(1.0);
        let epsilon = (8.0 * R::Data::EPSILON).max(1e-13);
        let mut lambda = [R::Wide::zero(); 2];
        let (mut here, still) = objective(curve, sigma, &supports, walk, lambda, [R::zero(); 2], R::zero());
        let start = here.value;
        let mut length = one;
        for _ in 0..MAX_STEPS {
            let excess = here.residual() - tolerance::<R>();
            // A NaN lane never converges and must not keep the others iterating.
            if (-excess).negative() == 0 {
                break;
            }
            let step = here.newton_step();
            let trial = [lambda[0] + length * step[0], lambda[1] + length * step[1]];
            let anchor = [R::narrow(here.mean[0]), R::narrow(here.mean[1])];
            let idle = R::narrow((-excess).if_negative(R::Wide::zero(), -one));
            let (there, _) = objective(curve, sigma, &supports, walk, trial, anchor, idle);
            // The slack accepts steps whose gain is below the rounding error.
            let slack = R::Wide::of(epsilon) * (one + here.value.abs());
            let gain = there.value - here.value - R::Wide::of(1e-4) * length * here.along(step) - slack;
            // A converged lane no longer changes while the others iterate.
            let refused = excess.if_negative(one, gain);
            lambda = [refused.if_negative(trial[0], lambda[0]), refused.if_negative(trial[1], lambda[1])];
            here = here.replaced_where_negative(refused, there);
            length = refused.if_negative(one, R::Wide::of(0.5) * length);
        }
        let step = here.newton_step();
        // So close to the minimum F is its quadratic model.
        let divergence = start - here.value - R::Wide::of(0.5) * here.along(step);
        let lambda = [lambda[0] + step[0], lambda[1] + step[1]];
        // J is a divergence: a negative value is only rounding.
        Solution { supports, still, lambda, mean: here.mean, cost: divergence.at_least(R::Wide::zero()) }
    }
}

impl<W: Real> Objective<W> {
    /// −H⁻¹ g
    #[inline(always)]
    fn newton_step(&self) -> [W; 2] {
        let ([gx, gy], [xx, xy, yy]) = (self.gradient, self.hessian);
        let determinant = xx * yy - xy * xy;
        [(xy * gy - yy * gx) / determinant, (xy * gx - xx * gy) / determinant]
    }

    /// F's slope along a step.
    #[inline(always)]
    fn along(&self, step: [W; 2]) -> W {
        self.gradient[0] * step[0] + self.gradient[1] * step[1]
    }

    /// How far Σ w_i x_i − m + σ²λ is from zero, metres.
    #[inline(always)]
    fn residual(&self) -> W {
        self.gradient[0].abs().at_least(self.gradient[1].abs())
    }

    #[inline(always)]
    fn replaced_where_negative(self, test: W, other: Self) -> Self {
        let (g, other_g) = (self.gradient, other.gradient);
        let (h, other_h) = (self.hessian, other.hessian);
        let (m, other_m) = (self.mean, other.mean);
        Objective {
            value: test.if_negative(other.value, self.value),
            gradient: [test.if_negative(other_g[0], g[0]), test.if_negative(other_g[1], g[1])],
            hessian: [
                test.if_negative(other_h[0], h[0]),
                test.if_negative(other_h[1], h[1]),
                test.if_negative(other_h[2], h[2]),
            ],
            mean: [test.if_negative(other_m[0], m[0]), test.if_negative(other_m[1], m[1])],
        }
    }
}
