//! The load that the samples bear at an exponent λ, and its moments.
//!
//! Most samples bear no load. Chunks whose load is below the rounding error of the heaviest sample's are skipped.

use crate::memory;
use crate::number::vector::{Vec3, add, narrow, sub, widen};
use crate::number::{Data, Kernel, Real, SUMS};
use crate::posed::PosedBody;
use crate::pressure::PressureCurve;
use crate::sampling::{CHUNK, Chunk, Row, Walk, fold};

/// Heights and arms of the vertices, from which the samples' are interpolated, and bounds for each chunk of samples.
pub(super) struct Supports<R> {
    /// Of the vertices.
    pub(super) heights: Vec<R>,
    /// From a fixed point (at first the centre of mass) to the vertices, in the plane's coordinates.
    pub(super) arms: [Vec<R>; 2],
    pub(super) reaches: Vec<Reach<R>>,
}

/// Bounds of a chunk's samples.
pub(super) struct Reach<R> {
    /// Lowest height, 0 below the ground.
    lowest: R,
    /// Least and largest arm along both axes.
    arms: [[R; 2]; 2],
    /// Height (0 below the ground) and arms of one of them.
    first: [R; 3],
}

/// log2 of e^(λ·(x_i − c) − γ h_i) as a function of (h_i, x_i).
#[derive(Clone, Copy)]
pub(super) struct Exponent<R> {
    by_height: R,
    by_arm: [R; 2],
    /// c
    anchor: [R; 2],
}

/// Σ p_i e^(λ·(x_i − c)) / 2^top over the samples, where `top` is the largest exponent.
#[derive(Clone, Copy)]
pub(super) struct Load<R: Real> {
    pub(super) top: R,
    pub(super) total: R::Wide,
}

/// Exponents this far below the top add up to less than the rounding error, however many samples have them.
#[inline(always)]
pub(super) fn negligible<R: Real>() -> R {
    R::of(R::Data::EPSILON.log2() - 16.0)
}

impl<R: Real> Supports<R> {
    #[inline(always)]
    pub(super) fn new(posed: &PosedBody<R>, centre: Vec3<R::Wide>) -> Self {
        let (heights, arms) = (posed.heights(), R::dispatch::<Arms, _>((posed, centre)));
        let walk = &posed.template.samples.walk;
        let mut reaches = memory::with_capacity(walk.chunks.len());
        let mut rows = [[R::zero(); CHUNK]; 3];
        for chunk in &walk.chunks {
            walk.interpolate(chunk, &heights, &mut rows[0]);
            walk.interpolate(chunk, &arms[0], &mut rows[1]);
            walk.interpolate(chunk, &arms[1], &mut rows[2]);
            reaches.push(R::dispatch::<Reaches, _>((&rows, chunk.len())));
        }
        Supports { heights, arms, reaches }
    }

