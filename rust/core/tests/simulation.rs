//! Stiff bodies let go, against closed forms.
#![cfg(feature = "simulation")]

mod common;

use ipman::error::status;
use ipman::mass_properties::MassProperties;
use ipman::simulation::contact::Shape;
use ipman::simulation::{Motion, Simulation};
use ipman::solid::GRAVITY;
use ipman::{Batch, Template, threads};

const STEP: f64 = 1.0 / 240.0;
const SIZE: [f64; 3] = [0.4, 1.6, 0.6];

fn setting(looks: &[usize]) -> Simulation {
    Simulation {
        densities: MassProperties { densities: vec![985.0] },
        contact: 0.1,
        shape: Shape::Hull,
        snap: true,
        step: STEP,
        friction: 1.0,
        looks: looks.to_vec(),
    }
}

fn run(simulation: &Simulation, bodies: &[Vec<[f64; 3]>]) -> Vec<Motion> {
    let (vertices, faces) = common::cuboid(SIZE);
    let template = Template::new(&vertices, &faces, &[], 10, 0).unwrap();
    let (flat, count) = (common::flat(&bodies.concat()), bodies.len());
    let (normals, heights) = ([0.0, 1.0, 0.0].repeat(count), vec![0.0; count]);
    Batch::new(&template, &flat, &normals, &heights, &|| false).unwrap().simulate(simulation).unwrap()
}

/// A box turned about its edge along z by so many radians, this edge on the ground.
fn tilted(angle: f64) -> Vec<[f64; 3]> {
    let (sin, cos) = angle.sin_cos();
    common::cuboid(SIZE).0.iter().map(|v| [v[0] * cos + v[1] * sin, v[1] * cos - v[0] * sin, v[2]]).collect()
}

/// The box over the edge at x = 0.4: its centre of mass tips towards +x.
fn tipped(angle: f64) -> Vec<[f64; 3]> {
    let turned = tilted(angle);
    let lowest = turned.iter().fold(f64::INFINITY, |low, v| low.min(v[1]));
    turned.iter().map(|v| [v[0], v[1] - lowest, v[2]]).collect()
}

fn tilt(motion: &Motion, look: usize) -> f64 {
    motion.places[look].rotation[1][1].clamp(-1.0, 1.0).acos()
}

fn moved(motion: &Motion, look: usize) -> f64 {
    common::distance(motion.places[0].centre, motion.places[look].centre)
}

#[test]
fn a_box_falls_freely_until_it_lands() {
    let height = 0.8;
    let raised: Vec<[f64; 3]> = common::cuboid(SIZE).0.iter().map(|v| [v[0], v[1] + height, v[2]]).collect();
    let landing = (2.0 * height / GRAVITY).sqrt();
    let before = (0.9 * landing / STEP) as usize;
    let after = (1.1 * landing / STEP) as usize;
    let motion = &run(&Simulation { snap: false, ..setting(&[before, after, 480]) }, &[raised])[0];
    assert_eq!(motion.status, status::NO_CONTACT);
    let time = before as f64 * STEP;
    // Each of the engine's steps is right to the order of its length: g t Δt / 2 with four substeps.
    let error = (moved(motion, 1) - GRAVITY * time * time / 2.0).abs();
    assert!(error <= GRAVITY * time * STEP / 2.0, "{error}");
    for look in [2, 3] {
        assert!((moved(motion, look) - height).abs() < 5e-3, "landed: {}", moved(motion, look));
    }
}

#[test]
fn a_box_stands_up_to_its_limit_and_falls_beyond() {
    let limit = f64::atan2(SIZE[0] / 2.0, SIZE[1] / 2.0);
    let angles = [0.0, limit - 0.05, limit + 0.05];
    let motions = run(&setting(&[100, 1200]), &angles.map(tipped));
    assert!(moved(&motions[0], 2) < 1e-3 && tilt(&motions[0], 2) < 1e-3);
    // Let go at an angle, it rocks between its edges and comes to rest upright.
    assert!((tilt(&motions[1], 2) - angles[1]).abs() < 0.02, "{}", tilt(&motions[1], 2));
    assert!((tilt(&motions[2], 2) - (std::f64::consts::FRAC_PI_2 - angles[2])).abs() < 0.02);
}

