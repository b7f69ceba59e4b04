//! Lane types on aarch64.
