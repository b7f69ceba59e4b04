//! The template: everything about a body's surface that is computed once, for all its poses.

use crate::closing::Closing;
use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::Mesh;
use crate::number::vector::{Vec3, sub};
use crate::sampling::Samples;
use crate::signed_volume::SignedVolumes;

#[derive(Clone, Debug)]
pub struct Template {
    pub mesh: Mesh,
    pub closing: Closing,
    pub samples: Samples,
}

impl Template {
    /// `face_parts` empty means one part. Fails unless the faces are a consistently oriented surface around a volume.
    pub fn new(
        vertices: &[Vec3<f64>],
        faces: &[[i64; 3]],
        face_parts: &[i64],
        num_samples: usize,
        seed: u64,
    ) -> Result<Self> {
        let mesh = Mesh::new(vertices.len(), faces, face_parts)?;
        if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(Error::TemplateNotFinite { vertex });
        }
        memory::guarded(|| {
            let closing = Closing::new(&mesh);
            check_volume(&closing, vertices)?;
            let samples = Samples::new(&mesh, vertices, num_samples, seed)?;
            Ok(Template { mesh, closing, samples })
        })
    }
}

fn check_volume(closing: &Closing, vertices: &[Vec3<f64>]) -> Result<()> {
    let mut points = memory::with_capacity(closing.num_points());
    points.extend(vertices.iter().map(|&v| sub(v, vertices[0])));
    closing.forward(&mut points);
    let volume: f64 = SignedVolumes::forward(closing, &points).of_parts.iter().sum();
    let extent = points.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    // Rounding alone leaves about 1e-16 of the bounding cube.
    if volume.abs() <= 1e-12 * extent.powi(3) {
        return Err(Error::NoVolume { volume });
    }
    if volume < 0.0 {
        return Err(Error::InsideOut { volume });
    }
    Ok(())
}
