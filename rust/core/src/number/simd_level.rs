//! CPU levels: the instruction set extensions that the kernels are compiled for.

use crate::error::{Error, Result};
use std::sync::OnceLock;

/// An instruction set level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Scalar,
    Avx2,
    Avx512,
    Neon,
}

impl Level {
    pub(super) const ALL: [(Level, &'static str); 4] =
        [(Level::Avx512, "avx512"), (Level::Avx2, "avx2"), (Level::Neon, "neon"), (Level::Scalar, "scalar")];

    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(level, _)| *level == self).expect("all are listed").1
    }

    pub(super) fn is_here(self) -> bool {
        match self {
            Level::Scalar => true,
            Level::Neon => cfg!(target_arch = "aarch64"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                Level::Avx2.is_here()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Panics unless this CPU supports the level.
    pub(crate) fn expect_here(self) {
        assert!(self.is_here(), "this machine has no {}", self.name());
    }

    /// Levels supported by this CPU, best first.
    pub fn available() -> Vec<Level> {
        Self::ALL.into_iter().map(|(level, _)| level).filter(|level| level.is_here()).collect()
    }

    /// The level that batches run on: the best one, or the one named by the environment variable IPMAN_SIMD, which is
    /// read once.
    pub fn current() -> Result<Level> {
        static LEVEL: OnceLock<Result<Level>> = OnceLock::new();
        LEVEL.get_or_init(|| Self::chosen(std::env::var("IPMAN_SIMD").ok().as_deref())).clone()
    }

    fn chosen(wish: Option<&str>) -> Result<Level> {
        let available = Self::available();
        match wish {
            None | Some("") => Ok(available[0]),
            Some(name) => available.iter().find(|level| level.name() == name).copied().ok_or_else(|| {
                let names: Vec<_> = available.iter().map(|level| level.name()).collect();
                Error::Argument {
                    name: "IPMAN_SIMD",
                    expected: format!("one of this machine's levels, {}", names.join(", ")),
                    got: format!("{name:?}"),
                }
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_chooses_among_what_is_there() {
        assert_eq!(Level::chosen(Some("scalar")), Ok(Level::Scalar));
        assert_eq!(Level::chosen(None), Ok(Level::available()[0]));
        let error = Level::chosen(Some("mmx")).unwrap_err().to_string();
        assert!(error.contains("IPMAN_SIMD") && error.contains("scalar") && error.contains("mmx"), "{error}");
    }
}
