//! The tip test and the roll against closed forms: boxes, prisms, ellipsoids.

mod common;

use ipman::error::status;
use ipman::solid::GRAVITY;
use ipman::tipping::{TipTest, Tipping};
use ipman::{Batch, Template, threads};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

const UP: [f64; 3] = [0.0, 1.0, 0.0];
const DENSITY: f64 = 985.0;
const OK: u32 = 0;

fn tip(vertices: &[[f64; 3]], faces: &[[i64; 3]]) -> Tipping {
    let template = Template::new(vertices, faces, &[], 10, 0).unwrap();
    tip_on(&template, vertices, UP, 0.0)
}

fn tip_on(template: &Template, vertices: &[[f64; 3]], up: [f64; 3], height: f64) -> Tipping {
    let flat = common::flat(vertices);
    let batch = Batch::new(template, &flat, &up, &[height], &|| false).unwrap();
    batch.tip_test(&TipTest::new(&[DENSITY], 0.1, 0.005, 0.001, 0.26).unwrap()).unwrap().remove(0)
}

fn turned(vertices: &[[f64; 3]], turn: &Rotation3<f64>) -> Vec<[f64; 3]> {
    let turned: Vec<[f64; 3]> = vertices.iter().map(|&v| (turn * Vector3::from(v)).into()).collect();
    let lowest = turned.iter().fold(f64::INFINITY, |low, v| low.min(v[1]));
    turned.iter().map(|v| [v[0], v[1] - lowest, v[2]]).collect()
}

fn close(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance, "{got} is not {want}");
}

#[test]
fn a_box_tips_over_its_edges_as_the_textbook_has_it() {
    let [x, y, z] = [0.4, 1.6, 0.6];
    let (vertices, faces) = common::cuboid([x, y, z]);
    let found = tip(&vertices, &faces);
    let (mass, h) = (DENSITY * x * y * z, y / 2.0);
    let barrier = |s: f64| mass * GRAVITY * ((h * h + s * s).sqrt() - h);
    let about_edge = |width: f64| mass * (width * width + y * y) / 3.0;
    close(found.stance.height, h, 1e-14);
    close(found.stance.margin, x / 2.0, 1e-14);
    close(found.stance.barrier, barrier(x / 2.0), 1e-10);
    close(found.stance.push, (2.0 * barrier(x / 2.0) / about_edge(x)).sqrt(), 1e-13);
    close(found.stance.rate, (mass * GRAVITY * h / about_edge(x)).sqrt(), 1e-13);
    assert_eq!((found.rest.tilt, found.rest.sunk), (0.0, 0.0));
    assert_eq!(found.solid.status, OK);
}

/// A low, long box: the nearest edge is not the one that the least push tips it over.
#[test]
fn the_least_push_need_not_be_over_the_nearest_edge() {
    let sides = [[0.30, 1.0, 0.31], [0.31, 1.0, 0.30], [0.2, 0.9, 0.8]];
    for [x, y, z] in sides {
        let (vertices, faces) = common::cuboid([x, y, z]);
        let push = |width: f64| {
            let (h, s) = (y / 2.0, width / 2.0);
            (2.0 * GRAVITY * ((h * h + s * s).sqrt() - h) / ((width * width + y * y) / 3.0)).sqrt()
        };
        close(tip(&vertices, &faces).stance.push, push(x).min(push(z)), 1e-13);
    }
}

#[test]
fn a_tilted_box_rolls_back_until_its_centre_is_outside() {
    let [x, y, z] = [0.4, 1.6, 0.6];
    let (vertices, faces) = common::cuboid([x, y, z]);
    let (h, s) = (y / 2.0, x / 2.0);
    let limit = f64::atan2(s, h);
    for angle in [0.01, 0.1, limit - 1e-3, limit + 1e-3, 0.6, 1.2] {
        let found = tip(&turned(&vertices, &Rotation3::from_axis_angle(&Vector3::z_axis(), angle)), &faces);
        let start = h * angle.cos() + s * angle.sin();
        close(found.stance.height, start, 1e-12);
        let (tilt, rest) = if angle < limit { (angle, h) } else { (std::f64::consts::FRAC_PI_2 - angle, s) };
        close(found.rest.tilt, tilt, 1e-9);
        close(found.rest.sunk, start - rest, 1e-9);
        if angle > limit {
            close(found.stance.margin, s * angle.cos() - h * angle.sin(), 1e-12);
            assert_eq!((found.stance.barrier, found.stance.push), (0.0, 0.0));
        }
    }
}

#[test]
fn a_prism_rolls_onto_its_nearest_side() {
    let (sides, radius, length) = (7, 0.3, 1.0);
    let (vertices, faces) = prism(sides, radius, length);
    let step = std::f64::consts::TAU / sides as f64;
    let inner = radius * (step / 2.0).cos();
    for angle in [0.02, 0.3, 0.44, 0.46, 0.8, 3.0] {
        // On a side at 0 and at every whole step.
        let found = tip(&turned(&vertices, &Rotation3::from_axis_angle(&Vector3::x_axis(), angle)), &faces);
        let off = angle - (angle / step).round() * step;
        close(found.rest.tilt, off.abs(), 1e-9);
        close(found.rest.sunk, radius * (step / 2.0 - off.abs()).cos() - inner, 1e-9);
    }
}

