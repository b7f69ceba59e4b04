//! The losses: one term a file. Each is one number a body (two for the ground), unweighted.

pub mod balance;
pub mod ground;
pub mod stability;
pub mod terms;
