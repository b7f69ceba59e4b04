//! Batches: the same bits for any number of threads and any place in a batch; a bad body harms nobody else.

mod common;

use ipman::ground::Ground;
use ipman::losses::balance::{BalanceCost, Wrap};
use ipman::losses::ground::{GroundLoss, Tanh};
use ipman::losses::stability::StabilityLoss;
use ipman::losses::terms::Terms;
use ipman::mass::Method;
use ipman::mass_properties::MassProperties;
use ipman::number::simd_level::Level;
use ipman::points::Points;
use ipman::pressure::{CenterOfPressure, PressureCurve};
use ipman::reduction::{Pool, Reduction};
use ipman::support::{Contact, ContactRule, SupportMargin};
use ipman::{Batch, Error, Template};

fn stability(gamma: f64) -> StabilityLoss {
    let curve = PressureCurve { alpha: 100.0, gamma };
    StabilityLoss { method: Method::Pcom, pressure: CenterOfPressure { curve, epsilon: 0.0 } }
}

fn ground(beta2: f64) -> GroundLoss {
    let (alpha1, alpha2, beta1) = (1.0, 0.15, 10.0);
    GroundLoss { points: Points::Samples, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 }
}

fn terms() -> Terms {
    Terms(vec![stability(10.0).into(), ground(0.15).into()])
}

/// `count` bodies that lean more and more.
fn bodies(count: usize) -> (Template, Vec<f32>) {
    let (template, vertices) = common::template(3, 600);
    let lean = |body: usize| vertices.iter().flat_map(move |v| [v[0] + 0.01 * body as f64 * v[1], v[1], v[2]]);
    let data = (0..count).flat_map(|body| lean(body).map(|x| x as f32).collect::<Vec<_>>()).collect();
    (template, data)
}

fn evaluate(template: &Template, data: &[f32], count: usize) -> (Vec<f32>, Vec<f32>) {
    let normals = [0.0, 1.0, 0.0].repeat(count);
    let never = || false;
    let batch = Batch::new(template, data, &normals, &vec![0.0; count], &never).unwrap();
    batch.value_and_vjp(&terms(), &vec![1.0; 3 * count]).unwrap()
}

#[test]
fn bits_do_not_depend_on_threads_or_place() {
    let (template, data) = bodies(37);
    let row = data.len() / 37;
    ipman::threads::set_num_threads(Some(1));
    let alone = evaluate(&template, &data, 37);
    for threads in [2, 3, 8] {
        ipman::threads::set_num_threads(Some(threads));
        assert!(evaluate(&template, &data, 37) == alone, "{threads} threads");
    }
    for body in [0, 5, 36] {
        let (values, gradient) = evaluate(&template, &data[body * row..][..row], 1);
        assert_eq!(values, alone.0[3 * body..][..3]);
        assert_eq!(gradient, alone.1[body * row..][..row]);
    }
}

#[test]
fn a_bad_body_leaves_its_neighbours_alone() {
    let (template, mut data) = bodies(5);
    let row = data.len() / 5;
    let good = evaluate(&template, &data, 5);
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        data[2 * row + 7] = bad;
        let (values, gradient) = evaluate(&template, &data, 5);
        for body in [0, 1, 3, 4] {
            assert_eq!(values[3 * body..][..3], good.0[3 * body..][..3]);
            assert_eq!(gradient[body * row..][..row], good.1[body * row..][..row]);
        }
        assert!(gradient.iter().all(|x| x.is_finite()));
        if !bad.is_finite() {
            assert!(values[6..9].iter().all(|x| x.is_nan()));
            assert!(gradient[2 * row..][..row].iter().all(|&x| x == 0.0));
        }
    }
}

#[test]
fn hovering_and_sunken_bodies_stay_finite() {
    let (template, vertices) = common::template(3, 600);
    for lift in [100.0, 1.0, -1.0, -100.0] {
        let data: Vec<f32> = vertices.iter().flat_map(|v| [v[0], v[1] + lift, v[2]]).map(|x| x as f32).collect();
        let (values, gradient) = evaluate(&template, &data, 1);
        assert!(values.iter().chain(&gradient).all(|x| x.is_finite()), "{lift}: {values:?}");
        let never = || false;
        let batch = Batch::new(&template, &data, &[0.0, 1.0, 0.0], &[0.0], &never).unwrap();
        let curve = PressureCurve { alpha: 100.0, gamma: 50.0 };
        let balance = BalanceCost { method: Method::Pcom, wrap: Wrap::None, curve, sigma: 0.02 };
        let (cost, gradient) = batch.value_and_vjp(&balance, &[1.0]).unwrap();
        assert!(cost.iter().chain(&gradient).all(|x| x.is_finite()), "{lift}: {cost:?}");
    }
}

#[test]
fn a_body_in_the_air_has_no_margin_and_no_gradient() {
    let (template, vertices) = common::template(3, 600);
    let data: Vec<f64> = vertices.iter().flat_map(|v| [v[0], v[1] + 2.0, v[2]]).collect();
    let never = || false;
    let batch = Batch::new(&template, &data, &[0.0, 1.0, 0.0], &[0.0], &never).unwrap();
    let contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };
    let margin = SupportMargin { contact, method: Method::Pcom };
    let (value, gradient) = batch.value_and_vjp(&margin, &[1.0]).unwrap();
    assert_eq!(value, [f64::NEG_INFINITY]);
    assert!(gradient.iter().all(|&x| x == 0.0));
    let support = &batch.base_of_support(&contact, Method::Pcom).unwrap()[0];
    assert!(!support.has_contact() && !support.inside() && support.polygon.is_empty() && support.area == 0.0);
}

