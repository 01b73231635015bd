//! Contact laws: the force of a rigid, frictionless indenter in an elastic specimen, over the specimen's modulus.

mod half_space;
mod layer;
mod quadrature;
mod shape;

pub use layer::{Base, Layer, LayerError};
pub use shape::{Contact, IndenterShape};
