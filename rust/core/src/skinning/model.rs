//! A body model as plain arrays, and the checks that they fit together.

use crate::error::{Error, Result};

/// A body model's arrays, row-major: V vertices, J joints, B betas, E expressions.
pub struct Model<'a> {
    pub v_template: &'a [f64],        // (V, 3) m
    pub shapedirs: &'a [f64],         // (V, 3, B)
    pub expressiondirs: &'a [f64],    // (V, 3, E)
    pub posedirs: &'a [f64],          // (V, 3, 9 (J − 1)), or empty
    pub joints: &'a [f64],            // (J, 3)
    pub joint_shapes: &'a [f64],      // (J, 3, B)
    pub joint_expressions: &'a [f64], // (J, 3, E)
    pub rest_rotation: &'a [f64],     // (J, 3, 3)
    pub pose_mean: &'a [f64],         // (J, 3), added to an axis-angle pose
    pub weights: &'a [f64],           // (V, J)
    pub parents: &'a [i64],           // (J,), −1 at a root
}

impl Model<'_> {
    /// The numbers of betas and expressions; fails unless all arrays fit together.
    pub(super) fn check(&self) -> Result<(usize, usize)> {
        let (vertices, joints) = (self.v_template.len() / 3, self.parents.len());
        let expect = |name, expected: usize, got: usize| match got == expected {
            true => Ok(()),
            false => Err(Error::Argument { name, expected: format!("{expected} numbers"), got: got.to_string() }),
        };
        let at_least_one = |name, count: usize| match count {
            0 => Err(Error::Argument { name, expected: "at least one row".into(), got: "none".into() }),
            _ => Ok(()),
        };
        at_least_one("v_template", vertices)?;
        at_least_one("parents", joints)?;
        let (betas, expressions) = (self.shapedirs.len() / (3 * vertices), self.expressiondirs.len() / (3 * vertices));
        let poses = if self.posedirs.is_empty() { 0 } else { 9 * (joints - 1) };
        let arrays = [
            ("v_template", 3 * vertices, self.v_template),
            ("shapedirs", 3 * vertices * betas, self.shapedirs),
            ("expressiondirs", 3 * vertices * expressions, self.expressiondirs),
            ("posedirs", 3 * vertices * poses, self.posedirs),
            ("J_template", 3 * joints, self.joints),
            ("J_shapedirs", 3 * joints * betas, self.joint_shapes),
            ("J_expressiondirs", 3 * joints * expressions, self.joint_expressions),
            ("rest_rotation", 9 * joints, self.rest_rotation),
            ("pose_mean", 3 * joints, self.pose_mean),
            ("weights", vertices * joints, self.weights),
        ];
        for (name, expected, numbers) in arrays {
            expect(name, expected, numbers.len())?;
            if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
                let got = format!("{} at position {at}", numbers[at]);
                return Err(Error::Argument { name, expected: "finite numbers".into(), got });
            }
        }
        for (vertex, row) in self.weights.chunks_exact(joints).enumerate() {
            let sum: f64 = row.iter().sum();
            if (sum - 1.0).abs() > 1e-3 {
                let got = format!("{sum} at vertex {vertex}");
                return Err(Error::Argument { name: "weights", expected: "rows that sum to 1".into(), got });
            }
        }
        Ok((betas, expressions))
    }
}