    /// The same supports with arms from another point, displaced by `by` in the plane: short arms are more accurate.
    #[inline(always)]
    pub(super) fn seen_from(&self, posed: &PosedBody<R>, centre: Vec3<R::Wide>, by: [R::Wide; 2]) -> Self {
        let arms = R::dispatch::<Arms, _>((posed, add(centre, posed.plane.raise(by))));
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

/// Arms of the vertices from a point. The point's rounding error is subtracted, too, because a common shift of all arms
/// changes λ.
pub(super) struct Arms;

impl<R: Real> Kernel<(&PosedBody<'_, R>, Vec3<R::Wide>)> for Arms {
    type Output = [Vec<R>; 2];

    #[inline(always)]
    fn run((posed, from): (&PosedBody<R>, Vec3<R::Wide>)) -> [Vec<R>; 2] {
        let vertices = &posed.points[..posed.template.mesh.num_vertices];
        let plane = posed.narrow_plane();
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

/// The bounds of a chunk from its rows of heights and arms.
pub(super) struct Reaches;

impl<R: Real> Kernel<(&[Row<R>; 3], usize)> for Reaches {
    type Output = Reach<R>;

    #[inline(always)]
    fn run(([heights, x, y], len): (&[Row<R>; 3], usize)) -> Reach<R> {
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
pub(super) fn range<R: Real>(row: &Row<R>, len: usize) -> (R, R) {
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
    pub(super) fn new(curve: &PressureCurve, lambda: [R::Wide; 2], anchor: [R; 2]) -> Self {
        let unit = R::Wide::of(std::f64::consts::LOG2_E);
        Exponent {
            by_height: R::of(-curve.gamma * std::f64::consts::LOG2_E),
            by_arm: [R::narrow(lambda[0] * unit), R::narrow(lambda[1] * unit)],
            anchor,
        }
    }

    /// At a height that is not negative and at arms from the anchor.
    #[inline(always)]
    pub(super) fn at(&self, height: R, x: R, y: R) -> R {
        height.mul_add(self.by_height, x.mul_add(self.by_arm[0], y * self.by_arm[1]))
    }

    /// Upper bound of the exponents of a chunk's samples.
    #[inline(always)]
    pub(super) fn bound(&self, reach: &Reach<R>) -> R {
        let mut bound = reach.lowest * self.by_height;
        for k in 0..2 {
            let least = (reach.arms[k][0] - self.anchor[k]) * self.by_arm[k];
            let most = (reach.arms[k][1] - self.anchor[k]) * self.by_arm[k];
            bound = bound + least.at_least(most);
        }
        bound
    }

    /// The exponent of some sample, close to the largest.
    #[inline(always)]
    pub(super) fn high(&self, reaches: &[Reach<R>]) -> R {
        let mut high = R::of(-1e30);
        for Reach { first: [height, x, y], .. } in reaches {
            high = high.at_least(self.at(*height, *x - self.anchor[0], *y - self.anchor[1]));
        }
        high
    }
}

/// The density divided by its exponential: 1 above the ground, linear with slope `fall` below it.
#[inline(always)]
pub(super) fn factor<R: Real>(fall: R, height: R) -> R {
    height.if_negative(fall.mul_add(height, R::of(1.0)), R::of(1.0))
}

/// One pass over the samples: their load at an exponent, and its first and second moments about the anchor. Lanes with
/// negative `idle` need no result; a chunk is skipped if only they would need it.
pub(super) struct Weigh;

impl<R: Real> Kernel<(&Supports<R>, &Walk, &PressureCurve, Exponent<R>, R)> for Weigh {
    type Output = (Load<R>, [R::Wide; 5]);

    #[inline(always)]
    fn run(
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
            R::dispatch::<WeighChunk, _>((curve, exponent, chunk.len(), clearance, &mut rows, &mut top, &mut sums));
        }
        let [total, x, y, xx, xy, yy] = sums;
        (Load { top, total }, [x, y, xx, xy, yy])
    }
}

/// All lanes' bits of [`Real::negative`].
#[inline(always)]
pub(super) fn all_lanes<R: Real>() -> u32 {
    R::of(-1.0).negative()
}

/// Heights and arms of a chunk's samples.
#[inline(always)]
pub(super) fn read<R: Real>(supports: &Supports<R>, walk: &Walk, chunk: &Chunk, rows: &mut [Row<R>; 4]) {
    walk.interpolate(chunk, &supports.heights, &mut rows[0]);
    walk.interpolate(chunk, &supports.arms[0], &mut rows[1]);
    walk.interpolate(chunk, &supports.arms[1], &mut rows[2]);
}

/// Adds a chunk to the sums, in the lanes where its clearance is not negative. The sums are divided by 2^top, and
/// rescaled when the top rises.
pub(super) struct WeighChunk;

pub(super) type ChunkToWeigh<'a, R> =
    (&'a PressureCurve, Exponent<R>, usize, R, &'a mut [Row<R>; 4], &'a mut R, &'a mut [<R as Real>::Wide; 6]);

impl<R: Real> Kernel<ChunkToWeigh<'_, R>> for WeighChunk {
    type Output = ();

    #[inline(always)]
    fn run((curve, exponent, len, clearance, rows, top, sums): ChunkToWeigh<'_, R>) {
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

/// Σ of w, wx, wy, wxx, wxy, wyy over rows whose weights beyond the chunk's end are 0. In three passes, so that the
/// running sums stay in registers; `loads` is scratch space for wx.
#[inline(always)]
pub(super) fn moments<R: Real>(weights: &Row<R>, x: &Row<R>, y: &Row<R>, loads: &mut Row<R>) -> [R; 6] {
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
