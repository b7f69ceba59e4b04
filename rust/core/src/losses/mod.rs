//! The losses, one per file, unweighted, and the list of those that may be terms of one loss.

pub mod balance;
pub mod ground;
mod list;
pub mod stability;
pub mod term;
pub mod terms;

// In the order in which their numbers stand. A new term is listed here.
list::list_of_terms! {
    Stability(stability::StabilityLoss),
    Balance(balance::BalanceCost),
    Ground(ground::GroundLoss),
}