/// Single precision has the contacts and the hull's corners of double precision, in every lane of every level, also where
/// a sample lies within single precision's rounding of the threshold.
#[test]
fn precisions_agree_on_the_base_of_support() {
    let (template, single) = bodies(16 + 8 + 3);
    let double: Vec<f64> = single.iter().map(|&x| x as f64).collect();
    let count = single.len() / (3 * template.mesh.num_vertices);
    let normals = [0.1, 1.0, -0.05].repeat(count);
    let never = || false;
    // A threshold within 1e-9 m of the height of the first body's tenth lowest sample.
    let ground = Ground::new([0.1, 1.0, -0.05], 0.01).unwrap();
    let vertices = &double.as_chunks::<3>().0[..template.mesh.num_vertices];
    let height = |sample| ground.signed_height(template.samples.point(sample, vertices)).abs();
    let mut close: Vec<f64> = (0..template.samples.len()).map(height).collect();
    close.sort_by(f64::total_cmp);
    let close = close[10];
    for rule in [ContactRule::Paper, ContactRule::Released] {
        for threshold in [0.02, 0.1, 0.6, close + 1e-9, close - 1e-9] {
            let contact = Contact { rule, threshold };
            let heights = vec![0.01; count];
            let exact = Batch::new(&template, &double, &normals, &heights, &never).unwrap();
            let exact = exact.base_of_support(&contact, Method::VertexMean).unwrap();
            for level in Level::available() {
                let batch = Batch::new(&template, &single, &normals, &heights, &never).unwrap().at_level(level);
                let found = batch.base_of_support(&contact, Method::VertexMean).unwrap();
                for (found, exact) in found.iter().zip(&exact) {
                    assert_eq!(found.num_contacts, exact.num_contacts, "{rule:?} {threshold} {}", level.name());
                    assert_eq!(found.polygon.len(), exact.polygon.len());
                    for (a, b) in found.polygon.iter().zip(&exact.polygon) {
                        assert!(common::distance(*a, *b) < 1e-14);
                    }
                    assert!((found.area - exact.area).abs() < 1e-14);
                    // The centre of mass is single precision's.
                    let same = found.margin == exact.margin || (found.margin - exact.margin).abs() < 1e-6;
                    assert!(same, "{} {}", found.margin, exact.margin);
                }
            }
        }
    }
}

#[test]
fn wrong_lengths_and_grounds_are_named() {
    let (template, data) = bodies(2);
    let never = || false;
    let batch = |normals: &[f64], heights: &[f64]| Batch::new(&template, &data, normals, heights, &never).err();
    assert!(matches!(batch(&[0.0, 1.0, 0.0], &[0.0]), Some(Error::Argument { name: "vertices", .. })));
    assert!(matches!(batch(&[0.0, 1.0, 0.0], &[0.0; 2]), Some(Error::Argument { name: "normal", .. })));
    let zero = batch(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0], &[0.0; 2]);
    assert_eq!(zero, Some(Error::GroundNormal { body: 1 }));
    assert!(matches!(
        batch(&[0.0, 1.0, 0.0].repeat(2), &[0.0, f64::NAN]),
        Some(Error::Argument { name: "height", .. })
    ));
}

#[test]
fn an_interruption_stops_between_bodies() {
    let (template, data) = bodies(37);
    let normals = [0.0, 1.0, 0.0].repeat(37);
    let batch = Batch::new(&template, &data, &normals, &[0.0; 37], &|| true).unwrap();
    assert_eq!(batch.value(&terms()).unwrap_err(), Error::Interrupted);
}

/// As numpy and torch do.
#[test]
fn options_and_weights_out_of_range_are_named() {
    let (template, data) = bodies(1);
    let batch = Batch::new(&template, &data, &[0.0, 1.0, 0.0], &[0.0], &|| false).unwrap();
    let named = |error: Option<Error>| match error {
        Some(Error::Argument { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    for gamma in [-1.0, f64::NAN, f64::INFINITY] {
        let quantity = Terms(vec![stability(gamma).into(), ground(0.15).into()]);
        assert_eq!(named(batch.value(&quantity).err()), "gamma");
        assert_eq!(named(batch.vjp(&quantity, &[1.0; 3]).err()), "gamma");
    }
    let quantity = Terms(vec![stability(10.0).into(), ground(0.0).into()]);
    assert_eq!(named(batch.value(&quantity).err()), "beta2");
    let contact = Contact { rule: ContactRule::Paper, threshold: f64::NAN };
    assert_eq!(named(batch.status(&contact).err()), "threshold");
    let dense = MassProperties { densities: vec![-985.0] };
    assert_eq!(named(batch.solids(&dense, 0.1).err()), "densities");
    let pool = Pool { valid: None, reduction: Reduction::Mean };
    for weights in [[1.0, f64::NAN, 1.0], [f64::INFINITY, 1.0, 1.0]] {
        let mut gradient = vec![0.0; data.len()];
        assert_eq!(named(pool.weighted(&batch, &terms(), &weights, &mut gradient).err()), "weights");
    }
}
