//! L_ground = pull + push (Eq. 5): pull = mean of α1 tanh(h/α2)² over the points at or above the ground (Eq. 6), push =
//! mean of β1 tanh(h/β2)² over those below it (Eq. 7). Both means run over all points.

use crate::error::{Result, unknown_choice};
use crate::memory;
use crate::number::vector::Vec3;
use crate::number::{Kernel, Real, SUMS};
use crate::options::{not_negative, positive};
use crate::points::{PointChunk, Points};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Row, fold};
use crate::template::Template;

/// The two readings of "tanh x squared".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tanh {
    /// (tanh x)², the paper's.
    Squared,
    /// tanh(x²)
    OfSquare,
}

impl Tanh {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "tanh_squared" => Ok(Tanh::Squared),
            "tanh_of_square" => Ok(Tanh::OfSquare),
            _ => Err(unknown_choice("curve", "\"tanh_squared\", \"tanh_of_square\"", name)),
        }
    }

    /// The curve and its derivative by x, for x ≥ 0.
    #[inline(always)]
    fn value_and_slope<R: Real>(self, x: R) -> (R, R) {
        match self {
            Tanh::Squared => {
                let t = x.tanh_of_positive();
                let squared = t * t;
                (squared, R::of(2.0) * t.neg_mul_add(squared, t))
            }
            Tanh::OfSquare => {
                // Beyond x = 10 the curve is 1 in double precision; the bound keeps x² finite.
                let x = x.at_most(R::of(10.0));
                let t = (x * x).tanh_of_positive();
                (t, R::of(2.0) * x * t.neg_mul_add(t, R::of(1.0)))
            }
        }
    }
}

/// (pull, push) as a quantity.
///
/// ```
/// use ipman::Batch;
/// use ipman::losses::ground::{GroundLoss, Tanh};
/// use ipman::points::Points;
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let (alpha1, alpha2, beta1, beta2) = (1.0, 0.15, 10.0, 0.15);
/// let loss = GroundLoss { points: Points::Vertices, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 };
/// let [pull, push] = batch.value(&loss)?[..] else { unreachable!() };
/// // Four of the eight vertices lie on the ground, four 1 m above it.
/// assert!((pull - f64::tanh(1.0 / 0.15).powi(2) / 2.0).abs() < 1e-9 && push == 0.0);
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct GroundLoss {
    pub points: Points,
    pub tanh: Tanh,
    pub alpha1: f64,
    /// m
    pub alpha2: f64,
    pub beta1: f64,
    /// m
    pub beta2: f64,
}

/// The constants above and below the ground.
struct Sides<R> {
    tanh: Tanh,
    /// 1/α2 and −1/β2, so that x = −h/β2 below the ground is positive, too.
    widths: [R; 2],
    /// Upstream gradient of each side divided by the number of points, times its width.
    shares: [R; 2],
}

/// Running sums of both curves over the points and, if requested, their gradients by the vertices' heights.
pub struct GroundSums<'a, R: Real> {
    of: &'a GroundLoss,
    sides: Sides<R>,
    pull: R::Wide,
    push: R::Wide,
    gradient: Gradient<'a, R>,
    /// Slopes at the current chunk of points.
    slopes: Row<R>,
}

/// What the gradient by the vertices' heights is added to.
enum Gradient<'a, R> {
    Unasked,
    /// One gradient, of both terms together.
    Of(&'a mut [R]),
    /// Separate gradients of pull and of push.
    OfEach([&'a mut [R]; 2]),
}

impl GroundLoss {
    pub fn sums<R: Real>(&self) -> GroundSums<'_, R> {
        self.sums_and(Gradient::Unasked, [R::zero(); 2])
    }

    /// Sums with the gradient of d_out · (pull, push).
    pub fn sums_and_gradient<'a, R: Real>(
        &'a self,
        template: &Template,
        d_out: &[R],
        d_heights: &'a mut [R],
    ) -> GroundSums<'a, R> {
        self.sums_and(Gradient::Of(d_heights), self.shares(template, d_out))
    }

    /// Sums with the separate gradients of pull and of push.
    pub fn sums_and_jacobian<'a, R: Real>(
        &'a self,
        template: &Template,
        d_heights: [&'a mut [R]; 2],
    ) -> GroundSums<'a, R> {
        self.sums_and(Gradient::OfEach(d_heights), self.shares(template, &[R::of(1.0); 2]))
    }

    fn sums_and<'a, R: Real>(&'a self, gradient: Gradient<'a, R>, shares: [R; 2]) -> GroundSums<'a, R> {
        let (sides, slopes) = (Sides::new(self, shares), [R::zero(); CHUNK]);
        GroundSums { of: self, sides, pull: R::Wide::zero(), push: R::Wide::zero(), gradient, slopes }
    }

    /// Upstream gradient of each side divided by the number of points.
    fn shares<R: Real>(&self, template: &Template, d_out: &[R]) -> [R; 2] {
        let share = 1.0 / self.points.count(template) as f64;
        [d_out[0] * R::of(self.alpha1 * share), d_out[1] * R::of(self.beta1 * share)]
    }
}

impl<R: Real> Sides<R> {
    fn new(of: &GroundLoss, shares: [R; 2]) -> Self {
        let widths = [R::of(1.0 / of.alpha2), R::of(-1.0 / of.beta2)];
        Sides { tanh: of.tanh, widths, shares: [widths[0] * shares[0], widths[1] * shares[1]] }
    }

