//! The checked topology: the only way in for vertices and faces.
//!
//! A mesh that passes is an oriented surface, possibly with open edges, whose faces are labelled with parts 0 … P−1.

use crate::error::{Error, Result};
use std::collections::HashMap;

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
        let faces = check_indices(num_vertices, faces)?;
        let (face_parts, num_parts) = check_parts(faces.len(), face_parts)?;
        check_duplicates(&faces)?;
        let neighbours = find_neighbours(&faces)?;
        let watertight = neighbours.iter().flatten().all(Option::is_some);
        Ok(Mesh { num_vertices, faces, face_parts, num_parts, watertight, neighbours })
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
    Ok(faces.iter().map(|corners| corners.map(|index| index as u32)).collect())
}

fn check_parts(num_faces: usize, face_parts: &[i64]) -> Result<(Vec<u32>, usize)> {
    if face_parts.is_empty() {
        return Ok((vec![0; num_faces], 1));
    }
    if face_parts.len() != num_faces {
        return Err(Error::PartCount { expected: num_faces, got: face_parts.len() });
    }
    for (face, &part) in face_parts.iter().enumerate() {
        if part < 0 || part as u64 >= num_faces as u64 {
            return Err(Error::PartIndex { face, part, limit: num_faces });
        }
    }
    let labels: Vec<u32> = face_parts.iter().map(|&part| part as u32).collect();
    let num_parts = 1 + *labels.iter().max().expect("there is a face") as usize;
    let mut seen = vec![false; num_parts];
    labels.iter().for_each(|&part| seen[part as usize] = true);
    match seen.iter().position(|&has_faces| !has_faces) {
        Some(part) => Err(Error::EmptyPart { part }),
        None => Ok((labels, num_parts)),
    }
}

fn check_duplicates(faces: &[[u32; 3]]) -> Result<()> {
    let mut seen = HashMap::with_capacity(faces.len());
    for (second, face) in faces.iter().enumerate() {
        let mut key = *face;
        key.sort_unstable();
        if let Some(first) = seen.insert(key, second) {
            return Err(Error::DuplicateFace { first, second });
        }
    }
    Ok(())
}

fn find_neighbours(faces: &[[u32; 3]]) -> Result<Vec<[Option<u32>; 3]>> {
    let mut sides: HashMap<(u32, u32), Vec<(usize, bool)>> = HashMap::with_capacity(faces.len() * 3 / 2);
    for (face, corners) in faces.iter().enumerate() {
        for (a, b) in Mesh::edges(*corners) {
            sides.entry((a.min(b), a.max(b))).or_default().push((face, a < b));
        }
    }
    let mut neighbours = Vec::with_capacity(faces.len());
    for (face, corners) in faces.iter().enumerate() {
        let mut row = [None; 3];
        for (k, (a, b)) in Mesh::edges(*corners).into_iter().enumerate() {
            let (low, high) = (a.min(b), a.max(b));
            match sides[&(low, high)].as_slice() {
                [_] => {}
                [first, second] if first.1 == second.1 => {
                    let (a, b) = (a as usize, b as usize);
                    return Err(Error::MixedWinding { first: first.0, second: second.0, a, b });
                }
                [first, second] => row[k] = Some(if first.0 == face { second.0 } else { first.0 } as u32),
                more => {
                    return Err(Error::NonManifoldEdge { a: low as usize, b: high as usize, count: more.len() });
                }
            }
        }
        neighbours.push(row);
    }
    Ok(neighbours)
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
