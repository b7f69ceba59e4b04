//! The list of all quantities by name.

use crate::error::{Error, Result};
use crate::losses::AnyTerm;
use crate::losses::term::{Term, TermVisitor};
use crate::losses::terms::Terms;
use crate::mass::{CenterOfMass, Method};
use crate::mass_properties::MassProperties;
use crate::pressure::{CenterOfPressure, Pressure, PressureCurve};
use crate::quantity::Quantity;
use crate::sample_surface::SampleSurface;
use crate::support::{Contact, ContactRule, SupportMargin};
use crate::template::Template;
use crate::volume::PartVolumes;

/// Calls `visitor` with the quantity of this name and these options. A new quantity is registered here, but for the
/// losses, which have a list of their own ([`crate::losses`]).
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
        (["terms", words @ ..], o) => visitor.visit_terms(Terms::named(words, o)?),
        ([loss, modes @ ..], o) => {
            return AnyTerm::visit_alone(loss, modes, o, Alone(visitor)).unwrap_or_else(|| Err(unknown()));
        }
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

/// A loss by itself, as any other quantity.
struct Alone<V>(V);

impl<V: Visitor> TermVisitor for Alone<V> {
    type Output = V::Output;

    fn visit<T: Term>(self, term: T) -> V::Output {
        self.0.visit(term)
    }
}
