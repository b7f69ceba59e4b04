//! Closing: every part is closed, the parts' volumes add up to the whole body's, and the rings have the volumes of the
//! tetrahedra.

use crate::body::Surface;
use crate::source::Source;
use ipman::closing::Closing;
use ipman::mesh::Mesh;
use ipman::moments::part_moments;
use ipman::signed_volume::SignedVolumes;

pub fn run(data: &[u8]) {
    let mut source = Source(data);
    let Surface { points, faces, parts } = Surface::consistent(&mut source);
    let mesh = Mesh::new(points.len(), &faces, &parts).expect("a part of a closed surface is a surface");
    let closing = Closing::new(&mesh);
    for part in &closing.parts {
        let faces = &closing.faces[part.clone()];
        let mut edges: Vec<_> = faces.iter().flat_map(|&face| Mesh::edges(face)).collect();
        let mut back: Vec<_> = edges.iter().map(|&(a, b)| (b, a)).collect();
        edges.sort_unstable();
        back.sort_unstable();
        assert_eq!(edges, back, "a closed part has every edge as often in both directions");
    }
    let mut all = points.clone();
    closing.forward(&mut all);
    assert_eq!(all.len(), closing.num_points());
    let rings = SignedVolumes::forward(&closing, &all).of_parts;
    let tetrahedra: Vec<f64> = part_moments(&closing, &all).iter().map(|part| part.volume).collect();
    for (rings, tetrahedra) in rings.iter().zip(&tetrahedra) {
        assert!((rings - tetrahedra).abs() < 1e-13, "{rings} {tetrahedra}");
    }
    let whole = Closing::new(&Mesh::new(points.len(), &faces, &[]).expect("the same surface"));
    if mesh.watertight {
        let mut points = points;
        whole.forward(&mut points);
        let whole: f64 = SignedVolumes::forward(&whole, &points).of_parts.iter().sum();
        assert!((rings.iter().sum::<f64>() - whole).abs() < 1e-13);
    }
}
