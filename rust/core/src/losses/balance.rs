//! The balance cost, a stability term of our own beside the paper's: how implausible a redistribution of load over the
//! existing supports balance would need.
//!
//! J(m) = min_w KL(w‖p) subject to Σ w_i x_i = m, with p the pressure distribution, x_i the samples on the ground and m
//! the centre of mass there. Its dual, with supports blurred by σ so that J stays finite outside their hull, is
//! J = max_λ λ·m − log Σ p_i e^(λ·x_i) − ½σ²|λ|², in nats. Newton's method minimises F(λ) = log Σ p_i e^(λ·(x_i − m)) +
//! ½σ²|λ|², whose minimum is −J, and the envelope theorem gives the gradient at the solution:
//! ∂J/∂m = λ, ∂J/∂x_i = −w_i λ, ∂J/∂h_i = −(w_i − p_i) d log ρ_i/dh, with w_i ∝ p_i e^(λ·x_i).

//!
//! Most samples bear nothing: chunks of them that cannot reach the heaviest one's load, but for rounding, are passed over.

use crate::error::{Result, unknown_choice};
use crate::mass::{Centre, Method};
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, narrow, scale, sub, widen};
use crate::number::{Data, Real, Room, SUMS};
use crate::options::positive;
use crate::pressure::PressureCurve;
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Chunk, Row, Walk, fold};
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
    supports: Supports<R>,
    /// Of the pressure alone, at λ = 0.
    still: Load<R>,
    lambda: [R::Wide; 2],
    /// Σ w_i x_i − m, nearly.
    mean: [R::Wide; 2],
    cost: R::Wide,
}

/// What the samples' numbers are interpolated from, and where each chunk of samples reaches.
struct Supports<R> {
    /// Of the vertices.
    heights: Vec<R>,
    /// From a fixed point (the centre of mass, first) to the vertices, in the plane's coordinates.
    arms: [Vec<R>; 2],
    reaches: Vec<Reach<R>>,
}

/// Bounds of a chunk's samples.
struct Reach<R> {
    /// Lowest height, 0 below the ground.
    lowest: R,
    /// Least and largest arm along both axes.
    arms: [[R; 2]; 2],
    /// Height (0 below the ground) and arms of one of them.
    first: [R; 3],
}

/// log2 of e^(λ·(x_i − c) − γ h_i) as a function of (h_i, x_i).
#[derive(Clone, Copy)]
struct Exponent<R> {
    by_height: R,
    by_arm: [R; 2],
    /// c
    anchor: [R; 2],
}

/// Σ p_i e^(λ·(x_i − c)) / 2^top over the samples, where `top` is the largest exponent.
#[derive(Clone, Copy)]
struct Load<R: Real> {
    top: R,
    total: R::Wide,
}

/// The load, F, its gradient and its Hessian (xx, xy, yy) at one λ, and the loaded mean of the arms.
#[derive(Clone, Copy)]
struct Objective<W> {
    value: W,
    gradient: [W; 2],
    hessian: [W; 3],
    mean: [W; 2],
}

/// Newton steps and halvings together. Balanced bodies need 5 or 6; a body that lies metres outside needs about 40.
const MAX_STEPS: usize = 100;

/// Residual in metres at which Newton's last full step reaches rounding, for it squares the residual over the length on
/// which the loads change, a few centimetres.
#[inline(always)]
fn tolerance<R: Real>() -> R::Wide {
    R::Wide::of(0.03 * R::Data::EPSILON.sqrt())
}

/// Exponents this far below the top add up to less than rounding, however many samples have them.
#[inline(always)]
fn negligible<R: Real>() -> R {
    R::of(R::Data::EPSILON.log2() - 16.0)
}

impl<R: Real> Supports<R> {
    #[inline(always)]
    fn new(scene: &Scene<R>, centre: Vec3<R::Wide>) -> Self {
        let (heights, arms) = (scene.heights(), R::apart::<Arms, _>((scene, centre)));
        let walk = &scene.template.samples.walk;
        let mut reaches = memory::with_capacity(walk.chunks.len());
        let mut rows = [[R::zero(); CHUNK]; 3];
        for chunk in &walk.chunks {
            walk.interpolate(chunk, &heights, &mut rows[0]);
            walk.interpolate(chunk, &arms[0], &mut rows[1]);
            walk.interpolate(chunk, &arms[1], &mut rows[2]);
            reaches.push(R::apart::<Reaches, _>((&rows, chunk.len())));
        }
        Supports { heights, arms, reaches }
    }

