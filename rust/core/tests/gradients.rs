//! Every quantity's hand-written backward, dual-number forward and dual-number backward, against finite differences, and
//! single precision against double.

mod common;

use ipman::number::Data;
use ipman::quantity::Quantity;
use ipman::registry::{Visitor, named};
use ipman::{Batch, Template};
use proptest::prelude::*;

enum Verb<'a, T> {
    Value,
    Vjp(&'a [T]),
    Jvp(&'a [T]),
    Hvp(&'a [T], &'a [T]),
}

struct Run<'a, T>(Batch<'a, T>, Verb<'a, T>);

impl<T: Data> Visitor for Run<'_, T> {
    type Output = Vec<T>;
    fn visit<Q: Quantity>(self, quantity: Q) -> Vec<T> {
        match self.1 {
            Verb::Value => self.0.value(&quantity),
            Verb::Vjp(d_out) => self.0.vjp(&quantity, d_out),
            Verb::Jvp(d_vertices) => self.0.jvp(&quantity, d_vertices),
            Verb::Hvp(d_out, d_vertices) => self.0.hvp(&quantity, d_out, d_vertices),
        }
        .unwrap()
    }
}

fn run<T: Data>(template: &Template, (name, options): &(String, Vec<f64>), vertices: &[T], verb: Verb<T>) -> Vec<T> {
    let never = || false;
    let batch = Batch::new(template, vertices, &[0.1, 1.0, -0.05], &[0.012], &never).unwrap();
    named(template, name, options, Run(batch, verb)).unwrap()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn close(got: &[f64], want: &[f64], tolerance: f64) -> bool {
    let error: Vec<f64> = got.iter().zip(want).map(|(x, y)| x - y).collect();
    norm(&error) <= tolerance * (norm(want) + 1e-6)
}

fn central(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let step = 1e-6;
    f(step).iter().zip(f(-step)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_match_finite_differences(
        noise in prop::collection::vec(-0.004..0.004_f64, 162 * 3),
        direction in prop::collection::vec(-1.0..1.0_f64, 162 * 3),
        weights in prop::collection::vec(-1.0..1.0_f64, 1200),
        lean in -0.2..0.2_f64,
    ) {
        let (template, mut vertices) = common::template(2, 400);
        for vertex in &mut vertices {
            vertex[0] += lean * vertex[1];
        }
        let at: Vec<f64> = common::flat(&vertices).iter().zip(&noise).map(|(x, d)| x + d).collect();
        let moved = |step: f64| -> Vec<f64> { at.iter().zip(&direction).map(|(x, d)| x + step * d).collect() };
        for quantity in common::quantities() {
            let size = run(&template, &quantity, &at, Verb::Value).len();
            let d_out = &weights[..size];
            let slope = run(&template, &quantity, &at, Verb::Jvp(&direction));
            let gradient = run(&template, &quantity, &at, Verb::Vjp(d_out));
            let hvp = run(&template, &quantity, &at, Verb::Hvp(d_out, &direction));
            let differences = central(|step| run(&template, &quantity, &moved(step), Verb::Value));
            // 1e-6: the rounding of central differences with step 1e-6 on kinks away from this body.
            prop_assert!(close(&slope, &differences, 1e-5), "jvp of {quantity:?}");
            // The two derivatives share no code path but the forward: they agree to rounding.
            let (forward, reverse) = (dot(&slope, d_out), dot(&gradient, &direction));
            prop_assert!((forward - reverse).abs() <= 1e-9 * (norm(&slope) * norm(d_out) + 1e-6), "vjp of {quantity:?}");
            let differences = central(|step| run(&template, &quantity, &moved(step), Verb::Vjp(d_out)));
            prop_assert!(close(&hvp, &differences, 1e-4), "hvp of {quantity:?}");

            let narrow = |data: &[f64]| data.iter().map(|&x| x as f32).collect::<Vec<f32>>();
            let single = run(&template, &quantity, &narrow(&at), Verb::Vjp(&narrow(d_out)));
            let single: Vec<f64> = single.iter().map(|&x| x as f64).collect();
            prop_assert!(close(&single, &gradient, 2e-5), "f32 of {quantity:?}");
        }
    }
}
