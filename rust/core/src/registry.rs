//! The list of all quantities by name.

use crate::error::{Error, Result};
use crate::losses::balance::{BalanceCost, Wrap};
use crate::losses::ground::{GroundLoss, Tanh};
use crate::losses::stability::StabilityLoss;
use crate::losses::terms::{BalanceTerms, StabilityTerms, Terms};
use crate::mass::{CenterOfMass, Method};
use crate::mass_properties::MassProperties;
use crate::points::Points;
use crate::pressure::{CenterOfPressure, Pressure, PressureCurve};
use crate::quantity::Quantity;
use crate::sample_surface::SampleSurface;
use crate::support::{Contact, ContactRule, SupportMargin};
use crate::template::Template;
use crate::volume::PartVolumes;

/// Calls `visitor` with the quantity of this name and these options. A new quantity is registered here.
pub fn named<V: Visitor>(template: &Template, name: &str, options: &[f64], visitor: V) -> Result<V::Output> {
    let unknown = || Error::UnknownQuantity(format!("{name} with {} options", options.len()));
    let words: Vec<&str> = name.split('.').collect();
    Ok(match (words.as_slice(), options) {
        (["part_volumes"], []) => visitor.visit(PartVolumes),
        (["mass_properties"], densities) if [1, template.mesh.num_parts].contains(&densities.len()) => {
            visitor.visit(MassProperties { densities: densities.to_vec() })
        }
        (["sample_surface"], []) => visitor.visit(SampleSurface),
        (["center_of_mass", m], []) => visitor.visit(CenterOfMass { method: Method::named(m)? }),
        (["pressure"], &[alpha, gamma]) => visitor.visit(Pressure { curve: PressureCurve { alpha, gamma } }),
        (["center_of_pressure"], &[alpha, gamma, epsilon]) => {
            visitor.visit(CenterOfPressure { curve: PressureCurve { alpha, gamma }, epsilon })
        }
        (["support_margin", rule, m], &[threshold]) => {
            let contact = Contact { rule: ContactRule::named(rule)?, threshold };
            visitor.visit(SupportMargin { contact, method: Method::named(m)? })
        }
        (["stability_loss", m], o @ [_, _, _]) => visitor.visit(stability(m, o)?),
        (["ground_loss", points, tanh], o @ [_, _, _, _]) => visitor.visit(ground(points, tanh, o)?),
        (["balance_cost", wrap, m], o @ [_, _, _]) => visitor.visit(balance(wrap, m, o)?),
        (["terms", "stability", m, points, tanh], o @ [_, _, _, _, _, _, _]) => visitor
            .visit_terms(StabilityTerms { stability: stability(m, &o[..3])?, ground: ground(points, tanh, &o[3..])? }),
        (["terms", "balance", wrap, m, points, tanh], o @ [_, _, _, _, _, _, _]) => visitor
            .visit_terms(BalanceTerms { balance: balance(wrap, m, &o[..3])?, ground: ground(points, tanh, &o[3..])? }),
        _ => return Err(unknown()),
    })
}

/// A computation on a quantity whose type depends on a name that is known only at run time.
pub trait Visitor {
    type Output;
    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output;

    /// For visitors that treat the terms of a loss differently.
    fn visit_terms<Q: Terms>(self, quantity: Q) -> Self::Output
    where
        Self: Sized,
    {
        self.visit(quantity)
    }
}

fn stability(method: &str, options: &[f64]) -> Result<StabilityLoss> {
    let &[alpha, gamma, epsilon] = options else { unreachable!("the caller matched three options") };
    let pressure = CenterOfPressure { curve: PressureCurve { alpha, gamma }, epsilon };
    Ok(StabilityLoss { method: Method::named(method)?, pressure })
}

fn ground(points: &str, tanh: &str, options: &[f64]) -> Result<GroundLoss> {
    let &[alpha1, alpha2, beta1, beta2] = options else { unreachable!("the caller matched four options") };
    Ok(GroundLoss { points: Points::named(points)?, tanh: Tanh::named(tanh)?, alpha1, alpha2, beta1, beta2 })
}

fn balance(wrap: &str, method: &str, options: &[f64]) -> Result<BalanceCost> {
    let &[alpha, gamma, sigma] = options else { unreachable!("the caller matched three options") };
    let curve = PressureCurve { alpha, gamma };
    Ok(BalanceCost { method: Method::named(method)?, wrap: Wrap::named(wrap)?, curve, sigma })
}
