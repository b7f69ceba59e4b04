//! The quantity of the samples' positions.

use crate::error::Result;
use crate::number::vector::{Vec3, widen};
use crate::number::{Real, Room};
use crate::quantity::Quantity;
use crate::sampling::Samples;
use crate::scene::Scene;
use crate::template::Template;

/// The samples' positions in the world, metres: W V.
pub struct SampleSurface;

impl Quantity for SampleSurface {
    type Saved<R: Real> = ();

    fn len(&self, template: &Template) -> usize {
        3 * template.samples.len()
    }

    fn check(&self, _: &Template) -> Result<()> {
        Ok(())
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) {
        R::apart::<SurfaceForward, _>((scene, out));
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        R::apart::<SurfaceBackward, _>((&scene.template.samples, d_out, d_points));
    }
}

struct SurfaceForward;

impl<R: Real> Room<(&Scene<'_, R>, &mut [R])> for SurfaceForward {
    type Output = ();

    #[inline(always)]
    fn enter((scene, out): (&Scene<'_, R>, &mut [R])) {
        for (sample, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            scene.put(widen(scene.template.samples.point(sample, scene.points)), out);
        }
    }
}

struct SurfaceBackward;

impl<R: Real> Room<(&Samples, &[R], &mut [Vec3<R>])> for SurfaceBackward {
    type Output = ();

    #[inline(always)]
    fn enter((samples, d_out, d_points): (&Samples, &[R], &mut [Vec3<R>])) {
        for (sample, &d_point) in d_out.as_chunks::<3>().0.iter().enumerate() {
            samples.point_backward(sample, d_point, d_points);
        }
    }
}
