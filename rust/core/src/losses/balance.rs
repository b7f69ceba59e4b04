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
use crate::number::{Real, Scalar};
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
pub struct Balance<W> {
    centre: Centre<W>,
    supports: Vec<Support<W>>,
    lambda: [W; 2],
    cost: W,
}

/// A sample as a support: x_i − m on the ground, and log ρ_i = log factor + exponent (up to a common constant).
struct Support<W> {
    arm: [W; 2],
    height: W,
    factor: W,
    exponent: W,
}

/// F, its gradient and its Hessian (xx, xy, yy) at one λ, and Σ p_i e^(λ·arm) as e^shift · total.
struct Dual<W> {
    value: W,
    gradient: [W; 2],
    hessian: [W; 3],
    shift: W,
    total: W,
}

/// Newton steps and halvings together. Balanced bodies need 5 or 6; a body that lies metres outside needs about 40.
const MAX_STEPS: usize = 100;
/// Residual in metres at which Newton's last full step reaches rounding.
const TOLERANCE: f64 = 1e-9;

impl BalanceCost {
    fn supports<R: Real>(&self, scene: &Scene<R>, centre: &Centre<R::Wide>) -> Vec<Support<R::Wide>> {
        let target = scene.plane.flatten(centre.point);
        let zero = R::Wide::zero();
        let support = |sample| {
            let point = scene.template.samples.wide_point(sample, scene.points);
            let flat = scene.plane.flatten(point);
            let height = scene.ground.signed_height(point);
            Support {
                arm: [flat[0] - target[0], flat[1] - target[1]],
                height,
                factor: height.if_negative(self.curve.density(height, zero), R::Wide::of(1.0)),
                exponent: height.if_negative(zero, R::Wide::of(-self.curve.gamma) * height),
            }
        };
        (0..scene.template.samples.len()).map(support).collect()
    }

    /// F at λ, up to the constant log Σρ.
    fn dual<W: Real>(&self, supports: &[Support<W>], lambda: [W; 2]) -> Dual<W> {
        let shift = supports.iter().fold(W::of(-1e300), |top, s| top.at_least(s.exponent_at(lambda)));
        let mut sums = [W::zero(); 6];
        for support in supports {
            let weight = support.weight(lambda, shift);
            let [x, y] = support.arm;
            let (wx, wy) = (weight * x, weight * y);
            for (sum, term) in sums.iter_mut().zip([weight, wx, wy, wx * x, wx * y, wy * y]) {
                *sum = *sum + term;
            }
        }
        let [total, x, y, xx, xy, yy] = sums;
        let (x, y) = (x / total, y / total);
        let blur = W::of(self.sigma * self.sigma);
        let half = W::of(0.5) * blur * (lambda[0] * lambda[0] + lambda[1] * lambda[1]);
        Dual {
            value: total.ln() + shift + half,
            gradient: [x + blur * lambda[0], y + blur * lambda[1]],
            hessian: [xx / total - x * x + blur, xy / total - x * y, yy / total - y * y + blur],
            shift,
            total,
        }
    }

    /// Newton with backtracking, each lane at its own pace, and one full step at the end, which also carries a dual
    /// number's derivative of λ.
    fn solve<W: Real>(&self, supports: &[Support<W>]) -> ([W; 2], W) {
        let mut lambda = [W::zero(); 2];
        let mut here = self.dual(supports, lambda);
        let start = here.value;
        let mut length = W::of(1.0);
        for _ in 0..MAX_STEPS {
            if here.has_arrived() {
                break;
            }
            let step = here.newton_step();
            let trial: [W; 2] = std::array::from_fn(|k| lambda[k] + length * step[k]);
            let there = self.dual(supports, trial);
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
        let lambda = std::array::from_fn(|k| lambda[k] + step[k]);
        (lambda, start - self.dual(supports, lambda).value)
    }

    fn solved<R: Real>(&self, scene: &Scene<R>) -> Balance<R::Wide> {
        let centre = self.method.forward(scene);
        let supports = self.supports(scene, &centre);
        let (lambda, cost) = self.solve(&supports);
        // J is a divergence: below zero there is only rounding.
        Balance { centre, supports, lambda, cost: cost.at_least(R::Wide::zero()) }
    }
}

impl<W: Real> Support<W> {
    fn exponent_at(&self, lambda: [W; 2]) -> W {
        self.exponent + lambda[0] * self.arm[0] + lambda[1] * self.arm[1]
    }

    fn weight(&self, lambda: [W; 2], shift: W) -> W {
        self.factor * (self.exponent_at(lambda) - shift).exp()
    }
}

impl<W: Real> Dual<W> {
    /// −H⁻¹ g
    fn newton_step(&self) -> [W; 2] {
        let ([gx, gy], [xx, xy, yy]) = (self.gradient, self.hessian);
        let determinant = xx * yy - xy * xy;
        [(xy * gy - yy * gx) / determinant, (xy * gx - xx * gy) / determinant]
    }

    /// Negative in a lane whose residual is small enough.
    fn excess_residual(&self) -> W {
        self.gradient[0].abs().at_least(self.gradient[1].abs()) - W::of(TOLERANCE)
    }

    fn has_arrived(&self) -> bool {
        let excess = self.excess_residual();
        (0..W::LANES).all(|lane| excess.lane(lane).value() < 0.0)
    }

    fn replaced_where_negative(self, test: W, other: Self) -> Self {
        let pick = |a: W, b: W| test.if_negative(b, a);
        Dual {
            value: pick(self.value, other.value),
            gradient: std::array::from_fn(|k| pick(self.gradient[k], other.gradient[k])),
            hessian: std::array::from_fn(|k| pick(self.hessian[k], other.hessian[k])),
            shift: pick(self.shift, other.shift),
            total: pick(self.total, other.total),
        }
    }
}

impl Quantity for BalanceCost {
    type Saved<R: Real> = Balance<R::Wide>;

    fn len(&self, _: &Template) -> usize {
        1
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Balance<R::Wide> {
        let balance = self.solved(scene);
        out[0] = R::narrow(self.wrap.value_and_slope(balance.cost).0);
        balance
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Balance<R::Wide>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let Balance { centre, supports, lambda, cost } = saved;
        let d_cost = d_out[0].widen() * self.wrap.value_and_slope(*cost).1;
        let pull = scene.plane.raise(lambda.map(|l| d_cost * l));
        self.method.backward(scene, centre, pull, d_points);

        let zero = [R::Wide::zero(); 2];
        let (spread, still) = (self.dual(supports, *lambda), self.dual(supports, zero));
        for (sample, support) in supports.iter().enumerate() {
            let weight = support.weight(*lambda, spread.shift) / spread.total;
            let pressure = support.weight(zero, still.shift) / still.total;
            let log_slope = self.curve.slope(support.height, support.factor) / support.factor;
            let mut d_point = scale(-weight, pull);
            add_scaled(&mut d_point, -d_cost * (weight - pressure) * log_slope, scene.ground.normal);
            scene.template.samples.point_backward(sample, narrow::<R>(d_point), d_points);
        }
    }
}
