//! The losses, one per file, unweighted, and the list of those that may be terms of one loss.

pub mod balance;
pub mod ground;
pub mod stability;
pub mod term;
pub mod terms;

// In the order in which their numbers stand. A new term is listed here.
terms::list_of_terms! {
    Stability(stability::StabilityLoss),
    Balance(balance::BalanceCost),
    Ground(ground::GroundLoss),
}
