//! The checked topology of a mesh. All vertices and faces come in through here.
//!
//! A mesh that passes is an oriented surface, possibly with open edges, whose faces are labelled with parts 0 … P−1.

use crate::error::{Error, Result};
use crate::memory;

#[derive(Clone, Debug)]
pub struct Mesh {
    pub num_vertices: usize,
    pub faces: Vec<[u32; 3]>,
    pub face_parts: Vec<u32>,
    pub num_parts: usize,
    /// Every edge has a face on both sides.
    pub watertight: bool,
    /// The face on the other side of edge k (corner k to corner k+1) of each face.
    pub neighbours: Vec<[Option<u32>; 3]>,
}

impl Mesh {
    /// Checks indices, labels and orientation. `face_parts` empty means one part.
    pub fn new(num_vertices: usize, faces: &[[i64; 3]], face_parts: &[i64]) -> Result<Self> {
        memory::guarded(|| {
            let faces = check_indices(num_vertices, faces)?;
            let (face_parts, num_parts) = check_parts(faces.len(), face_parts)?;
            check_duplicates(&faces)?;
            let neighbours = find_neighbours(&faces)?;
            let watertight = neighbours.iter().flatten().all(Option::is_some);
            Ok(Mesh { num_vertices, faces, face_parts, num_parts, watertight, neighbours })
        })
    }

    /// The directed edges of `face`, from corner k to corner k+1.
    pub fn edges(face: [u32; 3]) -> [(u32, u32); 3] {
        [(face[0], face[1]), (face[1], face[2]), (face[2], face[0])]
    }
}

fn check_indices(num_vertices: usize, faces: &[[i64; 3]]) -> Result<Vec<[u32; 3]>> {
    if faces.is_empty() {
        return Err(Error::NoFaces);
    }
    let limit = num_vertices.min(u32::MAX as usize);
    for (face, corners) in faces.iter().enumerate() {
        for (k, &index) in corners.iter().enumerate() {
            if index < 0 || index as u64 >= limit as u64 {
                return Err(Error::VertexIndex { face, index, num_vertices });
            }
            if corners[..k].contains(&index) {
                return Err(Error::RepeatedVertex { face, vertex: index as usize });
            }
        }
    }
    Ok(memory::collect(faces.iter().map(|corners| corners.map(|index| index as u32))))
}

fn check_parts(num_faces: usize, face_parts: &[i64]) -> Result<(Vec<u32>, usize)> {
    if face_parts.is_empty() {
        return Ok((memory::filled(0, num_faces), 1));
    }
    if face_parts.len() != num_faces {
        return Err(Error::PartCount { expected: num_faces, got: face_parts.len() });
    }
    for (face, &part) in face_parts.iter().enumerate() {
        if part < 0 || part as u64 >= num_faces as u64 {
            return Err(Error::PartIndex { face, part, limit: num_faces });
        }
    }
    let labels = memory::collect(face_parts.iter().map(|&part| part as u32));
    let num_parts = 1 + *labels.iter().max().expect("there is a face") as usize;
    let mut seen = memory::filled(false, num_parts);
    labels.iter().for_each(|&part| seen[part as usize] = true);
    match seen.iter().position(|&has_faces| !has_faces) {
        Some(part) => Err(Error::EmptyPart { part }),
        None => Ok((labels, num_parts)),
    }
}

/// The first face that repeats an earlier one.
fn check_duplicates(faces: &[[u32; 3]]) -> Result<()> {
    let mut sorted = memory::collect(faces.iter().enumerate().map(|(face, corners)| {
        let mut corners = *corners;
        corners.sort_unstable();
        (corners, face as u32)
    }));
    sorted.sort_unstable();
    let alike = sorted.chunk_by(|a, b| a.0 == b.0).filter(|faces| faces.len() > 1);
    match alike.min_by_key(|faces| faces[1].1) {
        Some(faces) => Err(Error::DuplicateFace { first: faces[0].1 as usize, second: faces[1].1 as usize }),
        None => Ok(()),
    }
}