    /// The curve's value, and its slope by the height times the share of its side.
    #[inline(always)]
    fn value_and_slope(&self, height: R) -> (R, R) {
        let x = height * height.if_negative(self.widths[1], self.widths[0]);
        let (value, slope) = self.tanh.value_and_slope(x);
        (value, slope * height.if_negative(self.shares[1], self.shares[0]))
    }
}

impl<R: Real> GroundSums<'_, R> {
    /// Adds a chunk of points.
    pub fn add(&mut self, chunk: &PointChunk, heights: &Row<R>) {
        let sums = [&mut self.pull, &mut self.push];
        R::dispatch::<AddChunk, _>((&self.sides, heights, chunk.len(), &mut self.slopes, sums));
        match &mut self.gradient {
            Gradient::Unasked => {}
            Gradient::Of(d_heights) => chunk.scatter_add(&self.slopes, d_heights),
            Gradient::OfEach([pull, push]) => {
                let mut below = [R::zero(); CHUNK];
                R::dispatch::<SplitBelow, _>((heights, &mut self.slopes, &mut below));
                chunk.scatter_add(&self.slopes, pull);
                chunk.scatter_add(&below, push);
            }
        }
    }

    /// Adds all points.
    pub fn add_all(&mut self, template: &Template, heights: &[R]) {
        let mut row = [R::zero(); CHUNK];
        for chunk in self.of.points.chunks(template) {
            chunk.gather(heights, &mut row);
            self.add(&chunk, &row);
        }
    }

    pub fn finish(&self, template: &Template, out: &mut [R]) {
        let share = 1.0 / self.of.points.count(template) as f64;
        out[0] = R::narrow(self.pull * R::Wide::of(self.of.alpha1 * share));
        out[1] = R::narrow(self.push * R::Wide::of(self.of.beta1 * share));
    }
}

/// Both curves over a row of heights, added to their sums, and their slopes.
struct AddChunk;

type ChunkToAdd<'a, R> = (&'a Sides<R>, &'a Row<R>, usize, &'a mut Row<R>, [&'a mut <R as Real>::Wide; 2]);

impl<R: Real> Kernel<ChunkToAdd<'_, R>> for AddChunk {
    type Output = ();

    #[inline(always)]
    fn run((sides, heights, len, slopes, [pull, push]): ChunkToAdd<'_, R>) {
        // Pull as positive and push as negative numbers, so that one row holds both.
        let mut values = [R::zero(); CHUNK];
        for ((&height, signed), slope) in heights.iter().zip(&mut values).zip(slopes) {
            let (value, scaled) = sides.value_and_slope(height);
            *signed = height.if_negative(-value, value);
            *slope = scaled;
        }
        let (mut above, mut below) = ([R::zero(); SUMS], [R::zero(); SUMS]);
        let (whole, rest) = values[..len].as_chunks::<SUMS>();
        for numbers in whole {
            for k in 0..SUMS {
                above[k] = above[k] + numbers[k].at_least(R::zero());
                below[k] = below[k] + numbers[k].at_most(R::zero());
            }
        }
        for (k, &number) in rest.iter().enumerate() {
            above[k] = above[k] + number.at_least(R::zero());
            below[k] = below[k] + number.at_most(R::zero());
        }
        fold(above).add_to(pull);
        (-fold(below)).add_to(push);
    }
}

/// Moves the slopes of the points below the ground to a row of their own.
struct SplitBelow;

impl<R: Real> Kernel<(&Row<R>, &mut Row<R>, &mut Row<R>)> for SplitBelow {
    type Output = ();

    #[inline(always)]
    fn run((heights, above, below): (&Row<R>, &mut Row<R>, &mut Row<R>)) {
        for ((&height, above), below) in heights.iter().zip(above).zip(below) {
            *below = height.if_negative(*above, R::zero());
            *above = height.if_negative(R::zero(), *above);
        }
    }
}

impl Quantity for GroundLoss {
    /// The vertices' heights.
    type Saved<R: Real> = Vec<R>;

    fn num_outputs(&self, _: &Template) -> usize {
        2
    }

    fn check(&self, _: &Template) -> Result<()> {
        not_negative("alpha1", self.alpha1)?;
        positive("alpha2", self.alpha2)?;
        not_negative("beta1", self.beta1)?;
        positive("beta2", self.beta2)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Vec<R> {
        let heights = posed.heights();
        let mut sums = self.sums();
        sums.add_all(posed.template, &heights);
        sums.finish(posed.template, out);
        heights
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, heights: &Vec<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let sides = Sides::new(self, self.shares(posed.template, d_out));
        let mut d_heights = memory::filled(R::zero(), heights.len());
        let mut row = [R::zero(); CHUNK];
        for chunk in self.points.chunks(posed.template) {
            chunk.gather(heights, &mut row);
            R::dispatch::<Slopes, _>((&sides, &mut row));
            chunk.scatter_add(&row, &mut d_heights);
        }
        posed.heights_backward(&d_heights, d_points);
    }
}

/// From heights to the slopes of both curves.
struct Slopes;

impl<R: Real> Kernel<(&Sides<R>, &mut Row<R>)> for Slopes {
    type Output = ();

    #[inline(always)]
    fn run((sides, row): (&Sides<R>, &mut Row<R>)) {
        for height in row {
            *height = sides.value_and_slope(*height).1;
        }
    }
}
