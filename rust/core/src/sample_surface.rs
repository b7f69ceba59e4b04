//! The quantity of the samples' positions.

use crate::error::Result;
use crate::number::vector::{Vec3, widen};
use crate::number::{Kernel, Real};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::sampling::Samples;
use crate::template::Template;

/// The samples' positions in the world, metres: W V.
///
/// ```
/// use ipman::Batch;
/// use ipman::sample_surface::SampleSurface;
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let samples = batch.value(&SampleSurface)?;
/// assert_eq!(samples.len(), 3 * 2_000);
/// assert!(samples.iter().all(|x| (-1e-12..=1.0 + 1e-12).contains(x)));
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct SampleSurface;

impl Quantity for SampleSurface {
    type Saved<R: Real> = ();

    fn num_outputs(&self, template: &Template) -> usize {
        3 * template.samples.len()
    }

    fn check(&self, _: &Template) -> Result<()> {
        Ok(())
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) {
        R::dispatch::<SurfaceForward, _>((posed, out));
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        R::dispatch::<SurfaceBackward, _>((&posed.template.samples, d_out, d_points));
    }
}

struct SurfaceForward;

impl<R: Real> Kernel<(&PosedBody<'_, R>, &mut [R])> for SurfaceForward {
    type Output = ();

    #[inline(always)]
    fn run((posed, out): (&PosedBody<'_, R>, &mut [R])) {
        for (sample, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            posed.write_world(widen(posed.template.samples.point(sample, posed.points)), out);
        }
    }
}

struct SurfaceBackward;

impl<R: Real> Kernel<(&Samples, &[R], &mut [Vec3<R>])> for SurfaceBackward {
    type Output = ();

    #[inline(always)]
    fn run((samples, d_out, d_points): (&Samples, &[R], &mut [Vec3<R>])) {
        for (sample, &d_point) in d_out.as_chunks::<3>().0.iter().enumerate() {
            samples.point_backward(sample, d_point, d_points);
        }
    }
}