/// On an edge that is 2 mm wide a plate of 1 m stands, until it is nudged.
#[test]
fn what_rests_on_a_narrow_edge_falls_when_it_is_nudged() {
    let (vertices, faces) = common::cuboid([0.002, 1.0, 1.0]);
    let found = tip(&vertices, &faces);
    assert_eq!(found.rest.tilt, 0.0);
    close(found.rest.nudged_tilt, 0.0, 1e-9); // 0.001 < atan(1 mm / 0.5 m)
    let (vertices, faces) = common::cuboid([0.0009, 1.0, 1.0]);
    let found = tip(&vertices, &faces);
    assert_eq!(found.rest.tilt, 0.0);
    assert!(found.rest.nudged_tilt > 0.26);
}

/// A regular prism that lies along x on one of its sides.
fn prism(sides: usize, radius: f64, length: f64) -> (Vec<[f64; 3]>, Vec<[i64; 3]>) {
    let step = std::f64::consts::TAU / sides as f64;
    let corner = |k: usize| {
        let angle = -std::f64::consts::FRAC_PI_2 + step * (k as f64 + 0.5);
        [radius * angle.sin(), radius * angle.cos()]
    };
    let ends = |x: f64| (0..sides).map(move |k| [x, corner(k)[0], corner(k)[1]]);
    let vertices: Vec<[f64; 3]> = ends(0.0).chain(ends(length)).collect();
    let n = sides as i64;
    let mut faces = Vec::new();
    for k in 0..n {
        let next = (k + 1) % n;
        faces.extend([[k, next, n + k], [next, n + next, n + k]]);
        if k > 0 && next > 0 {
            faces.extend([[0, next, k], [n, n + k, n + next]]);
        }
    }
    let volume: f64 = faces.iter().map(|face: &[i64; 3]| signed(face.map(|i| vertices[i as usize]))).sum();
    if volume < 0.0 {
        faces.iter_mut().for_each(|face| face.reverse());
    }
    (vertices, faces)
}

fn signed([a, b, c]: [[f64; 3]; 3]) -> f64 {
    common::dot(a, common::cross(b, c))
}

/// A smooth body, on which the roll meets hundreds of vertices: it comes to lie on its flattest side.
#[test]
fn an_ellipsoid_comes_to_lie_on_its_flattest_side() {
    let (sphere, faces) = common::icosphere(4);
    let vertices: Vec<[f64; 3]> = sphere.iter().map(|v| [0.25 * v[0], 0.85 * v[1], 0.15 * v[2]]).collect();
    for angle in [0.05, 0.4, 1.0] {
        let turn = Rotation3::from_euler_angles(angle, 0.3, 0.2);
        let found = tip(&turned(&vertices, &turn), &faces);
        // Facets of a mesh of this fineness are flatter than the ellipsoid by up to two per cent.
        close(found.stance.height - found.rest.sunk, 0.15, 0.003);
        assert!(found.rest.tilt > 0.3);
    }
}

#[test]
fn bodies_that_cannot_stand_have_a_status_and_leave_the_others_alone() {
    let (vertices, faces) = common::cuboid([0.4, 1.6, 0.6]);
    let template = Template::new(&vertices, &faces, &[], 10, 0).unwrap();
    let mut broken = vertices.clone();
    broken[3][1] = f64::NAN;
    let flat: Vec<[f64; 3]> = vertices.iter().map(|v| [v[0], v[1], 0.0]).collect();
    let inside_out: Vec<[f64; 3]> = vertices.iter().map(|v| [-v[0], v[1], v[2]]).collect();
    let raised: Vec<[f64; 3]> = vertices.iter().map(|v| [v[0], v[1] + 0.2, v[2]]).collect();
    let bodies = [vertices.clone(), broken, flat, inside_out, raised, vertices.clone()].concat();
    let (flat, normals, heights) = (common::flat(&bodies), UP.repeat(6), [0.0; 6]);
    let batch = Batch::new(&template, &flat, &normals, &heights, &|| false).unwrap();
    let found = batch.tip_test(&TipTest::new(&[DENSITY], 0.1, 0.005, 0.001, 0.26).unwrap()).unwrap();
    let bits: Vec<u32> = found.iter().map(|one| one.solid.status).collect();
    assert_eq!(bits[..3], [OK, status::NON_FINITE, status::NO_VOLUME]);
    assert_eq!(bits[3], status::NO_VOLUME | status::INVERTED_PART);
    assert_eq!(bits[4..], [status::NO_CONTACT, OK]);
    for bad in &found[1..5] {
        assert!(bad.stance.margin.is_nan() && bad.rest.tilt.is_nan() && bad.stance.push.is_nan());
    }
    assert!((found[4].solid.mass / found[0].solid.mass - 1.0).abs() < 1e-12, "a body in the air has a mass");
    assert_eq!(found[5].row(), found[0].row());
    assert_eq!(found[0].row(), tip(&vertices, &faces).row());
}