/// A side of a face: its edge's vertices, the lower first, and which edge of which face it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    edge: (u32, u32),
    face: u32,
    k: u8,
    ascending: bool,
}

/// The two sides of every edge. The error names the first face, and its first edge, with more than two sides or with
/// two that run in the same direction.
fn find_neighbours(faces: &[[u32; 3]]) -> Result<Vec<[Option<u32>; 3]>> {
    let mut sides = memory::with_capacity(3 * faces.len());
    for (face, corners) in faces.iter().enumerate() {
        for (k, (a, b)) in Mesh::edges(*corners).into_iter().enumerate() {
            sides.push(Side { edge: (a.min(b), a.max(b)), face: face as u32, k: k as u8, ascending: a < b });
        }
    }
    sides.sort_unstable();
    let mut neighbours = memory::filled([None; 3], faces.len());
    let mut worst: Option<&[Side]> = None;
    for sides in sides.chunk_by(|a, b| a.edge == b.edge) {
        match sides {
            [_] => {}
            [first, second] if first.ascending != second.ascending => {
                neighbours[first.face as usize][first.k as usize] = Some(second.face);
                neighbours[second.face as usize][second.k as usize] = Some(first.face);
            }
            _ => {
                let place = |sides: &[Side]| (sides[0].face, sides[0].k);
                worst = Some(worst.filter(|earlier| place(earlier) < place(sides)).unwrap_or(sides));
            }
        }
    }
    let Some(sides) = worst else { return Ok(neighbours) };
    let (low, high) = (sides[0].edge.0 as usize, sides[0].edge.1 as usize);
    Err(match sides {
        [first, second] => {
            let (a, b) = if first.ascending { (low, high) } else { (high, low) };
            Error::MixedWinding { first: first.face as usize, second: second.face as usize, a, b }
        }
        more => Error::NonManifoldEdge { a: low, b: high, count: more.len() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[i64; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn a_tetrahedron_is_watertight_until_a_face_is_gone() {
        assert!(Mesh::new(4, &TETRAHEDRON, &[]).unwrap().watertight);
        assert!(!Mesh::new(4, &TETRAHEDRON[..3], &[]).unwrap().watertight);
    }

    #[test]
    fn every_defect_is_named() {
        let with = |extra: [i64; 3]| {
            let mut faces = TETRAHEDRON.to_vec();
            faces.push(extra);
            Mesh::new(5, &faces, &[]).unwrap_err()
        };
        assert_eq!(Mesh::new(4, &[], &[]).unwrap_err(), Error::NoFaces);
        assert_eq!(with([0, 1, 5]), Error::VertexIndex { face: 4, index: 5, num_vertices: 5 });
        assert_eq!(with([-1, 1, 2]), Error::VertexIndex { face: 4, index: -1, num_vertices: 5 });
        assert_eq!(with([4, 1, 4]), Error::RepeatedVertex { face: 4, vertex: 4 });
        assert_eq!(with([2, 1, 0]), Error::DuplicateFace { first: 0, second: 4 });
        assert_eq!(with([0, 1, 4]), Error::NonManifoldEdge { a: 0, b: 1, count: 3 });
        let flipped = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 2, 3]];
        assert!(matches!(Mesh::new(4, &flipped, &[]), Err(Error::MixedWinding { .. })));
        assert_eq!(Mesh::new(4, &TETRAHEDRON, &[0, 0, 2, 2]).unwrap_err(), Error::EmptyPart { part: 1 });
        assert_eq!(Mesh::new(4, &TETRAHEDRON, &[0, 1]).unwrap_err(), Error::PartCount { expected: 4, got: 2 });
        assert!(matches!(Mesh::new(4, &TETRAHEDRON, &[0, -1, 0, 0]), Err(Error::PartIndex { face: 1, .. })));
    }
}
