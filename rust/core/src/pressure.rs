//! Pressure: from the height above the ground to pressure to the centre of pressure.

use crate::number::Real;
use crate::number::vector::{Vec3, dot, narrow, scale, sub, widen};
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Chunk, Pass, Points};
use crate::scene::Scene;
use crate::template::Template;

/// The paper's heuristic: ρ = 1 − αh below the ground, e^(−γh) from the ground up. No unit.
#[derive(Clone, Copy, Debug)]
pub struct PressureCurve {
    /// 1/m
    pub alpha: f64,
    /// 1/m
    pub gamma: f64,
}

impl PressureCurve {
    /// ρ(h), divided by e^(−γ shift) where h ≥ 0: with `shift` > 0 nothing may lie below the ground.
    #[inline(always)]
    pub fn density<R: Real>(&self, height: R, shift: R) -> R {
        let below = R::of(1.0) - R::of(self.alpha) * height;
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
pub struct Pressure {
    pub curve: PressureCurve,
}

struct PressurePass<'a, R> {
    curve: PressureCurve,
    out: &'a mut [R],
    d_out: &'a [R],
}

impl<R: Real> Pass<R> for PressurePass<'_, R> {
    fn read(&mut self, chunk: &Chunk<R>) {
        for (i, out) in self.out[chunk.start..chunk.start + chunk.len].iter_mut().enumerate() {
            *out = self.curve.density(chunk.height[i], R::zero());
        }
    }

    fn hand_back(&self, chunk: &Chunk<R>, d_chunk: &mut Chunk<R>) {
        for (i, &d_out) in self.d_out[chunk.start..chunk.start + chunk.len].iter().enumerate() {
            let density = self.curve.density(chunk.height[i], R::zero());
            d_chunk.height[i] = self.curve.slope(chunk.height[i], density) * d_out;
        }
    }
}

impl Quantity for Pressure {
    type Saved<R: Real> = ();

    fn len(&self, template: &Template) -> usize {
        template.samples.len()
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) {
        Points::Samples.read(scene, &mut PressurePass { curve: self.curve, out, d_out: &[] });
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        Points::Samples.hand_back(scene, &PressurePass { curve: self.curve, out: &mut [], d_out }, d_points);
    }
}

/// The centre of pressure s̄ = Σ ρ_i v_i / (Σ ρ_i + epsilon) in the world, metres.
#[derive(Clone, Copy, Debug)]
pub struct CenterOfPressure {
    pub curve: PressureCurve,
    /// 0 in the paper, 1e-6 in the authors' released code.
    pub epsilon: f64,
}

/// The pass that sums ρ and ρv.
///
/// Where every point is above the ground, ρ is divided by e^(−γ · lowest height), which leaves the ratio unchanged and
/// keeps a hovering body's sums from underflowing. The lowest height is found on the way: when a lower point comes,
/// the sums so far are scaled. A positive epsilon forbids the shift, for it is an absolute amount.
pub struct CopPass<R: Real> {
    of: CenterOfPressure,
    shift: R,
    total: R::Wide,
    moment: Vec3<R::Wide>,
    /// s̄ in local coordinates, once the pass is over.
    pub point: Vec3<R::Wide>,
    /// The gradient by s̄ to hand back.
    d_point: Vec3<R::Wide>,
}

impl CenterOfPressure {
    pub fn pass<R: Real>(&self) -> CopPass<R> {
        let zero = [R::Wide::zero(); 3];
        let shift = R::of(if self.epsilon > 0.0 { 0.0 } else { 1e30 });
        CopPass { of: *self, shift, total: R::Wide::zero(), moment: zero, point: zero, d_point: zero }
    }
}

impl<R: Real> CopPass<R> {
    /// s̄ from the sums. Epsilon pulls towards the world's origin, which lies at −origin here.
    pub fn finish(&mut self, scene: &Scene<R>) {
        let epsilon = R::Wide::of(self.of.epsilon);
        self.total = self.total + epsilon;
        let moment = sub(self.moment, scale(epsilon, scene.origin));
        self.point = moment.map(|x| x / self.total);
    }

    /// The finished pass, ready to hand back the gradient by s̄.
    pub fn handing_back(&self, d_point: Vec3<R::Wide>) -> Self {
        CopPass { d_point, ..*self }
    }

    fn lower_shift(&mut self, chunk: &Chunk<R>) {
        let lowest = chunk.height[1..chunk.len].iter().fold(chunk.height[0], |low, &h| low.at_most(h));
        let shift = self.shift.at_most(lowest.at_least(R::zero()));
        let factor = (R::of(-self.of.curve.gamma) * (self.shift - shift)).exp().widen();
        self.shift = shift;
        self.total = self.total * factor;
        self.moment = scale(factor, self.moment);
    }
}

impl<R: Real> Pass<R> for CopPass<R> {
    fn read(&mut self, chunk: &Chunk<R>) {
        self.lower_shift(chunk);
        let mut density = [R::zero(); CHUNK];
        for (density, &height) in density.iter_mut().zip(&chunk.height) {
            *density = self.of.curve.density(height, self.shift);
        }
        let mut sums = [R::zero(); 4];
        for (i, &density) in density[..chunk.len].iter().enumerate() {
            sums[0] = sums[0] + density;
            for k in 0..3 {
                sums[1 + k] = sums[1 + k] + density * chunk.position[k][i];
            }
        }
        sums[0].add_to(&mut self.total);
        for k in 0..3 {
            sums[1 + k].add_to(&mut self.moment[k]);
        }
    }

    /// ∂s̄/∂v_i = ρ_i / Σρ and ∂s̄/∂ρ_i = (v_i − s̄) / Σρ.
    fn hand_back(&self, chunk: &Chunk<R>, d_chunk: &mut Chunk<R>) {
        let d_wide = self.d_point.map(|d| d / self.total);
        let lever = R::narrow(dot(d_wide, self.point));
        let d = narrow::<R>(d_wide);
        for i in 0..CHUNK {
            let height = chunk.height[i];
            let density = self.of.curve.density(height, self.shift);
            let arm = dot(d, chunk.point(i)) - lever;
            for k in 0..3 {
                d_chunk.position[k][i] = d_chunk.position[k][i] + density * d[k];
            }
            d_chunk.height[i] = d_chunk.height[i] + self.of.curve.slope(height, density) * arm;
        }
    }
}

impl Quantity for CenterOfPressure {
    type Saved<R: Real> = CopPass<R>;

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> CopPass<R> {
        let mut pass = self.pass();
        Points::Samples.read(scene, &mut pass);
        pass.finish(scene);
        scene.put(pass.point, out);
        pass
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, pass: &CopPass<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let pass = pass.handing_back(widen([d_out[0], d_out[1], d_out[2]]));
        Points::Samples.hand_back(scene, &pass, d_points);
    }
}
