//! The balance cost, an alternative to the paper's stability term: how implausible the redistribution of load over the
//! existing supports is that balance would require.
//!
//! J(m) = min_w KL(w‖p) subject to Σ w_i x_i = m, with p the pressure distribution, x_i the samples on the ground and m
//! the centre of mass there. Its dual, with supports blurred by σ so that J stays finite outside their hull, is
//! J = max_λ λ·m − log Σ p_i e^(λ·x_i) − ½σ²|λ|², in nats. Newton's method minimises F(λ) = log Σ p_i e^(λ·(x_i − m)) +
//! ½σ²|λ|², whose minimum is −J, and the envelope theorem gives the gradient at the solution:
//! ∂J/∂m = λ, ∂J/∂x_i = −w_i λ, ∂J/∂h_i = −(w_i − p_i) d log ρ_i/dh, with w_i ∝ p_i e^(λ·x_i).

mod loads;
mod newton;

use super::term::{ByHeights, Description, Gradient, Named, Shared, Term};
use crate::error::{Result, unknown_choice};
use crate::mass::{Centre, Method};
use crate::memory;
use crate::number::vector::{Vec3, add_scaled, narrow, scale};
use crate::number::{Kernel, Real};
use crate::options::positive;
use crate::posed::PosedBody;
use crate::pressure::PressureCurve;
use crate::sampling::{CHUNK, Row};
use crate::template::Template;
use loads::{Exponent, Reach, Weigh, all_lanes, factor, negligible, read};
use newton::{Solution, Solve};

/// How J is compressed, so that badly unbalanced bodies do not dominate the loss.
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

    #[inline(always)]
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

/// The balance cost.
///
/// ```
/// use ipman::Batch;
/// use ipman::losses::balance::{BalanceCost, Wrap};
/// use ipman::mass::Method;
/// use ipman::pressure::PressureCurve;
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let curve = PressureCurve { alpha: 100.0, gamma: 50.0 };
/// let cost = BalanceCost { method: Method::Exact, wrap: Wrap::None, curve, sigma: 0.02 };
/// assert!(batch.value(&cost)?[0] < 0.1, "the load hardly has to be redistributed");
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct BalanceCost {
    pub method: Method,
    pub wrap: Wrap,
    pub curve: PressureCurve,
    /// Blur of the supports, m.
    pub sigma: f64,
}

/// The solved problem.
pub struct Balance<R: Real> {
    solution: Solution<R>,
}

impl BalanceCost {
    /// The forward, given the centre of mass.
    pub fn forward_about<R: Real>(&self, posed: &PosedBody<R>, centre: &Centre<R>, out: &mut [R]) -> Balance<R> {
        let solution = R::dispatch::<Solve, _>((&self.curve, self.sigma, posed, centre.point));
        out[0] = R::narrow(self.wrap.value_and_slope(solution.cost).0);
        Balance { solution }
    }
}

impl Named for BalanceCost {
    const DESCRIPTION: &'static Description = &Description {
        name: "balance",
        numbers: &["balance"],
        along_normal: false,
        modes: &["wrap", "method"],
        options: &["alpha", "balance_gamma", "sigma"],
    };

    fn named(modes: &[&str], options: &[f64]) -> Result<Self> {
        let (&[wrap, method], &[alpha, gamma, sigma]) = (modes, options) else { unreachable!("as many as described") };
        let curve = PressureCurve { alpha, gamma };
        Ok(BalanceCost { method: Method::named(method)?, wrap: Wrap::named(wrap)?, curve, sigma })
    }
}

impl Term for BalanceCost {
    type Sums<R: Real> = ();
    type Saved<R: Real> = Balance<R>;

    fn description(&self) -> &'static Description {
        Self::DESCRIPTION
    }

    fn check(&self, _: &Template) -> Result<()> {
        self.curve.check()?;
        positive("sigma", self.sigma)
    }

    fn begin<R: Real>(&self, _: &Shared<R>, _: &[R], _: &mut ByHeights<R>) {}

    fn finish<R: Real>(&self, shared: &Shared<R>, _: (), out: &mut [R]) -> Balance<R> {
        self.forward_about(shared.posed, shared.centre(self.method), out)
    }

    fn backward<R: Real>(&self, shared: &Shared<R>, saved: &Balance<R>, d_out: &[R], gradient: &mut Gradient<R>) {
        let centre = shared.centre(self.method);
        R::dispatch::<Backward, _>((self, shared.posed, centre, saved, d_out[0], gradient.points()));
    }
}