    /// The same supports seen from another point, `by` further in the plane: arms are exact where they are short.
    #[inline(always)]
    fn seen_from(&self, scene: &Scene<R>, centre: Vec3<R::Wide>, by: [R::Wide; 2]) -> Self {
        let arms = R::apart::<Arms, _>((scene, add(centre, scene.plane.raise(by))));
        let by = [R::narrow(by[0]), R::narrow(by[1])];
        let mut reaches = memory::with_capacity(self.reaches.len());
        for &Reach { lowest, arms: [x, y], first } in &self.reaches {
            reaches.push(Reach {
                lowest,
                arms: [[x[0] - by[0], x[1] - by[0]], [y[0] - by[1], y[1] - by[1]]],
                first: [first[0], first[1] - by[0], first[2] - by[1]],
            });
        }
        Supports { heights: memory::copied(&self.heights), arms, reaches }
    }
}

/// Arms of the vertices from a point. The point's rounding is taken off, too: a shift of all arms moves λ.
struct Arms;

impl<R: Real> Room<(&Scene<'_, R>, Vec3<R::Wide>)> for Arms {
    type Output = [Vec<R>; 2];

    #[inline(always)]
    fn enter((scene, from): (&Scene<R>, Vec3<R::Wide>)) -> [Vec<R>; 2] {
        let vertices = &scene.points[..scene.template.mesh.num_vertices];
        let plane = scene.narrow_plane();
        let near = narrow::<R>(from);
        let rest = narrow::<R>(sub(from, widen(near)));
        let mut arms = [memory::filled(R::zero(), vertices.len()), memory::filled(R::zero(), vertices.len())];
        let [x, y] = &mut arms;
        for ((&vertex, x), y) in vertices.iter().zip(x).zip(y) {
            [*x, *y] = plane.flatten(sub(sub(vertex, near), rest));
        }
        arms
    }
}

/// The reach of a chunk from its rows of heights and arms.
struct Reaches;

impl<R: Real> Room<(&[Row<R>; 3], usize)> for Reaches {
    type Output = Reach<R>;

    #[inline(always)]
    fn enter(([heights, x, y], len): (&[Row<R>; 3], usize)) -> Reach<R> {
        let (lowest, _) = range(heights, len);
        let (x_least, x_most) = range(x, len);
        let (y_least, y_most) = range(y, len);
        Reach {
            lowest: lowest.at_least(R::zero()),
            arms: [[x_least, x_most], [y_least, y_most]],
            first: [heights[0].at_least(R::zero()), x[0], y[0]],
        }
    }
}

/// Least and largest of a row's first `len` numbers.
#[inline(always)]
fn range<R: Real>(row: &Row<R>, len: usize) -> (R, R) {
    let (mut least, mut most) = ([row[0]; SUMS], [row[0]; SUMS]);
    let (whole, rest) = row[..len].as_chunks::<SUMS>();
    for numbers in whole {
        for k in 0..SUMS {
            least[k] = least[k].at_most(numbers[k]);
            most[k] = most[k].at_least(numbers[k]);
        }
    }
    for (k, &number) in rest.iter().enumerate() {
        least[k] = least[k].at_most(number);
        most[k] = most[k].at_least(number);
    }
    for k in 1..SUMS {
        least[0] = least[0].at_most(least[k]);
        most[0] = most[0].at_least(most[k]);
    }
    (least[0], most[0])
}

impl<R: Real> Exponent<R> {
    #[inline(always)]
    fn new(curve: &PressureCurve, lambda: [R::Wide; 2], anchor: [R; 2]) -> Self {
        let unit = R::Wide::of(std::f64::consts::LOG2_E);
        Exponent {
            by_height: R::of(-curve.gamma * std::f64::consts::LOG2_E),
            by_arm: [R::narrow(lambda[0] * unit), R::narrow(lambda[1] * unit)],
            anchor,
        }
    }

    /// At a height that is not negative and at arms from the anchor.
    #[inline(always)]
    fn at(&self, height: R, x: R, y: R) -> R {
        height.mul_add(self.by_height, x.mul_add(self.by_arm[0], y * self.by_arm[1]))
    }

