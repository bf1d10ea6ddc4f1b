//! What is claimed of a design, and what is known of it.
//!
//! A [`Claim`] is identified by its [`ClaimKind`] and the [`Subject`] it is about; the sentence that front ends print is made from
//! these and never read back. A claim rests on other claims, its premises: the cost bound on a set rests on the set's invariance, and
//! that on the inputs that do not saturate there. [`settle`] carries the verdicts on premises over: what rests on something that
//! is not proved is not proved.

mod kind;
mod premises;
mod statement;
mod subject;
mod verdict;
mod witness;
mod words;

pub use kind::{ClaimKind, Motion};
pub use premises::settle;
pub use statement::{Claim, worst};
pub use subject::{ClaimId, Member, Of, Subject};
pub use verdict::Verdict;
pub use witness::Witness;
pub use words::Words;
