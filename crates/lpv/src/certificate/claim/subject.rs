//! What a claim is about, and its name within a certificate.

use serde::{Serialize, Serializer};
use std::fmt;

/// Which system of equations a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// The LPV model.
    #[default]
    Model,
    /// The nonlinear plant.
    Plant,
    /// The polytope of the vertices that stand for an LPV model, where the model itself is known.
    Polytope,
}

/// Which part of a design a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Member {
    /// The design itself; of a family the outermost.
    #[default]
    Outer,
    /// The inner design of this number, from 0.
    Inner(usize),
    /// The vertex or grid point of this number, from 0, designed by itself.
    Point(usize),
}

/// What a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Subject {
    /// The system of equations.
    pub of: Of,
    /// The part of the design.
    pub member: Member,
}

/// Name of a claim within a certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClaimId {
    /// [`ClaimKind::name`](super::ClaimKind::name)
    pub name: &'static str,
    /// What it is about.
    pub subject: Subject,
}

impl fmt::Display for ClaimId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.subject.member {
            Member::Outer => {}
            Member::Inner(k) => write!(f, "inner[{k}].")?,
            Member::Point(k) => write!(f, "point[{k}].")?,
        }
        match self.subject.of {
            Of::Model => {}
            Of::Plant => f.write_str("plant.")?,
            Of::Polytope => f.write_str("polytope.")?,
        }
        f.write_str(self.name)
    }
}

impl Serialize for ClaimId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
