//! Prints a body's figures from Rust alone: `cargo run --release --example analyze -- BODY.obj [HEIGHT]`.
//!
//! The mesh is one part in metres with y up; the ground lies at HEIGHT, or under the lowest vertex.

use ipman::losses::ground::{GroundLoss, Tanh};
use ipman::losses::stability::StabilityLoss;
use ipman::mass::{CenterOfMass, Method};
use ipman::mass_properties::MassProperties;
use ipman::points::Points;
use ipman::pressure::{CenterOfPressure, PressureCurve};
use ipman::support::{Contact, ContactRule};
use ipman::{Batch, Template};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, rest @ ..] = arguments.as_slice() else {
        return Err("usage: analyze BODY.obj [HEIGHT]".into());
    };
    let (vertices, faces) = read(path)?;
    let lowest = vertices.iter().map(|v| v[1]).fold(f64::INFINITY, f64::min);
    let height = rest.first().map_or(Ok(lowest), |text| text.parse())?;

    let template = Template::new(&vertices, &faces, &[], 20_000, 0)?;
    let data = vertices.as_flattened();
    let never = || false;
    let batch = Batch::new(&template, data, &[0.0, 1.0, 0.0], &[height], &never)?;
    let pressure = CenterOfPressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 }, epsilon: 0.0 };
    let ground = GroundLoss {
        points: Points::Samples,
        tanh: Tanh::Squared,
        alpha1: 1.0,
        alpha2: 0.15,
        beta1: 10.0,
        beta2: 0.15,
    };
    let contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };

    let solid = batch.value(&MassProperties { densities: vec![985.0] })?;
    let support = &batch.base_of_support(&contact, Method::Exact)?[0];
    let losses = batch.value(&ground)?;
    println!(
        "body        {} vertices, {} faces, watertight: {}",
        vertices.len(),
        faces.len(),
        template.mesh.watertight
    );
    println!("ground      y = {height:.4} m");
    println!("volume      {:.6} m³, mass {:.2} kg at 985 kg/m³", solid[0], solid[1]);
    println!("CoM         {} m", show(&batch.value(&CenterOfMass { method: Method::Exact })?));
    println!("CoP         {} m", show(&batch.value(&pressure)?));
    println!("support     {:.4} m², {} contacts, margin {:.4} m", support.area, support.num_contacts, support.margin);
    println!("BoSE        {}", if support.inside() { "stable" } else { "unstable" });
    let stability = batch.value(&StabilityLoss { method: Method::Exact, pressure })?;
    println!("losses      stability {:.5}, pull {:.5}, push {:.5}", stability[0], losses[0], losses[1]);
    Ok(())
}

type Mesh = (Vec<[f64; 3]>, Vec<[i64; 3]>);

/// All objects of an OBJ file as one mesh.
fn read(path: &str) -> Result<Mesh, Box<dyn Error>> {
    let options = tobj::LoadOptions { triangulate: true, single_index: false, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options)?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for model in models {
        let first = vertices.len() as i64;
        vertices.extend(model.mesh.positions.chunks_exact(3).map(|p| [p[0] as f64, p[1] as f64, p[2] as f64]));
        faces.extend(model.mesh.indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]].map(|i| first + i as i64)));
    }
    Ok((vertices, faces))
}

fn show(point: &[f64]) -> String {
    format!("({:.4}, {:.4}, {:.4})", point[0], point[1], point[2])
}
