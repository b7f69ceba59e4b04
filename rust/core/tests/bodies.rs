//! Closed forms and invariances: volumes of any segmentation, mass properties, rigid motion.

mod common;

use ipman::batch::Batch;
use ipman::error::status;
use ipman::mass::{CenterOfMass, Method};
use ipman::mass_properties::MassProperties;
use ipman::support::{Contact, ContactRule};
use ipman::volume::PartVolumes;
use ipman::{Error, Template};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn volumes(template: &Template, vertices: &[[f64; 3]]) -> Vec<f64> {
    Batch::new(template, &common::flat(vertices), &UP, &[0.0], &|| false).unwrap().value(&PartVolumes).unwrap()
}

fn solid(template: &Template, vertices: &[[f64; 3]], densities: &[f64]) -> Vec<f64> {
    let quantity = MassProperties { densities: densities.to_vec() };
    Batch::new(template, &common::flat(vertices), &UP, &[0.0], &|| false).unwrap().value(&quantity).unwrap()
}

#[test]
fn a_box_has_the_mass_properties_of_the_textbook() {
    let [x, y, z] = [0.3, 1.7, 0.2];
    let (vertices, faces) = common::cuboid([x, y, z]);
    let template = Template::new(&vertices, &faces, &[], 100, 0).unwrap();
    let row = solid(&template, &vertices, &[1000.0]);
    let mass = 1000.0 * x * y * z;
    let inertia = [(y * y + z * z), (x * x + z * z), (x * x + y * y)].map(|s| mass * s / 12.0);
    let want = [x * y * z, mass, x / 2.0, y / 2.0, z / 2.0];
    let want: Vec<f64> =
        want.into_iter().chain([inertia[0], 0.0, 0.0, 0.0, inertia[1], 0.0, 0.0, 0.0, inertia[2]]).collect();
    for (got, want) in row[..14].iter().zip(&want) {
        assert!((got - want).abs() < 1e-13 * mass, "{row:?}");
    }
}

#[test]
fn a_fine_sphere_approaches_the_ball() {
    let (vertices, faces) = common::icosphere(5);
    let template = Template::new(&vertices, &faces, &[], 100, 0).unwrap();
    let row = solid(&template, &vertices, &[1.0]);
    let ball = 4.0 / 3.0 * std::f64::consts::PI;
    // An inscribed polyhedron of 20,480 faces is smaller by about 1 − 0.9993.
    assert!(row[0] < ball && row[0] > 0.999 * ball, "{}", row[0]);
    assert!((row[5] / (0.4 * row[1]) - 1.0).abs() < 2e-3, "I = 2/5 m r², got {}", row[5]);
}

#[test]
fn densities_weigh_the_parts() {
    let (template, vertices) = common::template(3, 500);
    let equal = solid(&template, &vertices, &[985.0; 4]);
    let one = solid(&template, &vertices, &[985.0]);
    assert_eq!(equal, one);
    let mixed = solid(&template, &vertices, &[500.0, 1000.0, 1500.0, 800.0]);
    let parts: f64 = (1..5).map(|part| mixed[14 * part + 1]).sum();
    assert!((mixed[1] / parts - 1.0).abs() < 1e-14);
}

#[test]
fn an_open_body_closes_and_says_so() {
    let (vertices, faces, parts) = common::ellipsoid(3, common::quarters);
    let closed = Template::new(&vertices, &faces, &parts, 100, 0).unwrap();
    let open = Template::new(&vertices, &faces[3..], &parts[3..], 100, 0).unwrap();
    assert!(closed.mesh.watertight && !open.mesh.watertight);
    let (whole, holed): (f64, f64) = (volumes(&closed, &vertices).iter().sum(), volumes(&open, &vertices).iter().sum());
    assert!((holed / whole - 1.0).abs() < 1e-2 && holed != whole);
}

#[test]
fn surfaces_that_enclose_nothing_or_face_inwards_are_refused() {
    let (vertices, faces) = common::cuboid([1.0, 1.0, 1.0]);
    let inwards: Vec<_> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert!(matches!(Template::new(&vertices, &inwards, &[], 10, 0), Err(Error::InsideOut { .. })));
    let sheet = Template::new(&vertices, &faces[..2], &[], 10, 0);
    assert!(matches!(sheet, Err(Error::NoVolume { .. })));
    assert!(matches!(Template::new(&vertices, &faces, &[], 0, 0), Err(Error::SampleCount { .. })));
    let mut broken = vertices.clone();
    broken[3][1] = f64::NAN;
    assert_eq!(Template::new(&broken, &faces, &[], 10, 0).unwrap_err(), Error::TemplateNotFinite { vertex: 3 });
}