    /// No sample of the chunk has a larger one.
    #[inline(always)]
    fn bound(&self, reach: &Reach<R>) -> R {
        let mut bound = reach.lowest * self.by_height;
        for k in 0..2 {
            let least = (reach.arms[k][0] - self.anchor[k]) * self.by_arm[k];
            let most = (reach.arms[k][1] - self.anchor[k]) * self.by_arm[k];
            bound = bound + least.at_least(most);
        }
        bound
    }

    /// Some sample has this one, and it is not far from the top.
    #[inline(always)]
    fn high(&self, reaches: &[Reach<R>]) -> R {
        let mut high = R::of(-1e30);
        for Reach { first: [height, x, y], .. } in reaches {
            high = high.at_least(self.at(*height, *x - self.anchor[0], *y - self.anchor[1]));
        }
        high
    }
}

/// The factor of the density that its exponent leaves: 1 above the ground, and below it linear with slope `fall`.
#[inline(always)]
fn factor<R: Real>(fall: R, height: R) -> R {
    height.if_negative(fall.mul_add(height, R::of(1.0)), R::of(1.0))
}

/// One walk over the samples: their load at an exponent, and its first and second moments about the anchor. Lanes with
/// negative `idle` do not need it and make no chunk worth a visit.
struct Weigh;

impl<R: Real> Room<(&Supports<R>, &Walk, &PressureCurve, Exponent<R>, R)> for Weigh {
    type Output = (Load<R>, [R::Wide; 5]);

    #[inline(always)]
    fn enter(
        (supports, walk, curve, exponent, idle): (&Supports<R>, &Walk, &PressureCurve, Exponent<R>, R),
    ) -> (Load<R>, [R::Wide; 5]) {
        let mut top = exponent.high(&supports.reaches);
        let mut sums = [R::Wide::zero(); 6];
        let mut rows = [[R::zero(); CHUNK]; 4];
        for (chunk, reach) in walk.chunks.iter().zip(&supports.reaches) {
            let clearance = idle.if_negative(idle, exponent.bound(reach) - top - negligible::<R>());
            if clearance.negative() == all_lanes::<R>() {
                continue;
            }
            read(supports, walk, chunk, &mut rows);
            R::apart::<WeighChunk, _>((curve, exponent, chunk.len(), clearance, &mut rows, &mut top, &mut sums));
        }
        let [total, x, y, xx, xy, yy] = sums;
        (Load { top, total }, [x, y, xx, xy, yy])
    }
}

/// All lanes' bits of [`Real::negative`].
#[inline(always)]
fn all_lanes<R: Real>() -> u32 {
    R::of(-1.0).negative()
}

/// Heights and arms of a chunk's samples.
#[inline(always)]
fn read<R: Real>(supports: &Supports<R>, walk: &Walk, chunk: &Chunk, rows: &mut [Row<R>; 4]) {
    walk.interpolate(chunk, &supports.heights, &mut rows[0]);
    walk.interpolate(chunk, &supports.arms[0], &mut rows[1]);
    walk.interpolate(chunk, &supports.arms[1], &mut rows[2]);
}

/// Adds a chunk, in the lanes where its clearance is not negative, to the sums. The sums are over 2^top: they are scaled
/// down where the top rises.
struct WeighChunk;

type ChunkToWeigh<'a, R> =
    (&'a PressureCurve, Exponent<R>, usize, R, &'a mut [Row<R>; 4], &'a mut R, &'a mut [<R as Real>::Wide; 6]);

impl<R: Real> Room<ChunkToWeigh<'_, R>> for WeighChunk {
    type Output = ();

    #[inline(always)]
    fn enter((curve, exponent, len, clearance, rows, top, sums): ChunkToWeigh<'_, R>) {
        let [heights, x, y, exponents] = rows;
        for (((height, x), y), own) in heights.iter().zip(&mut *x).zip(&mut *y).zip(&mut *exponents) {
            *x = *x - exponent.anchor[0];
            *y = *y - exponent.anchor[1];
            *own = exponent.at(height.at_least(R::zero()), *x, *y);
        }
        let raised = top.at_least(range(exponents, len).1);
        let rise = *top - raised;
        if rise.negative() != 0 {
            let shrink = rise.exp2().widen();
            for sum in sums.iter_mut() {
                *sum = *sum * shrink;
            }
        }
        *top = raised;
        let fall = R::of(-curve.alpha);
        for (height, own) in heights.iter_mut().zip(exponents.iter()) {
            *height = factor(fall, *height) * (*own - raised).exp2();
        }
        for weight in &mut heights[len..] {
            *weight = R::zero();
        }
        for (sum, moment) in sums.iter_mut().zip(moments(heights, x, y, exponents)) {
            clearance.if_negative(R::zero(), moment).add_to(sum);
        }
    }
}