/// The backward of the cost. Arms are taken from the loaded mean, so that the weights are accurate.
struct Backward;

type SolvedCost<'a, R> = (&'a BalanceCost, &'a PosedBody<'a, R>, &'a Centre<R>, &'a Balance<R>, R, &'a mut [Vec3<R>]);

impl<R: Real> Kernel<SolvedCost<'_, R>> for Backward {
    type Output = ();

    #[inline(always)]
    fn run((of, posed, centre, saved, d_out, d_points): SolvedCost<R>) {
        let Solution { supports, still, lambda, mean, cost } = &saved.solution;
        let d_cost = d_out.widen() * of.wrap.value_and_slope(*cost).1;
        let pull = posed.plane.raise([d_cost * lambda[0], d_cost * lambda[1]]);
        of.method.backward(posed, centre, pull, d_points);

        let walk = &posed.template.samples.walk;
        let (curve, here) = (&of.curve, [R::zero(); 2]);
        let supports = supports.seen_from(posed, centre.point, *mean);
        let exponent = Exponent::new(curve, *lambda, here);
        let (load, _) = R::dispatch::<Weigh, _>((&supports, walk, curve, exponent, R::zero()));
        let spread = Side { exponent, top: load.top, share: R::narrow(R::Wide::of(1.0) / load.total) };
        let exponent = Exponent::new(curve, [R::Wide::zero(); 2], here);
        let still = Side { exponent, top: still.top, share: R::narrow(R::Wide::of(1.0) / still.total) };

        let (mut d_arms, mut d_heights) =
            (memory::filled(R::zero(), supports.heights.len()), memory::filled(R::zero(), supports.heights.len()));
        let mut rows = [[R::zero(); CHUNK]; 4];
        for (chunk, reach) in walk.chunks.iter().zip(&supports.reaches) {
            let clearances = [spread.clearance(reach), still.clearance(reach)];
            if clearances[0].at_least(clearances[1]).negative() == all_lanes::<R>() {
                continue;
            }
            read(&supports, walk, chunk, &mut rows);
            R::dispatch::<Shares, _>((curve, &spread, &still, clearances, &mut rows));
            walk.scatter(chunk, &rows[0], &mut d_arms);
            walk.scatter(chunk, &rows[1], &mut d_heights);
        }
        let (pull, d_cost) = (narrow::<R>(pull), R::narrow(d_cost));
        let up = scale(-d_cost, posed.narrow_ground().normal);
        for ((d_point, &weight), &d_height) in d_points.iter_mut().zip(&d_arms).zip(&d_heights) {
            add_scaled(d_point, -weight, pull);
            add_scaled(d_point, d_height, up);
        }
    }
}

/// One of the two distributions: w or p.
struct Side<R> {
    exponent: Exponent<R>,
    top: R,
    /// 1 / Σ
    share: R,
}

impl<R: Real> Side<R> {
    #[inline(always)]
    fn clearance(&self, reach: &Reach<R>) -> R {
        self.exponent.bound(reach) - self.top - negligible::<R>()
    }

    /// A sample's share of the load divided by the density's linear factor; 0 in the lanes that skip this chunk.
    #[inline(always)]
    fn of(&self, clearance: R, height: R, x: R, y: R) -> R {
        let share = self.share * (self.exponent.at(height, x, y) - self.top).exp2();
        clearance.if_negative(R::zero(), share)
    }
}

/// From heights and arms to w and, in the second row, (w − p) d log ρ/dh.
struct Shares;

impl<R: Real> Kernel<(&PressureCurve, &Side<R>, &Side<R>, [R; 2], &mut [Row<R>; 4])> for Shares {
    type Output = ();

    #[inline(always)]
    fn run((curve, spread, still, clearances, rows): (&PressureCurve, &Side<R>, &Side<R>, [R; 2], &mut [Row<R>; 4])) {
        let [heights, x, y, _] = rows;
        let slopes = [R::of(-curve.alpha), R::of(-curve.gamma)];
        for ((height, x), y) in heights.iter_mut().zip(x).zip(y) {
            let above = height.at_least(R::zero());
            let weight = spread.of(clearances[0], above, *x, *y);
            let pressure = still.of(clearances[1], above, *x, *y);
            *x = (weight - pressure) * height.if_negative(slopes[0], slopes[1]);
            *height = factor(slopes[0], *height) * weight;
        }
    }
}
