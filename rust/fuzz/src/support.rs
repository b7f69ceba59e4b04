//! Support: the hull holds every contact, and the margin's sign is that of the paper's linear programme.

use crate::body::{Surface, poses};
use crate::source::Source;
use ipman::mass::Method;
use ipman::support::hull::{area, convex_hull};
use ipman::support::program::is_convex_combination;
use ipman::support::{Contact, ContactRule};
use ipman::{Batch, Template};

pub fn run(data: &[u8]) {
    let mut source = Source(data);
    hulls(&mut source);
    bodies(&mut source);
}

/// Points in the plane, many of them on a coarse grid: repeated and collinear.
fn hulls(source: &mut Source) {
    let grid = f64::from(1 + source.byte() % 8);
    let coarse = source.byte().is_multiple_of(2);
    let mut coordinate = || if coarse { (source.unit() * grid).round() } else { source.unit() };
    let points: Vec<[f64; 2]> = (0..24).map(|_| [coordinate(), coordinate()]).collect();
    let corners: Vec<_> = convex_hull(&points).into_iter().map(|i| points[i]).collect();
    assert!(area(&corners) >= 0.0);
    let mean = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / points.len() as f64);
    for point in &points {
        for k in 0..if corners.len() > 2 { corners.len() } else { 0 } {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            let left = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
            assert!(left >= -1e-13, "{point:?} lies outside of {a:?} {b:?}");
        }
        // Just inside, for on the boundary rounding decides; on a line all is boundary.
        let inside = [0, 1].map(|k| mean[k] + (1.0 - 1e-6) * (point[k] - mean[k]));
        assert!(area(&corners) < 1e-3 || is_convex_combination(&points, inside), "{inside:?} of {points:?}");
    }
}

fn bodies(source: &mut Source) {
    let surface = Surface::consistent(source);
    let Ok(template) = Template::new(&surface.points, &surface.faces, &surface.parts, 100, 1) else { return };
    let count = 1 + source.below(3);
    let vertices = poses(&surface, source, count);
    let (normals, heights) = ([0.0, 1.0, 0.0].repeat(count), vec![0.0; count]);
    let batch = Batch::new(&template, &vertices, &normals, &heights, &|| false).expect("of the template's shape");
    let contact = Contact { rule: ContactRule::Paper, threshold: 0.02 };
    for method in [Method::Pcom, Method::Exact] {
        let supports = batch.base_of_support(&contact, method).expect("good options");
        let supported = batch.is_supported_lp(&contact, method).expect("good options");
        for (support, supported) in supports.iter().zip(supported) {
            // The programme knows the hull to a share of its length, of which a needle's area says nothing.
            let size = support.polygon.iter().flatten().fold(1.0, |most: f64, x| most.max(x.abs()));
            if support.margin.is_finite() && support.margin.abs() > 1e-6 * size {
                assert_eq!(support.inside(), supported, "margin {}", support.margin);
            }
        }
    }
}