#[test]
fn status_names_what_is_unusual() {
    let (template, vertices) = common::template(3, 500);
    let contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };
    let status = |vertices: &[[f64; 3]]| {
        Batch::new(&template, &common::flat(vertices), &UP, &[0.0], &|| false).unwrap().status(&contact).unwrap()[0]
    };
    let changed = |f: fn([f64; 3]) -> [f64; 3]| vertices.iter().map(|&v| f(v)).collect::<Vec<_>>();
    assert_eq!(status(&vertices), 0);
    assert_eq!(status(&changed(|v| [v[0], v[1] + 5.0, v[2]])), status::NO_CONTACT);
    assert_eq!(status(&changed(|v| [-v[0], v[1], v[2]])), status::INVERTED_PART);
    assert_eq!(status(&changed(|v| [v[0], 0.0, v[2]])) & status::NO_VOLUME, status::NO_VOLUME);
    assert_eq!(status(&changed(|v| v.map(|x| 1000.0 * x))) & status::ODD_SIZE, status::ODD_SIZE);
    assert_eq!(status(&changed(|v| [v[0], v[1] * f64::NAN, v[2]])), status::NON_FINITE);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Any labelling at all, scattered single faces and many-part junctions included: the parts add up to the whole.
    #[test]
    fn part_volumes_add_up(labels in prop::collection::vec(0..5_i64, 320), noise in prop::collection::vec(-0.02..0.02_f64, 162 * 3)) {
        let (mut vertices, faces, _) = common::ellipsoid(2, |_| 0);
        for (vertex, d) in vertices.iter_mut().zip(noise.as_chunks::<3>().0) {
            (0..3).for_each(|k| vertex[k] += d[k]);
        }
        let mut labels = labels;
        labels[..5].copy_from_slice(&[0, 1, 2, 3, 4]);
        let whole = Template::new(&vertices, &faces, &[], 50, 0).unwrap();
        let parts = Template::new(&vertices, &faces, &labels, 50, 0).unwrap();
        // Scattered labels make parts that fold over: the signed volumes add up.
        let signed: f64 = solid(&parts, &vertices, &[1.0])[14..].chunks(14).map(|row| row[0]).sum();
        let want = volumes(&whole, &vertices)[0];
        prop_assert!((signed / want - 1.0).abs() < 1e-12, "{signed} {want}");
    }

    /// Rigid motion carries the centre along, turns the inertia and leaves volumes alone; far away too.
    #[test]
    fn rigid_motion_is_followed(axis in prop::array::uniform3(-1.0..1.0_f64), shift in prop::array::uniform3(-100.0..100.0_f64)) {
        let (template, vertices) = common::template(3, 800);
        let rotation = Rotation3::new(Vector3::from(axis));
        let moved: Vec<[f64; 3]> = vertices.iter().map(|&v| (rotation * Vector3::from(v) + Vector3::from(shift)).into()).collect();
        let (before, after) = (solid(&template, &vertices, &[985.0]), solid(&template, &moved, &[985.0]));
        prop_assert!((after[0] / before[0] - 1.0).abs() < 1e-11);
        let inertia = |row: &[f64]| nalgebra::Matrix3::from_row_slice(&row[5..14]);
        let turned = rotation * inertia(&before) * rotation.transpose();
        prop_assert!((turned - inertia(&after)).norm() < 1e-10 * turned.norm());
        for method in [Method::Pcom, Method::VertexMean, Method::SampleMean, Method::FaceArea, Method::Exact] {
            let centre = |vertices: &[[f64; 3]]| {
                let data = common::flat(vertices);
                let batch = Batch::new(&template, &data, &UP, &[0.0], &|| false).unwrap();
                batch.value(&CenterOfMass { method }).unwrap()
            };
            let want = rotation * Vector3::from_row_slice(&centre(&vertices)) + Vector3::from(shift);
            prop_assert!((want - Vector3::from_row_slice(&centre(&moved))).norm() < 1e-11, "{method:?}");
        }
    }
}
