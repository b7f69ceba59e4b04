//! The body of the documentation's examples: a cube with edges of 1 m that stands on the ground y = 0.

use crate::template::Template;

/// The cube's template with 2,000 samples, and its 8 vertices as a flat list of coordinates.
pub fn cube() -> (Template, Vec<f64>) {
    let corner = |i: usize| [0, 1, 2].map(|axis| (i >> axis & 1) as f64);
    let vertices: Vec<_> = (0..8).map(corner).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces: Vec<_> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let template = Template::new(&vertices, &faces, &[], 2_000, 0).expect("a cube is a closed surface");
    (template, vertices.as_flattened().to_vec())
}