/// Over an edge, before anything else touches, it is an inverted pendulum: angle'' = (m g r / I) sin(angle).
#[test]
fn a_falling_box_is_an_inverted_pendulum() {
    let (h, s) = (SIZE[1] / 2.0, SIZE[0] / 2.0);
    let (arm, start) = (h.hypot(s), 0.1);
    let angle = f64::atan2(s, h) + start;
    let square = GRAVITY * arm / ((4.0 * h * h + 4.0 * s * s) / 3.0);
    let (mut theta, mut rate, parts) = (start, 0.0, 10_000);
    let dt = 100.0 * STEP / parts as f64;
    for _ in 0..parts {
        rate += dt * square * theta.sin();
        theta += dt * rate;
    }
    let motion = &run(&setting(&[100]), &[tipped(angle)])[0];
    assert!(
        (tilt(motion, 1) - (theta - start)).abs() < 0.03 * (theta - start),
        "{} {}",
        tilt(motion, 1),
        theta - start
    );
}

#[test]
fn bad_bodies_have_a_status_and_leave_the_others_alone() {
    let good = tipped(0.1);
    let mut broken = good.clone();
    broken[2][0] = f64::INFINITY;
    let flat: Vec<[f64; 3]> = good.iter().map(|v| [v[0], v[1], 0.0]).collect();
    let raised: Vec<[f64; 3]> = good.iter().map(|v| [v[0], v[1] + 0.3, v[2]]).collect();
    let motions = run(&setting(&[50]), &[good.clone(), broken, flat, raised, good.clone()]);
    let bits: Vec<u32> = motions.iter().map(|motion| motion.status).collect();
    assert_eq!(bits, [0, status::NON_FINITE, status::NO_VOLUME, status::NO_CONTACT, 0]);
    assert!(motions[1..4].iter().all(|motion| motion.places.iter().all(|place| place.centre[0].is_nan())));
    let alone = run(&setting(&[50]), &[good]);
    assert_eq!(motions[0].places, alone[0].places);
    assert_eq!(motions[4].places, alone[0].places);
}

#[test]
fn threads_change_no_bit() {
    let bodies: Vec<_> = (0..9).map(|k| tipped(0.04 * k as f64)).collect();
    threads::set_num_threads(Some(1));
    let one = run(&setting(&[100]), &bodies);
    threads::set_num_threads(Some(3));
    let three = run(&setting(&[100]), &bodies);
    threads::set_num_threads(None);
    assert!(one.iter().zip(&three).all(|(a, b)| a.places == b.places));
}

/// Whatever its voxels make of the sole, the decomposition starts on its own lowest point.
#[test]
fn a_decomposed_box_stands_on_its_own_hulls() {
    let faces = common::cuboid(SIZE).1.iter().map(|face| face.map(|i| i as u32)).collect();
    let shape = Shape::Decomposition { resolution: 32, faces };
    let motion = &run(&Simulation { shape, ..setting(&[100, 480]) }, &[tipped(0.0)])[0];
    assert_eq!(motion.status, 0);
    assert!(moved(motion, 2) < 2e-3 && tilt(motion, 2) < 5e-3);
}

#[test]
fn numbers_out_of_range_are_named() {
    let (vertices, faces) = common::cuboid(SIZE);
    let template = Template::new(&vertices, &faces, &[], 10, 0).unwrap();
    let flat = common::flat(&vertices);
    let batch = Batch::new(&template, &flat, &[0.0, 1.0, 0.0], &[0.0], &|| false).unwrap();
    let said = |simulation: Simulation| batch.simulate(&simulation).err().unwrap().to_string();
    assert!(said(Simulation { step: 0.0, ..setting(&[1]) }).starts_with("step: expected a positive number"));
    assert!(said(Simulation { friction: -1.0, ..setting(&[1]) }).starts_with("friction"));
    assert!(said(setting(&[2, 1])).starts_with("looks"));
}
