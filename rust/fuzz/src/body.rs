//! Bodies: closed shapes, and what bytes make of them.

use crate::source::Source;
use std::f64::consts::TAU;

pub type Point = [f64; 3];

/// How many shapes there are.
pub const SHAPES: u8 = 4;

#[derive(Clone)]
pub struct Surface {
    pub points: Vec<Point>,
    pub faces: Vec<[i64; 3]>,
    pub parts: Vec<i64>,
}

impl Surface {
    /// A tetrahedron, an octahedron, a capsule or a torus.
    fn shape(kind: u8) -> Self {
        match kind {
            0 => Self::of(
                vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ),
            1 => Self::turned(4, 1, 0.5),
            2 => Self::turned(8, 7, 0.2),
            _ => Self::torus(7, 5),
        }
    }

    fn of(points: Vec<Point>, faces: Vec<[i64; 3]>) -> Self {
        let parts = vec![0; faces.len()];
        Surface { points, faces, parts }
    }

    /// Rings between two poles, 1.7 m high.
    fn turned(sides: usize, rings: usize, radius: f64) -> Self {
        let mut points = vec![[0.0, 0.0, 0.0]];
        for ring in 1..=rings {
            let polar = TAU / 2.0 * ring as f64 / (rings + 1) as f64;
            for side in 0..sides {
                let (sin, cos) = (TAU * side as f64 / sides as f64).sin_cos();
                let across = radius * polar.sin();
                points.push([across * cos, 0.85 * (1.0 - polar.cos()), across * sin]);
            }
        }
        points.push([0.0, 1.7, 0.0]);
        let top = points.len() as i64 - 1;
        let at = |ring: usize, side: usize| (1 + ring * sides + side % sides) as i64;
        let mut faces = Vec::new();
        for side in 0..sides {
            faces.push([0, at(0, side), at(0, side + 1)]);
            for ring in 0..rings - 1 {
                faces.push([at(ring, side), at(ring + 1, side), at(ring, side + 1)]);
                faces.push([at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)]);
            }
            faces.push([at(rings - 1, side), top, at(rings - 1, side + 1)]);
        }
        Self::of(points, faces)
    }

    fn torus(around: usize, across: usize) -> Self {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for i in 0..around {
            for j in 0..across {
                let (u, v) = (TAU * i as f64 / around as f64, TAU * j as f64 / across as f64);
                let radius = 0.6 + 0.2 * v.cos();
                points.push([radius * u.cos(), radius * u.sin(), 0.2 * v.sin()]);
                let at = |i: usize, j: usize| ((i % around) * across + j % across) as i64;
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        Self::of(points, faces)
    }

    /// A shape in up to four parts, with some faces taken away: a surface that is still consistent.
    pub fn consistent(source: &mut Source) -> Self {
        let mut surface = Self::shape(source.byte() % SHAPES);
        let edits = usize::from(source.byte() % 8);
        let parts = 1 + source.below(4);
        for part in &mut surface.parts {
            *part = if edits > 0 { source.below(parts) as i64 } else { 0 };
        }
        for _ in 0..edits.saturating_sub(4).min(surface.faces.len() - 1) {
            let gone = source.below(surface.faces.len());
            surface.faces.remove(gone);
            surface.parts.remove(gone);
        }
        // Parts are numbered without gaps.
        let mut labels = surface.parts.clone();
        labels.sort_unstable();
        labels.dedup();
        for part in &mut surface.parts {
            *part = labels.binary_search(part).expect("it is one of them") as i64;
        }
        surface
    }

    /// A shape of which any number may have been changed, any face doubled or cut off.
    pub fn spoilt(source: &mut Source) -> Self {
        let mut surface = Self::consistent(source);
        for _ in 0..source.byte() % 6 {
            let face = source.below(surface.faces.len());
            match source.byte() % 6 {
                0 => {
                    let point = source.below(surface.points.len());
                    surface.points[point][source.below(3)] = source.number();
                }
                1 => surface.faces[face][source.below(3)] = source.below(surface.points.len() + 2) as i64 - 1,
                2 => surface.faces[face].swap(0, 1),
                3 => surface.faces.push(surface.faces[face]),
                4 if !surface.parts.is_empty() => {
                    let at = source.below(surface.parts.len());
                    surface.parts[at] = source.below(6) as i64 - 1;
                }
                _ => surface.parts.truncate(face),
            }
        }
        surface
    }
}

/// Poses of a surface: moved, scaled, tilted, a point moved away; now and then with a number that is none.
pub fn poses(surface: &Surface, source: &mut Source, count: usize) -> Vec<f64> {
    let mut all = Vec::new();
    for _ in 0..count {
        let scale = [1.0, 1.0, 1.0, 100.0, 1e-3][usize::from(source.byte() % 5)];
        let (lean, by) = (source.unit(), [source.unit(), source.unit() * 0.2, source.unit()]);
        let start = all.len();
        for &[x, y, z] in &surface.points {
            all.extend([scale * (x + lean * y) + by[0], scale * y + by[1], scale * z + by[2]]);
        }
        for _ in 0..source.byte() % 3 {
            let at = start + source.below(all.len() - start);
            all[at] = source.number();
        }
    }
    all
}
