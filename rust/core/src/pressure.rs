//! Pressure: from the height above the ground to pressure (Eq. 2) and to the centre of pressure (Eq. 3).

use crate::error::Result;
use crate::memory;
use crate::number::vector::{Vec3, add_scaled, add_to, dot, narrow, over, scale, widen};
use crate::number::{BLOCK, Kernel, Real};
use crate::options::not_negative;
use crate::points::{PointChunk, Points};
use crate::posed::{self, PosedBody};
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Row, Walk, sum_row};
use crate::template::Template;

/// The paper's heuristic (Eq. 2): ρ = 1 − αh below the ground, e^(−γh) from the ground up. No unit.
#[derive(Clone, Copy, Debug)]
pub struct PressureCurve {
    /// 1/m
    pub alpha: f64,
    /// 1/m
    pub gamma: f64,
}

impl PressureCurve {
    pub fn check(&self) -> Result<()> {
        not_negative("alpha", self.alpha)?;
        not_negative("gamma", self.gamma)
    }

    /// ρ(h) (Eq. 2), divided by e^(−γ shift) where h ≥ 0: `shift` > 0 requires that nothing lies below the ground.
    #[inline(always)]
    pub fn density<R: Real>(&self, height: R, shift: R) -> R {
        let below = R::of(-self.alpha).mul_add(height, R::of(1.0));
        let above = (R::of(-self.gamma * std::f64::consts::LOG2_E) * (height - shift)).exp2();
        height.if_negative(below, above)
    }

    /// dρ/dh, given ρ.
    #[inline(always)]
    pub fn slope<R: Real>(&self, height: R, density: R) -> R {
        height.if_negative(R::of(-self.alpha), R::of(-self.gamma) * density)
    }
}

/// ρ of each sample.
///
/// ```
/// use ipman::Batch;
/// use ipman::pressure::{Pressure, PressureCurve};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let pressure = batch.value(&Pressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 } })?;
/// // 1 on the ground, e^(−10) at the top, 1 m above it.
/// assert!(pressure.iter().all(|p| *p <= 1.0 + 1e-9 && *p >= f64::exp(-10.0) - 1e-9));
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct Pressure {
    pub curve: PressureCurve,
}

impl Quantity for Pressure {
    type Saved<R: Real> = ();

    fn num_outputs(&self, template: &Template) -> usize {
        template.samples.len()
    }

    fn check(&self, _: &Template) -> Result<()> {
        self.curve.check()
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) {
        R::dispatch::<PressureForward, _>((self.curve, &posed.template.samples.walk, posed.heights(), out));
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        let walk = &posed.template.samples.walk;
        let d_heights = R::dispatch::<PressureBackward, _>((self.curve, walk, posed.heights(), d_out));
        posed.heights_backward(&d_heights, d_points);
    }
}

struct PressureForward;

impl<R: Real> Kernel<(PressureCurve, &Walk, Vec<R>, &mut [R])> for PressureForward {
    type Output = ();

    #[inline(always)]
    fn run((curve, walk, heights, out): (PressureCurve, &Walk, Vec<R>, &mut [R])) {
        let mut row = [R::zero(); CHUNK];
        for chunk in &walk.chunks {
            walk.interpolate(chunk, &heights, &mut row);
            for (&sample, &height) in walk.order[chunk.samples.clone()].iter().zip(&row) {
                out[sample as usize] = curve.density(height, R::zero());
            }
        }
    }
}

struct PressureBackward;

impl<R: Real> Kernel<(PressureCurve, &Walk, Vec<R>, &[R])> for PressureBackward {
    type Output = Vec<R>;

    #[inline(always)]
    fn run((curve, walk, heights, d_out): (PressureCurve, &Walk, Vec<R>, &[R])) -> Vec<R> {
        let mut d_heights = memory::filled(R::zero(), heights.len());
        let mut row = [R::zero(); CHUNK];
        for chunk in &walk.chunks {
            walk.interpolate(chunk, &heights, &mut row);
            for (&sample, height) in walk.order[chunk.samples.clone()].iter().zip(&mut row) {
                let slope = curve.slope(*height, curve.density(*height, R::zero()));
                *height = slope * d_out[sample as usize];
            }
            walk.scatter(chunk, &row, &mut d_heights);
        }
        d_heights
    }
}

/// The centre of pressure (Eq. 3) s̄ = Σ ρ_i v_i / (Σ ρ_i + epsilon) in the world, metres.
///
/// ```
/// use ipman::Batch;
/// use ipman::pressure::{CenterOfPressure, PressureCurve};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let curve = PressureCurve { alpha: 100.0, gamma: 10.0 };
/// let [x, y, z] = batch.value(&CenterOfPressure { curve, epsilon: 0.0 })?[..] else { unreachable!() };
/// assert!((x - 0.5).abs() < 0.1 && y < 0.1 && (z - 0.5).abs() < 0.1);
/// # Ok::<(), ipman::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CenterOfPressure {
    pub curve: PressureCurve,
    /// 0 in the paper, 1e-6 in the authors' released code.
    pub epsilon: f64,
}