/// Σ of w, wx, wy, wxx, wxy, wyy over rows whose weights behind the chunk's end are 0. In three passes, so that the
/// running sums stay in registers; `loads` is for wx.
#[inline(always)]
fn moments<R: Real>(weights: &Row<R>, x: &Row<R>, y: &Row<R>, loads: &mut Row<R>) -> [R; 6] {
    let zero = [R::zero(); SUMS];
    let (weights, x, y) = (weights.as_chunks::<SUMS>().0, x.as_chunks::<SUMS>().0, y.as_chunks::<SUMS>().0);
    let loads = loads.as_chunks_mut::<SUMS>().0;
    let (mut total, mut by_x) = (zero, zero);
    for ((weights, x), loads) in weights.iter().zip(x).zip(&mut *loads) {
        for k in 0..SUMS {
            loads[k] = weights[k] * x[k];
            total[k] = total[k] + weights[k];
            by_x[k] = by_x[k] + loads[k];
        }
    }
    let (mut by_xx, mut by_xy) = (zero, zero);
    for ((loads, x), y) in loads.iter().zip(x).zip(y) {
        for k in 0..SUMS {
            by_xx[k] = loads[k].mul_add(x[k], by_xx[k]);
            by_xy[k] = loads[k].mul_add(y[k], by_xy[k]);
        }
    }
    let (mut by_y, mut by_yy) = (zero, zero);
    for (weights, y) in weights.iter().zip(y) {
        for k in 0..SUMS {
            let load = weights[k] * y[k];
            by_y[k] = by_y[k] + load;
            by_yy[k] = load.mul_add(y[k], by_yy[k]);
        }
    }
    [fold(total), fold(by_x), fold(by_y), fold(by_xx), fold(by_xy), fold(by_yy)]
}

