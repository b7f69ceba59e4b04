//! Skinning: the backward is the transpose of the forward's derivative, and a body's bits are its own.

use ipman::number::Scalar;
use ipman::skinning::batch::{Bodies, PosedBatch, Rows, TILE, Upstream};
use ipman::skinning::{Model, Skin};

const VERTICES: usize = 37; // two full tiles and a rest
const JOINTS: usize = 4;
const WIDTHS: [usize; 3] = [2, 1, 3]; // betas, expressions, translation

/// Numbers in (−1, 1), the same every time.
fn numbers(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|i| (((i + 1) * (2 * seed + 1)) as f64 * 0.754_877_666).fract() * 2.0 - 1.0).collect()
}

fn skin<C: Scalar>() -> Skin<C, TILE> {
    let mut weights = numbers(VERTICES * JOINTS, 3);
    for row in weights.chunks_exact_mut(JOINTS) {
        row.iter_mut().for_each(|x| *x = x.max(0.0) + 0.01);
        let sum: f64 = row.iter().sum();
        row.iter_mut().for_each(|x| *x /= sum);
    }
    let turned = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]].as_flattened().repeat(JOINTS);
    let model = Model {
        v_template: &numbers(3 * VERTICES, 4),
        shapedirs: &numbers(3 * VERTICES * WIDTHS[0], 5),
        expressiondirs: &numbers(3 * VERTICES * WIDTHS[1], 6),
        posedirs: &numbers(3 * VERTICES * 9 * (JOINTS - 1), 7),
        joints: &numbers(3 * JOINTS, 8),
        joint_shapes: &numbers(3 * JOINTS * WIDTHS[0], 9),
        joint_expressions: &numbers(3 * JOINTS * WIDTHS[1], 10),
        rest_rotation: &turned,
        pose_mean: &numbers(3 * JOINTS, 11),
        weights: &weights,
        parents: &[-1, 0, 1, 0],
    };
    Skin::new(&model).unwrap()
}

/// Parameters of some bodies, or a direction.
struct Given<T>([Vec<T>; 4], usize);

impl<T: Scalar> Given<T> {
    fn new(num_bodies: usize, form: usize, seed: usize) -> Self {
        let widths = [form * JOINTS, WIDTHS[0], WIDTHS[1], WIDTHS[2]];
        let values = |k: usize| numbers(num_bodies * widths[k], seed + k).into_iter().map(T::of).collect();
        Given(std::array::from_fn(values), num_bodies)
    }

    fn bodies(&self) -> Bodies<'_, T> {
        let rows = |k: usize| Rows { numbers: &self.0[k][..], width: self.0[k].len() / self.1, shared: false };
        Bodies { pose: rows(0), betas: rows(1), expression: rows(2), transl: rows(3) }
    }

    fn zeros(&self) -> [Vec<T>; 4] {
        self.0.clone().map(|part| vec![T::zero(); part.len()])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn the_gradient_is_the_transpose_of_the_derivative() {
    let skin = skin::<f64>();
    for form in [3, 6] {
        let (given, along) = (Given::new(3, form, 20), Given::<f64>::new(3, form, 30));
        let batch = PosedBatch::new(&skin, 3, given.bodies(), &|| false).unwrap();
        let (d_vertices, d_joints) = (numbers(9 * VERTICES, 40), numbers(9 * JOINTS, 41));
        let mut gradients = given.zeros();
        let upstream = Upstream { vertices: &d_vertices, joints: &d_joints };
        batch.vjp(upstream, gradients.each_mut().map(|part| &mut part[..])).unwrap();
        let (mut vertices, mut joints) = (vec![0.0; 9 * VERTICES], vec![0.0; 9 * JOINTS]);
        batch.jvp(&along.bodies(), &mut vertices, &mut joints).unwrap();
        let forward = dot(&vertices, &d_vertices) + dot(&joints, &d_joints);
        let backward: f64 = gradients.iter().zip(&along.0).map(|(a, b)| dot(a, b)).sum();
        assert!((forward - backward).abs() < 1e-12 * forward.abs().max(1.0), "{form}: {forward} {backward}");
    }
}

#[test]
fn a_body_has_its_own_bits_and_a_broken_one_no_gradient() {
    let skin = skin::<f32>();
    let mut given = Given::<f32>::new(11, 3, 50);
    let run = |given: &Given<f32>| {
        let count = given.1;
        let batch = PosedBatch::new(&skin, count, given.bodies(), &|| false).unwrap();
        let (mut vertices, mut joints) = (vec![0.0; 3 * count * VERTICES], vec![0.0; 3 * count * JOINTS]);
        batch.forward(&mut vertices, &mut joints).unwrap();
        let mut gradients = given.zeros();
        let ones = vec![1.0; vertices.len()];
        let upstream = Upstream { vertices: &ones, joints: &[] };
        batch.vjp(upstream, gradients.each_mut().map(|part| &mut part[..])).unwrap();
        (vertices, gradients)
    };
    let (vertices, gradients) = run(&given);
    let one = Given(given.0.clone().map(|part| part[part.len() / 11 * 9..part.len() / 11 * 10].to_vec()), 1);
    let (alone, alone_gradients) = run(&one);
    assert_eq!(alone, vertices[27 * VERTICES..30 * VERTICES]);
    for (one, all) in alone_gradients.iter().zip(&gradients) {
        assert_eq!(one[..], all[9 * one.len()..10 * one.len()]);
    }
    given.0[3][3 * 4] = f32::INFINITY;
    let (broken, broken_gradients) = run(&given);
    assert!(broken[12 * VERTICES..15 * VERTICES].iter().all(|x| x.is_nan()));
    assert_eq!(broken[15 * VERTICES..], vertices[15 * VERTICES..]);
    for (broken, clean) in broken_gradients.iter().zip(&gradients) {
        let row = clean.len() / 11;
        assert!(broken[4 * row..5 * row].iter().all(|&x| x == 0.0));
        assert_eq!(broken[5 * row..], clean[5 * row..]);
    }
}

/// Every column of the Jacobian is the derivative along one number, which dual numbers know.
#[test]
fn the_jacobian_has_the_derivatives() {
    let skin = skin::<f64>();
    let given = Given::<f64>::new(2, 3, 60);
    let batch = PosedBatch::new(&skin, 2, given.bodies(), &|| false).unwrap();
    let (parameters, row) = (3 * JOINTS + WIDTHS[0], 3 * (VERTICES + JOINTS));
    let mut jacobian = vec![0.0; 2 * batch.jacobian_width()];
    batch.jacobian(&mut jacobian).unwrap();
    for k in 0..parameters {
        let mut along = Given::<f64>(given.zeros(), 2);
        let (part, place) = if k < 3 * JOINTS { (0, k) } else { (1, k - 3 * JOINTS) };
        let width = along.0[part].len() / 2;
        for body in 0..2 {
            along.0[part][body * width + place] = 1.0;
        }
        let (mut vertices, mut joints) = (vec![0.0; 6 * VERTICES], vec![0.0; 6 * JOINTS]);
        batch.jvp(&along.bodies(), &mut vertices, &mut joints).unwrap();
        for body in 0..2 {
            let expected =
                [&vertices[body * 3 * VERTICES..][..3 * VERTICES], &joints[body * 3 * JOINTS..][..3 * JOINTS]];
            let found = &jacobian[(body * parameters + k) * row..][..row];
            for (found, expected) in found.iter().zip(expected.concat()) {
                assert!((found - expected).abs() < 1e-13, "{k}: {found} {expected}");
            }
        }
    }
}