#[test]
fn threads_and_neighbours_change_no_bit() {
    let (template, vertices) = common::template(3, 10);
    let bodies: Vec<[f64; 3]> = (0..37)
        .flat_map(|k| turned(&vertices, &Rotation3::from_euler_angles(0.02 * k as f64, 0.3, 0.01 * k as f64)))
        .collect();
    let single: Vec<f32> = bodies.as_flattened().iter().map(|&x| x as f32).collect();
    let test = TipTest::new(&[900.0, 1000.0, 1100.0, 1200.0], 0.1, 0.005, 0.001, 0.26).unwrap();
    let rows = |vertices: &[f32]| -> Vec<[u64; Tipping::ROW]> {
        let count = vertices.len() / (3 * template.mesh.num_vertices);
        let (normals, heights) = (UP.repeat(count), vec![0.0; count]);
        let batch = Batch::new(&template, vertices, &normals, &heights, &|| false).unwrap();
        batch.tip_test(&test).unwrap().iter().map(|one| one.row().map(f64::to_bits)).collect()
    };
    threads::set_num_threads(Some(1));
    let alone: Vec<_> = single.chunks(3 * template.mesh.num_vertices).flat_map(rows).collect();
    let one = rows(&single);
    threads::set_num_threads(Some(3));
    let three = rows(&single);
    threads::set_num_threads(None);
    assert_eq!(one, alone);
    assert_eq!(one, three);
}

#[test]
fn numbers_out_of_range_are_named() {
    assert!(
        TipTest::new(&[985.0], 0.1, 0.2, 0.0, 0.0)
            .err()
            .unwrap()
            .to_string()
            .starts_with("tolerance: expected 0 to 0.03")
    );
    assert!(TipTest::new(&[985.0], 0.1, f64::NAN, 0.0, 0.0).is_err());
    let (vertices, faces) = common::cuboid([0.4, 1.6, 0.6]);
    let template = Template::new(&vertices, &faces, &[], 10, 0).unwrap();
    let flat = common::flat(&vertices);
    let batch = Batch::new(&template, &flat, &UP, &[0.0], &|| false).unwrap();
    let wrong = batch.tip_test(&TipTest::new(&[1.0, 2.0], 0.1, 0.005, 0.0, 0.0).unwrap());
    assert!(wrong.unwrap_err().to_string().starts_with("densities"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any box comes to rest on a side, from any pose: its centre is then half an edge above the ground.
    #[test]
    fn a_box_comes_to_rest_on_a_side(
        sides in prop::array::uniform3(0.2..1.5_f64), angles in prop::array::uniform3(-3.1..3.1_f64),
    ) {
        let (vertices, faces) = common::cuboid(sides);
        let found = tip(&turned(&vertices, &Rotation3::from_euler_angles(angles[0], angles[1], angles[2])), &faces);
        let rest = found.stance.height - found.rest.sunk;
        let off = sides.iter().map(|side| (rest - side / 2.0).abs()).fold(f64::INFINITY, f64::min);
        prop_assert!(off < 1e-9, "{rest} above the ground, sides {sides:?}");
        prop_assert!(found.rest.sunk >= 0.0 && (0.0..=std::f64::consts::PI).contains(&found.rest.tilt));
        prop_assert!(found.stance.margin < 1e-12 || found.rest.tilt < 0.2);
    }

    /// Where a body is and which way the world's axes point does not matter, and lengths scale.
    #[test]
    fn rigid_motions_and_scale(
        angles in prop::array::uniform3(-3.1..3.1_f64), shift in prop::array::uniform3(-50.0..50.0_f64), scale in 0.7..1.4_f64,
    ) {
        let (vertices, faces) = common::cuboid([0.4, 1.6, 0.6]);
        let vertices = turned(&vertices, &Rotation3::from_euler_angles(0.02, 0.0, 0.3));
        let template = Template::new(&vertices, &faces, &[], 10, 0).unwrap();
        let test = |tolerance, vertices: &[[f64; 3]], up: [f64; 3], height| {
            let flat = common::flat(vertices);
            let batch = Batch::new(&template, &flat, &up, &[height], &|| false).unwrap();
            batch.tip_test(&TipTest::new(&[DENSITY], 0.1, tolerance, 0.0, 0.0).unwrap()).unwrap().remove(0)
        };
        let here = test(0.01, &vertices, UP, 0.0);
        let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let up: [f64; 3] = (turn * Vector3::y()).into();
        let there: Vec<[f64; 3]> =
            vertices.iter().map(|&v| (scale * (turn * Vector3::from(v)) + Vector3::from(shift)).into()).collect();
        let found = test(0.01 * scale, &there, up, common::dot(up, shift));
        // Coordinates of 50 m round to 7e-15 m.
        prop_assert!((found.stance.margin / scale - here.stance.margin).abs() < 1e-11);
        prop_assert!((found.stance.rate * scale.sqrt() / here.stance.rate - 1.0).abs() < 1e-10);
        prop_assert!((found.rest.tilt - here.rest.tilt).abs() < 1e-7);
        prop_assert!((found.rest.sunk / scale - here.rest.sunk).abs() < 1e-8);
    }
}