/// Running sums over the samples.
///
/// If every vertex is above the ground, ρ is divided by e^(−γ · lowest height), which leaves the ratio unchanged and
/// keeps a hovering body's sums from underflowing. The height is the lowest vertex's, or for very large bodies the
/// lowest sample's ([`DEEP`]). With a positive epsilon this is not done, because epsilon is an absolute amount.
pub struct LoadSums<R: Real> {
    of: CenterOfPressure,
    shift: R,
    total: R::Wide,
    /// q = Wᵀρ: the load that each vertex bears, so that Σ ρ_i v_i = Σ_v q_v v.
    loads: Vec<R>,
    /// ρ of the current chunk of samples.
    density: Row<R>,
}

/// s̄ in local coordinates, with what its backward needs.
pub struct Cop<R: Real> {
    pub point: Vec3<R::Wide>,
    of: CenterOfPressure,
    shift: R,
    total: R::Wide,
    loads: Vec<R>,
}

impl<R: Real> LoadSums<R> {
    pub fn new(of: CenterOfPressure, template: &Template, heights: &[R]) -> Self {
        let shift = if of.epsilon > 0.0 { R::zero() } else { shift(of.curve, template, heights) };
        LoadSums {
            of,
            shift,
            total: R::Wide::zero(),
            loads: memory::filled(R::zero(), heights.len()),
            density: [R::zero(); CHUNK],
        }
    }

    pub fn add(&mut self, chunk: &PointChunk, heights: &Row<R>) {
        let (density, total) = (&mut self.density, &mut self.total);
        R::dispatch::<Densities, _>((self.of.curve, self.shift, heights, chunk.len(), density, total));
        chunk.scatter_add(&self.density, &mut self.loads);
    }

    /// Σ ρ_i, with the shift undone.
    pub fn total_pressure(&self) -> R::Wide {
        self.total * (R::Wide::of(-self.of.curve.gamma) * self.shift.widen()).exp()
    }

    /// s̄ from the sums. Epsilon pulls towards the world's origin, which lies at −origin here.
    pub fn finish(self, posed: &PosedBody<R>) -> Cop<R> {
        let LoadSums { of, shift, total, loads, .. } = self;
        let epsilon = R::Wide::of(of.epsilon);
        let mut moment = scale(-epsilon, posed.origin);
        R::dispatch::<Moment, _>((posed.points, loads.as_slice(), &mut moment));
        let total = total + epsilon;
        Cop { point: over(moment, total), of, shift, total, loads }
    }
}

/// Largest difference of the exponents γh within a body for which single precision keeps its digits.
const DEEP: f64 = 60.0;

/// The height of a hovering body's lowest vertex, or sample, in each lane; 0 in the others.
fn shift<R: Real>(curve: PressureCurve, template: &Template, heights: &[R]) -> R {
    let vertex = posed::lowest(heights).at_least(R::zero());
    if (-vertex).negative() == 0 {
        return vertex;
    }
    let reach = R::of(curve.gamma) * (posed::highest(heights) - vertex);
    let deep = (R::of(DEEP) - reach).if_negative(-vertex, R::zero());
    if deep.negative() == 0 {
        return vertex;
    }
    let mut sample = R::of(1e30);
    let mut row = [R::zero(); CHUNK];
    for chunk in Points::Samples.chunks(template) {
        chunk.gather(heights, &mut row);
        sample = sample.at_most(posed::lowest(&row[..chunk.len()]));
    }
    deep.if_negative(sample.at_least(R::zero()), vertex)
}

/// ρ of a row of heights, and their sum.
struct Densities;

impl<R: Real> Kernel<(PressureCurve, R, &Row<R>, usize, &mut Row<R>, &mut R::Wide)> for Densities {
    type Output = ();

    #[inline(always)]
    fn run(
        (curve, shift, heights, len, density, total): (PressureCurve, R, &Row<R>, usize, &mut Row<R>, &mut R::Wide),
    ) {
        for (density, &height) in density.iter_mut().zip(heights) {
            *density = curve.density(height, shift);
        }
        sum_row(density, len).add_to(total);
    }
}

/// Σ_v q_v v
struct Moment;

impl<R: Real> Kernel<(&[Vec3<R>], &[R], &mut Vec3<R::Wide>)> for Moment {
    type Output = ();

