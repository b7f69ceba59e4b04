//! Bodies for the harness: closed surfaces with parts, and every quantity by name.
#![allow(dead_code)]

use ipman::Template;
use std::collections::HashMap;

pub type Vec3 = [f64; 3];

/// A unit sphere of 20 · 4^levels triangles, outward.
pub fn icosphere(levels: usize) -> (Vec<Vec3>, Vec<[i64; 3]>) {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = vec![];
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        vertices.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    // The icosahedron's faces are the triples at the shortest mutual distance, 2.
    let near = |i: usize, j: usize| (distance(vertices[i], vertices[j]) - 2.0).abs() < 1e-9;
    let mut faces = vec![];
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let outward = dot(vertices[i], cross(vertices[j], vertices[k])) > 0.0;
                    faces.push(if outward { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middle = HashMap::new();
        let mut split = |i: usize, j: usize, vertices: &mut Vec<Vec3>| {
            *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                vertices.push(std::array::from_fn(|k| (vertices[i][k] + vertices[j][k]) / 2.0));
                vertices.len() - 1
            })
        };
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (split(a, b, &mut vertices), split(b, c, &mut vertices), split(c, a, &mut vertices));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    for vertex in &mut vertices {
        let length = dot(*vertex, *vertex).sqrt();
        vertex.iter_mut().for_each(|x| *x /= length);
    }
    (vertices, faces.into_iter().map(|face| face.map(|index| index as i64)).collect())
}

/// A box with corners 0 and `size`.
pub fn cuboid(size: Vec3) -> (Vec<Vec3>, Vec<[i64; 3]>) {
    let vertices = (0..8).map(|i| std::array::from_fn(|k| if i >> k & 1 == 1 { size[k] } else { 0.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (vertices, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// An ellipsoid "person" 1.7 m tall with its lowest point near y = −1 cm, faces labelled by `label` of their centroid.
pub fn ellipsoid(levels: usize, label: impl Fn(Vec3) -> i64) -> (Vec<Vec3>, Vec<[i64; 3]>, Vec<i64>) {
    let (sphere, faces) = icosphere(levels);
    let vertices: Vec<Vec3> = sphere.iter().map(|v| [0.2 * v[0], 0.85 * v[1] + 0.84, 0.15 * v[2]]).collect();
    let centroid = |face: &[i64; 3]| -> Vec3 {
        std::array::from_fn(|k| face.iter().map(|&i| sphere[i as usize][k]).sum::<f64>() / 3.0)
    };
    let labels = faces.iter().map(|face| label(centroid(face))).collect();
    (vertices, faces, labels)
}

/// Four parts that meet in three-part junctions.
pub fn quarters(c: Vec3) -> i64 {
    match (c[1] > 0.1, c[0] > 0.0) {
        (true, _) if c[1] > 0.6 => 3,
        (true, left) => left as i64,
        (false, _) => 2,
    }
}

pub fn template(levels: usize, num_samples: usize) -> (Template, Vec<Vec3>) {
    let (vertices, faces, parts) = ellipsoid(levels, quarters);
    (Template::new(&vertices, &faces, &parts, num_samples, 7).unwrap(), vertices)
}

pub fn flat(vertices: &[Vec3]) -> Vec<f64> {
    vertices.as_flattened().to_vec()
}

pub fn distance(a: Vec3, b: Vec3) -> f64 {
    dot([a[0] - b[0], a[1] - b[1], a[2] - b[2]], [a[0] - b[0], a[1] - b[1], a[2] - b[2]]).sqrt()
}

pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Every quantity with every option, and its constants.
pub fn quantities() -> Vec<(String, Vec<f64>)> {
    let (pressure, ground) = (vec![100.0, 10.0, 0.0], vec![1.0, 0.15, 10.0, 0.15]);
    let balance = vec![100.0, 50.0, 0.02];
    let mut all = vec![
        ("part_volumes".to_string(), vec![]),
        ("mass_properties".to_string(), vec![985.0]),
        ("mass_properties".to_string(), vec![900.0, 1000.0, 1100.0, 1200.0]),
        ("sample_surface".to_string(), vec![]),
        ("pressure".to_string(), vec![100.0, 10.0]),
        ("center_of_pressure".to_string(), pressure.clone()),
        ("center_of_pressure".to_string(), vec![100.0, 10.0, 1e-6]),
    ];
    for method in ["pcom", "vertex_mean", "sample_mean", "face_area", "exact"] {
        all.push((format!("center_of_mass.{method}"), vec![]));
        all.push((format!("stability_loss.{method}"), pressure.clone()));
        all.push((format!("balance_cost.log.{method}"), balance.clone()));
        for rule in ["paper", "released"] {
            all.push((format!("support_margin.{rule}.{method}"), vec![0.1]));
        }
    }
    for wrap in ["saturate", "none"] {
        all.push((format!("balance_cost.{wrap}.pcom"), balance.clone()));
    }
    for points in ["samples", "vertices"] {
        for tanh in ["tanh_squared", "tanh_of_square"] {
            all.push((format!("ground_loss.{points}.{tanh}"), ground.clone()));
            let with = |first: &[f64]| [first, &ground].concat();
            all.push((format!("terms.stability.pcom.ground.{points}.{tanh}"), with(&pressure)));
            all.push((format!("terms.balance.log.pcom.ground.{points}.{tanh}"), with(&balance)));
        }
    }
    all
}
