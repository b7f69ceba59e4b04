//! The way in: what is no surface is refused, and what is one holds together.

use crate::body::Surface;
use crate::source::Source;
use ipman::Template;
use ipman::mesh::Mesh;

pub fn run(data: &[u8]) {
    let mut source = Source(data);
    let Surface { points, faces, parts } = Surface::spoilt(&mut source);
    let (samples, seed) = (source.below(200), source.byte().into());
    let Ok(template) = Template::new(&points, &faces, &parts, samples, seed) else { return };
    check(&template.mesh);
    let samples = &template.samples;
    assert!(samples.faces.is_sorted());
    for (sample, &face) in samples.faces.iter().enumerate() {
        assert_eq!(samples.corners[sample], template.mesh.faces[face as usize]);
        assert_eq!(samples.parts[sample], template.mesh.face_parts[face as usize]);
        let weights = samples.barycentric[sample];
        assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
    let mut order = samples.walk.order.clone();
    order.sort_unstable();
    assert!(order.iter().copied().eq(0..samples.len() as u32), "the walk visits every sample once");
}

/// Neighbours know each other, along the same edge and the other way round.
fn check(mesh: &Mesh) {
    for (face, neighbours) in mesh.neighbours.iter().enumerate() {
        for (&(a, b), other) in Mesh::edges(mesh.faces[face]).iter().zip(neighbours) {
            let Some(other) = *other else { continue };
            let back = Mesh::edges(mesh.faces[other as usize]).iter().position(|&edge| edge == (b, a));
            let back = back.expect("the neighbour has the edge, the other way round");
            assert_eq!(mesh.neighbours[other as usize][back], Some(face as u32));
        }
    }
    assert_eq!(mesh.watertight, mesh.neighbours.iter().flatten().all(Option::is_some));
}