    #[inline(always)]
    fn run((points, loads, moment): (&[Vec3<R>], &[R], &mut Vec3<R::Wide>)) {
        for (points, loads) in points.chunks(BLOCK).zip(loads.chunks(BLOCK)) {
            let mut partial = [R::zero(); 3];
            for (&point, &load) in points.iter().zip(loads) {
                add_scaled(&mut partial, load, point);
            }
            add_to(partial, moment);
        }
    }
}

impl<R: Real> Cop<R> {
    /// ∂s̄/∂v_i = ρ_i / Σρ and ∂s̄/∂ρ_i = (v_i − s̄) / Σρ, added to `d_points`. `d_heights` may already hold a gradient
    /// by the vertices' heights; it is added, too.
    pub fn backward(
        &self,
        posed: &PosedBody<R>,
        heights: &[R],
        d_point: Vec3<R::Wide>,
        mut d_heights: Vec<R>,
        d_points: &mut [Vec3<R>],
    ) {
        let d_wide = over(d_point, self.total);
        let (d, lever) = (narrow::<R>(d_wide), R::narrow(dot(d_wide, self.point)));
        let arms = R::dispatch::<Arms, _>((&posed.points[..heights.len()], d, lever));
        let (mut row, mut arm) = ([R::zero(); CHUNK], [R::zero(); CHUNK]);
        for chunk in Points::Samples.chunks(posed.template) {
            chunk.gather(heights, &mut row);
            chunk.gather(&arms, &mut arm);
            R::dispatch::<SlopesByArms, _>((self.of.curve, self.shift, &arm, &mut row));
            chunk.scatter_add(&row, &mut d_heights);
        }
        let normal = posed.narrow_ground().normal;
        R::dispatch::<Gradient, _>((self.loads.as_slice(), d, d_heights.as_slice(), normal, d_points));
    }
}

/// d·v − lever of each vertex: the effect of a unit of load there on d·s̄.
struct Arms;

impl<R: Real> Kernel<(&[Vec3<R>], Vec3<R>, R)> for Arms {
    type Output = Vec<R>;

    #[inline(always)]
    fn run((vertices, d, lever): (&[Vec3<R>], Vec3<R>, R)) -> Vec<R> {
        let mut arms = memory::filled(R::zero(), vertices.len());
        for (arm, &vertex) in arms.iter_mut().zip(vertices) {
            *arm = dot(d, vertex) - lever;
        }
        arms
    }
}

/// From heights to dρ/dh · arm.
struct SlopesByArms;

impl<R: Real> Kernel<(PressureCurve, R, &Row<R>, &mut Row<R>)> for SlopesByArms {
    type Output = ();

    #[inline(always)]
    fn run((curve, shift, arms, row): (PressureCurve, R, &Row<R>, &mut Row<R>)) {
        for (height, &arm) in row.iter_mut().zip(arms) {
            *height = curve.slope(*height, curve.density(*height, shift)) * arm;
        }
    }
}

/// Adds each vertex's load times d, and its height's gradient times n.
struct Gradient;

impl<R: Real> Kernel<(&[R], Vec3<R>, &[R], Vec3<R>, &mut [Vec3<R>])> for Gradient {
    type Output = ();

    #[inline(always)]
    fn run((loads, d, d_heights, normal, d_points): (&[R], Vec3<R>, &[R], Vec3<R>, &mut [Vec3<R>])) {
        for ((d_point, &load), &d_height) in d_points.iter_mut().zip(loads).zip(d_heights) {
            add_scaled(d_point, load, d);
            add_scaled(d_point, d_height, normal);
        }
    }
}

impl CenterOfPressure {
    pub fn locate<R: Real>(&self, posed: &PosedBody<R>, heights: &[R]) -> Cop<R> {
        let mut sums = LoadSums::new(*self, posed.template, heights);
        let mut row = [R::zero(); CHUNK];
        for chunk in Points::Samples.chunks(posed.template) {
            chunk.gather(heights, &mut row);
            sums.add(&chunk, &row);
        }
        sums.finish(posed)
    }
}

impl Quantity for CenterOfPressure {
    /// s̄ and the vertices' heights.
    type Saved<R: Real> = (Cop<R>, Vec<R>);

    fn num_outputs(&self, _: &Template) -> usize {
        3
    }

    fn check(&self, _: &Template) -> Result<()> {
        self.curve.check()?;
        not_negative("epsilon", self.epsilon)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R> {
        let heights = posed.heights();
        let cop = self.locate(posed, &heights);
        posed.write_world(cop.point, out);
        (cop, heights)
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let (cop, heights) = saved;
        let d_heights = memory::filled(R::zero(), heights.len());
        cop.backward(posed, heights, widen([d_out[0], d_out[1], d_out[2]]), d_heights, d_points);
    }
}
