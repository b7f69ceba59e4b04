//! The analysis: every figure is its own quantity's, and a body's figures are the same alone and in any lane.

mod common;

use ipman::analysis::Analysis;
use ipman::error::status;
use ipman::mass::Method;
use ipman::number::simd_level::Level;
use ipman::quantity::Quantity;
use ipman::registry::{Visitor, named};
use ipman::support::{Contact, ContactRule};
use ipman::{Batch, Template};

const OPTIONS: [f64; 10] = [100.0, 10.0, 0.0, 1.0, 0.15, 10.0, 0.15, 0.1, 50.0, 0.02];
const COUNT: usize = 16 + 8 + 3;
const BROKEN: usize = 5;

fn batch<'a>(template: &'a Template, level: Level, vertices: &'a [f32]) -> Batch<'a, f32> {
    let count = vertices.len() / (3 * template.mesh.num_vertices);
    Batch::new(template, vertices, &[0.1, 1.0, 0.0].repeat(count), &vec![0.003; count], &|| false)
        .unwrap()
        .at_level(level)
}

/// Bodies that lean, sink and hover; one has no number in it.
fn bodies(vertices: &[[f64; 3]]) -> Vec<Vec<f32>> {
    let body = |k: usize| {
        let (lean, rise) = (0.05 * k as f64, 0.01 * k as f64 - 0.05);
        vertices.iter().flat_map(|v| [v[0] + lean * v[1], v[1] + rise, v[2] + 0.1]).map(|x| x as f32).collect()
    };
    let mut bodies: Vec<Vec<f32>> = (0..COUNT).map(body).collect();
    bodies[BROKEN][7] = f32::NAN;
    bodies
}

fn analyse(template: &Template, level: Level, vertices: &[f32]) -> (Vec<u32>, Vec<Vec<[f64; 3]>>) {
    let analysis = Analysis::new("pcom", "paper", &OPTIONS, &[985.0]).unwrap();
    let batch = batch(template, level, vertices);
    let mut rows = vec![0.0; batch.len() * analysis.size(template)];
    let polygons = batch.analysis_into(&analysis, &mut rows).unwrap();
    (rows.iter().map(|x| (x + 0.0).to_bits()).collect(), polygons)
}

#[test]
fn lanes_are_bodies() {
    let (template, vertices) = common::template(2, 300);
    let bodies = bodies(&vertices);
    for level in Level::available() {
        let (rows, polygons) = analyse(&template, level, &bodies.concat());
        let size = rows.len() / COUNT;
        for (body, vertices) in bodies.iter().enumerate() {
            let alone = analyse(&template, level, vertices);
            assert!(rows[body * size..][..size] == alone.0, "body {body}, {}", level.name());
            assert!(polygons[body] == alone.1[0], "polygon of body {body}, {}", level.name());
        }
        assert!(rows[BROKEN * size..][..size].iter().all(|&bits| f32::from_bits(bits).is_nan()));
        assert!(polygons[BROKEN].is_empty() && !polygons[0].is_empty());
    }
}

struct Values<'a>(Batch<'a, f32>);

impl Visitor for Values<'_> {
    type Output = Vec<f32>;
    fn visit<Q: Quantity>(self, quantity: Q) -> Vec<f32> {
        self.0.value(&quantity).unwrap()
    }
}

/// To the bit: the formulas are the same ones.
#[test]
fn every_figure_is_its_own_quantity() {
    let (template, vertices) = common::template(2, 300);
    let together = bodies(&vertices).concat();
    for level in Level::available() {
        let (rows, polygons) = analyse(&template, level, &together);
        let size = rows.len() / COUNT;
        let figure = |body: usize, at: usize| f32::from_bits(rows[body * size + at]);
        let quantities: [(&str, &[f64], usize); 10] = [
            ("support_margin.paper.pcom", &[0.1], 3),
            ("stability_loss.pcom", &[100.0, 10.0, 0.0], 7),
            ("ground_loss.samples.tanh_squared", &[1.0, 0.15, 10.0, 0.15], 8),
            ("balance_cost.log.pcom", &[100.0, 50.0, 0.02], 10),
            ("center_of_mass.pcom", &[], 11),
            ("center_of_mass.exact", &[], 14),
            ("center_of_pressure", &[100.0, 10.0, 0.0], 17),
            ("mass_properties", &[985.0], 20),
            ("part_volumes", &[], 34),
            ("pressure", &[100.0, 10.0], 0),
        ];
        for (name, options, start) in quantities {
            let values = named(&template, name, options, Values(batch(&template, level, &together))).unwrap();
            let len = values.len() / COUNT;
            for body in (0..COUNT).filter(|&body| body != BROKEN) {
                let own = &values[body * len..][..len];
                if name == "pressure" {
                    let sum: f64 = own.iter().map(|&x| x as f64).sum();
                    // Sums of 64 samples in single precision.
                    assert!((figure(body, 5) as f64 - sum).abs() <= 2e-6 * sum, "{name} of body {body}");
                    assert_eq!(figure(body, 6), own.iter().copied().fold(0.0, f32::max), "{name} of body {body}");
                    continue;
                }
                for k in 0..len.min(if name == "mass_properties" { 14 } else { len }) {
                    assert_eq!(figure(body, start + k) + 0.0, own[k] + 0.0, "{name} {k} of {body}, {}", level.name());
                }
            }
        }
        let contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };
        let supports = batch(&template, level, &together).base_of_support(&contact, Method::Pcom).unwrap();
        let states = batch(&template, level, &together).status(&contact).unwrap();
        assert_eq!(states[BROKEN], status::NON_FINITE);
        for body in (0..COUNT).filter(|&body| body != BROKEN) {
            assert_eq!(figure(body, 0), states[body] as f32);
            assert_eq!(figure(body, 1), supports[body].num_contacts as f32);
            assert_eq!(figure(body, 2), supports[body].area as f32);
            assert_eq!(polygons[body], supports[body].polygon);
        }
    }
}

#[test]
fn bad_options_are_refused() {
    let (template, vertices) = common::template(1, 50);
    assert!(Analysis::new("pcom", "paper", &OPTIONS[1..], &[985.0]).is_err());
    assert!(Analysis::new("pcom", "paper", &[f64::NAN; 10], &[985.0]).is_err());
    assert!(Analysis::new("pcom", "paper", &OPTIONS, &[]).is_err());
    assert!(Analysis::new("middle", "paper", &OPTIONS, &[985.0]).is_err());
    let analysis = Analysis::new("pcom", "paper", &OPTIONS, &[985.0, 900.0]).unwrap();
    let body: Vec<f32> = vertices.as_flattened().iter().map(|&x| x as f32).collect();
    let mut row = vec![0.0; analysis.size(&template)];
    let error = batch(&template, Level::Scalar, &body).analysis_into(&analysis, &mut row).unwrap_err();
    assert!(error.to_string().contains("densities: expected 1 or 4"), "{error}");
}
