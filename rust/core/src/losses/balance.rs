//! The balance cost, a stability term of our own beside the paper's: how implausible a redistribution of load over the
//! existing supports balance would need.
//!
//! J(m) = min_w KL(w‖p) subject to Σ w_i x_i = m, with p the pressure distribution, x_i the samples on the ground and m
//! the centre of mass there. Its dual, with supports blurred by σ so that J stays finite outside their hull, is
//! J = max_λ λ·m − log Σ p_i e^(λ·x_i) − ½σ²|λ|², in nats. Newton's method minimises F(λ) = log Σ p_i e^(λ·(x_i − m)) +
//! ½σ²|λ|², whose minimum is −J, and the envelope theorem gives the gradient at the solution:
//! ∂J/∂m = λ, ∂J/∂x_i = −w_i λ, ∂J/∂h_i = −(w_i − p_i) d log ρ_i/dh, with w_i ∝ p_i e^(λ·x_i).

use crate::error::Result;
use crate::mass::{Centre, Method};
use crate::number::vector::{Vec3, add_scaled, narrow, scale};
use crate::number::{Real, Room, Scalar};
use crate::pressure::PressureCurve;
use crate::quantity::{Quantity, unknown_choice};
use crate::scene::Scene;
use crate::template::Template;

/// What is made of J, so that bodies far from balance do not rule a loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrap {
    /// log(1 + J)
    Log,
    /// J / (1 + J)
    Saturate,
    /// J
    None,
}

impl Wrap {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "log" => Ok(Wrap::Log),
            "saturate" => Ok(Wrap::Saturate),
            "none" => Ok(Wrap::None),
            _ => Err(unknown_choice("wrap", "\"log\", \"saturate\", \"none\"", name)),
        }
    }

    fn value_and_slope<W: Real>(self, cost: W) -> (W, W) {
        let one = W::of(1.0);
        let inverse = one / (one + cost);
        match self {
            Wrap::Log => ((one + cost).ln(), inverse),
            Wrap::Saturate => (cost * inverse, inverse * inverse),
            Wrap::None => (cost, one),
        }
    }
}

pub struct BalanceCost {
    pub method: Method,
    pub wrap: Wrap,
    pub curve: PressureCurve,
    /// Blur of the supports, m.
    pub sigma: f64,
}

/// The solved problem.
pub struct Balance<R: Real> {
    centre: Centre<R>,
    supports: Supports<R::Wide>,
    lambda: [R::Wide; 2],
    cost: R::Wide,
}

/// The samples as supports: x_i − m on the ground, and log ρ_i = log factor + exponent (up to a common constant).
struct Supports<W> {
    arm_x: Vec<W>,
    arm_y: Vec<W>,
    height: Vec<W>,
    factor: Vec<W>,
    exponent: Vec<W>,
}

/// p_i e^(λ·(x_i − m)) of each support, all divided by e^shift so that the largest is about 1, and their sum.
struct Weights<W> {
    of: Vec<W>,
    shift: W,
    total: W,
}

/// F, its gradient and its Hessian (xx, xy, yy) at one λ.
struct Objective<W> {
    value: W,
    gradient: [W; 2],
    hessian: [W; 3],
}

/// Newton steps and halvings together. Balanced bodies need 5 or 6; a body that lies metres outside needs about 40.
const MAX_STEPS: usize = 100;
/// Residual in metres at which Newton's last full step reaches rounding.
const TOLERANCE: f64 = 1e-9;

impl<W: Real> Supports<W> {
    #[inline(always)]
    fn new<R: Real<Wide = W>>(scene: &Scene<R>, centre: &Centre<R>, curve: &PressureCurve) -> Self {
        let count = scene.template.samples.len();
        let column = || Vec::with_capacity(count);
        let mut supports =
            Supports { arm_x: column(), arm_y: column(), height: column(), factor: column(), exponent: column() };
        let [target_x, target_y] = scene.plane.flatten(centre.point);
        for sample in 0..count {
            let point = scene.template.samples.wide_point(sample, scene.points);
            let [x, y] = scene.plane.flatten(point);
            let height = scene.ground.signed_height(point);
            supports.arm_x.push(x - target_x);
            supports.arm_y.push(y - target_y);
            supports.height.push(height);
            supports.factor.push(height.if_negative(curve.density(height, W::zero()), W::of(1.0)));
            supports.exponent.push(height.if_negative(W::zero(), W::of(-curve.gamma) * height));
        }
        supports
    }

    #[inline(always)]
    fn weights(&self, lambda: [W; 2]) -> Weights<W> {
        // Loops of one kind each: only the sums and the largest must go in order, the rest is vectorised for one body too.
        let mut of = self.exponent.clone();
        for ((weight, &x), &y) in of.iter_mut().zip(&self.arm_x).zip(&self.arm_y) {
            *weight = *weight + lambda[0] * x + lambda[1] * y;
        }
        let mut shift = W::of(-1e300);
        for &exponent in &of {
            shift = shift.at_least(exponent);
        }
        for (weight, &factor) in of.iter_mut().zip(&self.factor) {
            *weight = factor * (*weight - shift).exp();
        }
        let mut total = W::zero();
        for &weight in &of {
            total = total + weight;
        }
        Weights { of, shift, total }
    }
}

