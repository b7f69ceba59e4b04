//! The list of all quantities by name.

use crate::error::{Error, Result};
use crate::losses::balance::BalanceCost;
use crate::losses::ground::GroundLoss;
use crate::losses::stability::StabilityLoss;
use crate::losses::term::Named;
use crate::losses::terms::Terms;
use crate::mass::{CenterOfMass, Method};
use crate::mass_properties::MassProperties;
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
        (["stability_loss", modes @ ..], o) if is_described::<StabilityLoss>(modes, o) => {
            visitor.visit(StabilityLoss::named(modes, o)?)
        }
        (["ground_loss", modes @ ..], o) if is_described::<GroundLoss>(modes, o) => {
            visitor.visit(GroundLoss::named(modes, o)?)
        }
        (["balance_cost", modes @ ..], o) if is_described::<BalanceCost>(modes, o) => {
            visitor.visit(BalanceCost::named(modes, o)?)
        }
        (["terms", words @ ..], o) => visitor.visit_terms(Terms::named(words, o)?),
        _ => return Err(unknown()),
    })
}

/// A computation on a quantity whose type depends on a name that is known only at run time.
pub trait Visitor {
    type Output;
    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output;

    /// For visitors that treat the terms of a loss differently.
    fn visit_terms(self, terms: Terms) -> Self::Output
    where
        Self: Sized,
    {
        self.visit(terms)
    }
}

/// Whether a loss takes so many modes and options.
fn is_described<T: Named>(modes: &[&str], options: &[f64]) -> bool {
    modes.len() == T::DESCRIPTION.modes.len() && options.len() == T::DESCRIPTION.options.len()
}
