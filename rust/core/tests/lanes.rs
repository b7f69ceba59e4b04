//! CPU levels and lanes: a body has the same bits alone, in any lane of any width, beside any neighbour.

mod common;

use ipman::number::simd_level::Level;
use ipman::quantity::Quantity;
use ipman::registry::{Visitor, named};
use ipman::{Batch, Template};

/// Values and gradients.
struct Run<'a>(Batch<'a, f32>);

impl Visitor for Run<'_> {
    type Output = (Vec<f32>, Vec<f32>);
    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        let size = self.0.value(&quantity).unwrap().len();
        let d_out: Vec<f32> = (0..size).map(|i| 0.7 - 0.1 * (i % 5) as f32).collect();
        self.0.value_and_vjp(&quantity, &d_out).unwrap()
    }
}

fn run(template: &Template, level: Level, vertices: &[f32], quantity: &(String, Vec<f64>)) -> (Vec<f32>, Vec<f32>) {
    let count = vertices.len() / (3 * template.mesh.num_vertices);
    let normals = [0.1, 1.0, 0.0].repeat(count);
    let batch = Batch::new(template, vertices, &normals, &vec![0.003; count], &|| false).unwrap();
    named(template, &quantity.0, &quantity.1, Run(batch.at_level(level))).unwrap()
}

/// Bodies that lean, sink, and at last hover, so that branches and Newton's path differ between the lanes.
fn bodies(vertices: &[[f64; 3]], count: usize) -> Vec<Vec<f32>> {
    let body = |k: usize| {
        let (lean, rise) = (0.05 * k as f64, 0.004 * k as f64 - 0.03);
        vertices.iter().flat_map(|v| [v[0] + lean * v[1], v[1] + rise, v[2] + 0.1]).map(|x| x as f32).collect()
    };
    (0..count).map(body).collect()
}

fn bits(numbers: &[f32]) -> Vec<u32> {
    // A lane without a part of the support adds a zero, whose sign is free.
    numbers.iter().map(|x| (x + 0.0).to_bits()).collect()
}

#[test]
fn lanes_are_bodies() {
    const COUNT: usize = 16 + 16 + 8 + 3;
    let (template, vertices) = common::template(2, 300);
    let bodies = bodies(&vertices, COUNT);
    let together: Vec<f32> = bodies.concat();
    for quantity in common::quantities() {
        for level in Level::available() {
            let (values, gradient) = run(&template, level, &together, &quantity);
            for (body, vertices) in bodies.iter().enumerate() {
                let size = values.len() / COUNT;
                // The upstream gradient of the test follows the place in the batch.
                if !(body * size).is_multiple_of(5) {
                    continue;
                }
                let alone = run(&template, level, vertices, &quantity);
                assert!(
                    bits(&values[body * size..][..size]) == bits(&alone.0),
                    "value of {quantity:?} of body {body}, {}",
                    level.name()
                );
                assert!(
                    bits(&gradient[body * vertices.len()..][..vertices.len()]) == bits(&alone.1),
                    "gradient of {quantity:?} of body {body}, {}",
                    level.name()
                );
            }
        }
    }
}

/// Levels with fused operations round alike; the scalar level rounds twice where they round once.
#[test]
fn levels_agree() {
    let (template, vertices) = common::template(2, 300);
    let together: Vec<f32> = bodies(&vertices, 20).concat();
    for quantity in common::quantities() {
        let scalar = run(&template, Level::Scalar, &together, &quantity);
        let fused: Vec<_> = Level::available().into_iter().filter(|&level| level != Level::Scalar).collect();
        let runs: Vec<_> = fused.iter().map(|&level| run(&template, level, &together, &quantity)).collect();
        assert!(runs.windows(2).all(|pair| bits(&pair[0].1) == bits(&pair[1].1)), "{quantity:?}");
        for run in &runs {
            let size = |numbers: &[f32]| numbers.iter().map(|&x| x as f64 * x as f64).sum::<f64>().sqrt();
            let difference: Vec<f32> = run.1.iter().zip(&scalar.1).map(|(a, b)| a - b).collect();
            // Both are single precision's rounding away from the exact gradient; 2e-5 is what `gradients` allows each.
            assert!(size(&difference) <= 4e-5 * (size(&scalar.1) + 1e-6), "{quantity:?}");
        }
    }
}
