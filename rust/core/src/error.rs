//! What can be wrong with a call ([`Error`]) and what can be wrong with one body of a batch ([`status`]).

/// An invalid call: which argument, what was expected, what was given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    #[error("faces: expected at least one triangle, got none")]
    NoFaces,
    #[error("vertices: expected finite coordinates, vertex {vertex} of the template is not")]
    TemplateNotFinite { vertex: usize },
    #[error("faces: face {face} refers to vertex {index}, but there are {num_vertices} vertices (0 to {})", num_vertices.saturating_sub(1))]
    VertexIndex { face: usize, index: i64, num_vertices: usize },
    #[error(
        "faces: face {face} uses vertex {vertex} twice; remove degenerate faces (trimesh: mesh.update_faces(mesh.nondegenerate_faces()))"
    )]
    RepeatedVertex { face: usize, vertex: usize },
    #[error(
        "faces: face {second} repeats face {first}; remove duplicates (trimesh: mesh.update_faces(mesh.unique_faces()))"
    )]
    DuplicateFace { first: usize, second: usize },
    #[error("faces: edge ({a}, {b}) belongs to {count} faces; a surface has at most two at an edge (non-manifold)")]
    NonManifoldEdge { a: usize, b: usize, count: usize },
    #[error(
        "faces: faces {first} and {second} run along edge ({a}, {b}) in the same direction; orient them alike (trimesh.repair.fix_winding)"
    )]
    MixedWinding { first: usize, second: usize, a: usize, b: usize },
    #[error("faces: the surface is inside out (signed volume {volume:.6} m³); reverse every face (faces[:, ::-1])")]
    InsideOut { volume: f64 },
    #[error("vertices: the template encloses no volume ({volume:.6} m³): is it a closed body, or a flat sheet?")]
    NoVolume { volume: f64 },
    #[error("face_parts: expected {expected} labels, one for each face, got {got}")]
    PartCount { expected: usize, got: usize },
    #[error("face_parts: face {face} has part {part}; parts are numbered from 0 to less than {limit}")]
    PartIndex { face: usize, part: i64, limit: usize },
    #[error("face_parts: part {part} has no faces; number the parts 0, 1, … without gaps")]
    EmptyPart { part: usize },
    #[error("num_samples: expected 1 to {limit}, got {got}")]
    SampleCount { got: usize, limit: usize },
    #[error("{name}: expected {expected}, got {got}")]
    Argument { name: &'static str, expected: String, got: String },
    #[error("ground: the normal of body {body} is zero or not finite; expected a direction such as (0, 1, 0)")]
    GroundNormal { body: usize },
    #[error("quantity: unknown quantity {0:?}")]
    UnknownQuantity(String),
    #[error("interrupted")]
    Interrupted,
    #[error("out of memory: {bytes} bytes were not to be had")]
    OutOfMemory { bytes: usize },
}

pub type Result<T> = std::result::Result<T, Error>;

/// The error for a name that is none of an enumeration's.
pub(crate) fn unknown_choice(name: &'static str, choices: &str, got: &str) -> Error {
    Error::Argument { name, expected: format!("one of {choices}"), got: format!("{got:?}") }
}

/// Problems of one body, as bits that may be combined; 0 means none.
pub mod status {
    /// A coordinate is NaN or infinite: values are NaN, gradients zero.
    pub const NON_FINITE: u32 = 1;
    /// A part's signed volume is negative: the posed surface has turned inside out there.
    pub const INVERTED_PART: u32 = 2;
    /// No sample is in contact with the ground.
    pub const NO_CONTACT: u32 = 4;
    /// The body encloses no volume, so that it has no centre of mass.
    pub const NO_VOLUME: u32 = 8;
    /// The body is under 20 cm or over 10 m across: probably not in metres.
    pub const ODD_SIZE: u32 = 16;
    /// The physics engine found no convex hull, or its state became non-finite.
    pub const NOT_SIMULATED: u32 = 32;

    /// The bits of a finite body, from its signed part volumes and the sides of its bounding box.
    pub fn bits(volumes: &[f64], sides: [f64; 3], has_contact: bool) -> u32 {
        let size = sides.into_iter().fold(0.0, f64::max);
        let bits = [
            (volumes.iter().any(|v| *v < 0.0), INVERTED_PART),
            (!has_contact, NO_CONTACT),
            (volumes.iter().map(|v| v.abs()).sum::<f64>() <= 1e-12 * size.powi(3), NO_VOLUME),
            (!(0.2..=10.0).contains(&size), ODD_SIZE),
        ];
        bits.iter().filter(|(set, _)| *set).fold(0, |all, (_, bit)| all | bit)
    }
}