impl BalanceCost {
    /// F at λ, up to the constant log Σρ, from sums about an anchor.
    #[inline(always)]
    fn objective<R: Real>(
        &self,
        supports: &Supports<R>,
        walk: &Walk,
        lambda: [R::Wide; 2],
        anchor: [R; 2],
        idle: R,
    ) -> (Objective<R::Wide>, Load<R>) {
        let exponent = Exponent::new(&self.curve, lambda, anchor);
        let (load, sums) = R::apart::<Weigh, _>((supports, walk, &self.curve, exponent, idle));
        let inverse = R::Wide::of(1.0) / load.total;
        let [x, y] = [sums[0] * inverse, sums[1] * inverse];
        let [xx, xy, yy] = [sums[2] * inverse, sums[3] * inverse, sums[4] * inverse];
        let anchor = [anchor[0].widen(), anchor[1].widen()];
        let mean = [anchor[0] + x, anchor[1] + y];
        let blur = R::Wide::of(self.sigma * self.sigma);
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
}

/// Newton with backtracking, each lane at its own pace, and one full step at the end, which also carries a dual number's
/// derivative of λ. Arms are taken from the mean of the last step, for exponents are exact where they are short.
struct Solve;

impl<R: Real> Room<(&BalanceCost, &Scene<'_, R>, Centre<R>)> for Solve {
    type Output = Balance<R>;

    #[inline(always)]
    fn enter((cost, scene, centre): (&BalanceCost, &Scene<R>, Centre<R>)) -> Balance<R> {
        let supports = Supports::new(scene, centre.point);
        let walk = &scene.template.samples.walk;
        let one = R::Wide::of(1.0);
        let epsilon = (8.0 * R::Data::EPSILON).max(1e-13);
        let mut lambda = [R::Wide::zero(); 2];
        let (mut here, still) = cost.objective(&supports, walk, lambda, [R::zero(); 2], R::zero());
        let start = here.value;
        let mut length = one;
        for _ in 0..MAX_STEPS {
            let excess = here.residual() - tolerance::<R>();
            // A lane without a number never leaves and must not keep the others waiting.
            if (-excess).negative() == 0 {
                break;
            }
            let step = here.newton_step();
            let trial = [lambda[0] + length * step[0], lambda[1] + length * step[1]];
            let anchor = [R::narrow(here.mean[0]), R::narrow(here.mean[1])];
            let idle = R::narrow((-excess).if_negative(R::Wide::zero(), -one));
            let (there, _) = cost.objective(&supports, walk, trial, anchor, idle);
            // The slack admits steps whose gain drowns in rounding.
            let slack = R::Wide::of(epsilon) * (one + here.value.abs());
            let gain = there.value - here.value - R::Wide::of(1e-4) * length * here.along(step) - slack;
            // A lane that has arrived stays, however long the others take.
            let refused = excess.if_negative(one, gain);
            lambda = [refused.if_negative(trial[0], lambda[0]), refused.if_negative(trial[1], lambda[1])];
            here = here.replaced_where_negative(refused, there);
            length = refused.if_negative(one, R::Wide::of(0.5) * length);
        }
        let step = here.newton_step();
        // So close to the minimum F is its quadratic model.
        let divergence = start - here.value - R::Wide::of(0.5) * here.along(step);
        let lambda = [lambda[0] + step[0], lambda[1] + step[1]];
        // J is a divergence: below zero there is only rounding.
        Balance { centre, supports, still, lambda, mean: here.mean, cost: divergence.at_least(R::Wide::zero()) }
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

impl BalanceCost {
    /// The forward about a centre of mass that is known already.
    pub fn forward_about<R: Real>(&self, scene: &Scene<R>, centre: Centre<R>, out: &mut [R]) -> Balance<R> {
        let balance = R::apart::<Solve, _>((self, scene, centre));
        out[0] = R::narrow(self.wrap.value_and_slope(balance.cost).0);
        balance
    }
}

impl Quantity for BalanceCost {
    type Saved<R: Real> = Balance<R>;

    fn len(&self, _: &Template) -> usize {
        1
    }

    fn check(&self, _: &Template) -> Result<()> {
        self.curve.check()?;
        positive("sigma", self.sigma)
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Balance<R> {
        self.forward_about(scene, self.method.forward(scene), out)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Balance<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        R::apart::<Backward, _>((self, scene, saved, d_out[0], d_points));
    }
}

/// The backward of the cost. Its supports are seen from the loaded mean, so that the weights are exact.
struct Backward;

impl<R: Real> Room<(&BalanceCost, &Scene<'_, R>, &Balance<R>, R, &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn enter((of, scene, saved, d_out, d_points): (&BalanceCost, &Scene<R>, &Balance<R>, R, &mut [Vec3<R>])) {
        let Balance { centre, supports, still, lambda, mean, cost } = saved;
        let d_cost = d_out.widen() * of.wrap.value_and_slope(*cost).1;
        let pull = scene.plane.raise([d_cost * lambda[0], d_cost * lambda[1]]);
        of.method.backward(scene, centre, pull, d_points);

        let walk = &scene.template.samples.walk;
        let (curve, here) = (&of.curve, [R::zero(); 2]);
        let supports = supports.seen_from(scene, centre.point, *mean);
        let exponent = Exponent::new(curve, *lambda, here);
        let (load, _) = R::apart::<Weigh, _>((&supports, walk, curve, exponent, R::zero()));
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
            R::apart::<Shares, _>((curve, &spread, &still, clearances, &mut rows));
            walk.scatter(chunk, &rows[0], &mut d_arms);
            walk.scatter(chunk, &rows[1], &mut d_heights);
        }
        let (pull, d_cost) = (narrow::<R>(pull), R::narrow(d_cost));
        let up = scale(-d_cost, scene.narrow_ground().normal);
        for ((d_point, &weight), &d_height) in d_points.iter_mut().zip(&d_arms).zip(&d_heights) {
            add_scaled(d_point, -weight, pull);
            add_scaled(d_point, d_height, up);
        }
    }
}

/// Either side of the comparison: w, or p.
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

    /// Its share of the load over the density's factor; 0 in the lanes that the walk has passed over.
    #[inline(always)]
    fn of(&self, clearance: R, height: R, x: R, y: R) -> R {
        let share = self.share * (self.exponent.at(height, x, y) - self.top).exp2();
        clearance.if_negative(R::zero(), share)
    }
}

/// From heights and arms to w and, in the second row, (w − p) d log ρ/dh.
struct Shares;

impl<R: Real> Room<(&PressureCurve, &Side<R>, &Side<R>, [R; 2], &mut [Row<R>; 4])> for Shares {
    type Output = ();

    #[inline(always)]
    fn enter((curve, spread, still, clearances, rows): (&PressureCurve, &Side<R>, &Side<R>, [R; 2], &mut [Row<R>; 4])) {
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
