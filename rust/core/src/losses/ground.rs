//! L_ground = pull + push (Eq. 5): pull = mean of α1 tanh(h/α2)² over the points at or above the ground (Eq. 6), push =
//! mean of β1 tanh(h/β2)² over those below it (Eq. 7). Both means run over all points.

use super::term::{ByHeights, Description, Named, Shared, Term};
use crate::error::{Result, unknown_choice};
use crate::number::{Kernel, Real, SUMS};
use crate::options::{not_negative, positive};
use crate::points::{PointChunk, Points};
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

/// L_ground (Eq. 5) as (pull, push).
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

/// Running sums of both curves over the points.
pub struct GroundSums<R: Real> {
    sides: Sides<R>,
    pull: R::Wide,
    push: R::Wide,
    /// Slopes at the current chunk of points.
    slopes: Row<R>,
}

impl<R: Real> Sides<R> {
    /// `d_out` is the upstream gradient of pull and of push.
    fn new(of: &GroundLoss, template: &Template, d_out: &[R]) -> Self {
        let share = 1.0 / of.points.count(template) as f64;
        let shares = [d_out[0] * R::of(of.alpha1 * share), d_out[1] * R::of(of.beta1 * share)];
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

impl Named for GroundLoss {
    const DESCRIPTION: &'static Description = &Description {
        name: "ground",
        numbers: &["pull", "push"],
        along_normal: true,
        modes: &["points", "curve"],
        options: &["alpha1", "alpha2", "beta1", "beta2"],
    };

    fn named(modes: &[&str], options: &[f64]) -> Result<Self> {
        let (&[points, tanh], &[alpha1, alpha2, beta1, beta2]) = (modes, options) else {
            unreachable!("as many as described")
        };
        Ok(GroundLoss { points: Points::named(points)?, tanh: Tanh::named(tanh)?, alpha1, alpha2, beta1, beta2 })
    }
}

impl Term for GroundLoss {
    type Sums<R: Real> = GroundSums<R>;
    type Saved<R: Real> = ();

    fn description(&self) -> &'static Description {
        Self::DESCRIPTION
    }

    fn check(&self, _: &Template) -> Result<()> {
        not_negative("alpha1", self.alpha1)?;
        positive("alpha2", self.alpha2)?;
        not_negative("beta1", self.beta1)?;
        positive("beta2", self.beta2)
    }

    fn reads_samples(&self) -> bool {
        self.points == Points::Samples
    }

    fn begin<R: Real>(&self, shared: &Shared<R>, d_out: &[R], d_heights: &mut ByHeights<R>) -> GroundSums<R> {
        let sides = Sides::new(self, shared.template(), d_out);
        let (pull, push, slopes) = (R::Wide::zero(), R::Wide::zero(), [R::zero(); CHUNK]);
        let mut sums = GroundSums { sides, pull, push, slopes };
        if self.points == Points::Vertices {
            let mut row = [R::zero(); CHUNK];
            for chunk in self.points.chunks(shared.template()) {
                chunk.gather(&shared.heights, &mut row);
                self.add(&mut sums, &chunk, &row, d_heights);
            }
        }
        sums
    }

    fn add<R: Real>(
        &self,
        sums: &mut GroundSums<R>,
        chunk: &PointChunk,
        heights: &Row<R>,
        d_heights: &mut ByHeights<R>,
    ) {
        let GroundSums { sides, pull, push, slopes } = sums;
        R::dispatch::<AddChunk, _>((sides, heights, chunk.len(), slopes, [pull, push]));
        match d_heights {
            ByHeights::Unasked => {}
            ByHeights::Sum(d_heights) => chunk.scatter_add(slopes, d_heights),
            ByHeights::Each([pull, push]) => {
                let mut below = [R::zero(); CHUNK];
                R::dispatch::<SplitBelow, _>((heights, slopes, &mut below));
                chunk.scatter_add(slopes, pull);
                chunk.scatter_add(&below, push);
            }
            ByHeights::Each(_) => unreachable!("two numbers"),
        }
    }

    fn finish<R: Real>(&self, shared: &Shared<R>, sums: GroundSums<R>, out: &mut [R]) {
        let share = 1.0 / self.points.count(shared.template()) as f64;
        out[0] = R::narrow(sums.pull * R::Wide::of(self.alpha1 * share));
        out[1] = R::narrow(sums.push * R::Wide::of(self.beta1 * share));
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
