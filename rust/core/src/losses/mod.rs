//! The losses, one term per file. Each is one number per body (two for the ground), unweighted.

pub mod balance;
pub mod ground;
pub mod stability;
pub mod terms;
