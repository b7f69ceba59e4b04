//! The volume of each closed part (absolute value).

use crate::error::Result;
use crate::memory;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::signed_volume::{SignedVolumes, absolute};
use crate::template::Template;

/// The volume of each part, m³ (the paper's vol^P).
///
/// ```
/// use ipman::Batch;
/// use ipman::volume::PartVolumes;
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let volumes = batch.value(&PartVolumes)?;
/// assert!((volumes[0] - 1.0).abs() < 1e-12);
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct PartVolumes;

impl Quantity for PartVolumes {
    /// The volumes before the absolute value, and the sign of each.
    type Saved<R: Real> = (SignedVolumes<R>, Vec<R::Wide>);

    fn num_outputs(&self, template: &Template) -> usize {
        template.mesh.num_parts
    }

    fn check(&self, _: &Template) -> Result<()> {
        Ok(())
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Self::Saved<R> {
        let signed = SignedVolumes::forward(&posed.template.closing, posed.points);
        let (volumes, signs) = absolute(&signed.of_parts);
        for (out, volume) in out.iter_mut().zip(volumes) {
            *out = R::narrow(volume);
        }
        (signed, signs)
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let (signed, signs) = saved;
        let d_volumes = memory::collect(d_out.iter().zip(signs).map(|(d, &sign)| d.widen() * sign));
        signed.backward(&posed.template.closing, &d_volumes, d_points);
    }
}