impl BalanceCost {
    /// F at λ, up to the constant log Σρ.
    #[inline(always)]
    fn objective<W: Real>(&self, supports: &Supports<W>, lambda: [W; 2]) -> Objective<W> {
        let weights = supports.weights(lambda);
        let mut sums = [W::zero(); 5];
        for ((&weight, &x), &y) in weights.of.iter().zip(&supports.arm_x).zip(&supports.arm_y) {
            let (wx, wy) = (weight * x, weight * y);
            let terms = [wx, wy, wx * x, wx * y, wy * y];
            for k in 0..5 {
                sums[k] = sums[k] + terms[k];
            }
        }
        let inverse = W::of(1.0) / weights.total;
        let [x, y, xx, xy, yy] = sums;
        let [x, y, xx, xy, yy] = [x * inverse, y * inverse, xx * inverse, xy * inverse, yy * inverse];
        let blur = W::of(self.sigma * self.sigma);
        let half = W::of(0.5) * blur * (lambda[0] * lambda[0] + lambda[1] * lambda[1]);
        Objective {
            value: weights.total.ln() + weights.shift + half,
            gradient: [x + blur * lambda[0], y + blur * lambda[1]],
            hessian: [xx - x * x + blur, xy - x * y, yy - y * y + blur],
        }
    }

    /// Newton with backtracking, each lane at its own pace, and one full step at the end, which also carries a dual
    /// number's derivative of λ.
    #[inline(always)]
    fn solve<W: Real>(&self, supports: &Supports<W>) -> ([W; 2], W) {
        let mut lambda = [W::zero(); 2];
        let mut here = self.objective(supports, lambda);
        let start = here.value;
        let mut length = W::of(1.0);
        for _ in 0..MAX_STEPS {
            if here.has_arrived() {
                break;
            }
            let step = here.newton_step();
            let trial = [lambda[0] + length * step[0], lambda[1] + length * step[1]];
            let there = self.objective(supports, trial);
            let promised = here.gradient[0] * step[0] + here.gradient[1] * step[1];
            // The slack admits steps whose gain drowns in rounding.
            let slack = W::of(1e-13) * (W::of(1.0) + here.value.abs());
            let excess = there.value - here.value - W::of(1e-4) * length * promised - slack;
            // A lane that has arrived stays, however long the others take.
            let refused = here.excess_residual().if_negative(W::of(1.0), excess);
            for k in 0..2 {
                lambda[k] = refused.if_negative(trial[k], lambda[k]);
            }
            here = here.replaced_where_negative(refused, there);
            length = refused.if_negative(W::of(1.0), W::of(0.5) * length);
        }
        let step = here.newton_step();
        let lambda = [lambda[0] + step[0], lambda[1] + step[1]];
        (lambda, start - self.objective(supports, lambda).value)
    }

    fn solved<R: Real>(&self, scene: &Scene<R>) -> Balance<R> {
        R::apart::<Forward, _>((self, scene))
    }
}

/// [`BalanceCost::solved`]
struct Forward;

impl<R: Real> Room<(&BalanceCost, &Scene<'_, R>)> for Forward {
    type Output = Balance<R>;

    #[inline(always)]
    fn enter((cost, scene): (&BalanceCost, &Scene<R>)) -> Balance<R> {
        let centre = cost.method.forward(scene);
        let supports = Supports::new(scene, &centre, &cost.curve);
        let (lambda, divergence) = cost.solve(&supports);
        // J is a divergence: below zero there is only rounding.
        Balance { centre, supports, lambda, cost: divergence.at_least(R::Wide::zero()) }
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

    /// Negative in a lane whose residual is small enough.
    #[inline(always)]
    fn excess_residual(&self) -> W {
        self.gradient[0].abs().at_least(self.gradient[1].abs()) - W::of(TOLERANCE)
    }

    #[inline(always)]
    fn has_arrived(&self) -> bool {
        let excess = self.excess_residual();
        (0..W::LANES).all(|lane| excess.lane(lane).value() < 0.0)
    }

    #[inline(always)]
    fn replaced_where_negative(self, test: W, other: Self) -> Self {
        let pick = |a: W, b: W| test.if_negative(b, a);
        Objective {
            value: pick(self.value, other.value),
            gradient: [pick(self.gradient[0], other.gradient[0]), pick(self.gradient[1], other.gradient[1])],
            hessian: [
                pick(self.hessian[0], other.hessian[0]),
                pick(self.hessian[1], other.hessian[1]),
                pick(self.hessian[2], other.hessian[2]),
            ],
        }
    }
}

impl Quantity for BalanceCost {
    type Saved<R: Real> = Balance<R>;

    fn len(&self, _: &Template) -> usize {
        1
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Balance<R> {
        let balance = self.solved(scene);
        out[0] = R::narrow(self.wrap.value_and_slope(balance.cost).0);
        balance
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Balance<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        R::apart::<Backward, _>((self, scene, saved, d_out[0], d_points));
    }
}

/// The backward of the cost.
struct Backward;

impl<R: Real> Room<(&BalanceCost, &Scene<'_, R>, &Balance<R>, R, &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn enter((of, scene, saved, d_out, d_points): (&BalanceCost, &Scene<R>, &Balance<R>, R, &mut [Vec3<R>])) {
        {
            let Balance { centre, supports, lambda, cost } = saved;
            let d_cost = d_out.widen() * of.wrap.value_and_slope(*cost).1;
            let pull = scene.plane.raise([d_cost * lambda[0], d_cost * lambda[1]]);
            of.method.backward(scene, centre, pull, d_points);

            let spread = supports.weights(*lambda);
            let still = supports.weights([R::Wide::zero(); 2]);
            for sample in 0..spread.of.len() {
                let weight = spread.of[sample] / spread.total;
                let pressure = still.of[sample] / still.total;
                let factor = supports.factor[sample];
                let log_slope = of.curve.slope(supports.height[sample], factor) / factor;
                let mut d_point = scale(-weight, pull);
                add_scaled(&mut d_point, -d_cost * (weight - pressure) * log_slope, scene.ground.normal);
                scene.template.samples.point_backward(sample, narrow::<R>(d_point), d_points);
            }
        }
    }
}
