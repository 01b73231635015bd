//! Contact laws: the force of a rigid, frictionless indenter in an elastic specimen, over the specimen's modulus.

mod document;
mod half_space;
mod hayes;
mod invalid_value;
mod layer;
mod quadrature;
mod shape;
mod validity;
mod viscoelastic;

pub use document::{Indenter, PoissonBasis, PyramidFaces, Quantity, Specimen};
pub use hayes::HayesFactor;
pub use invalid_value::InvalidValue;
pub use layer::{Base, Layer, LayerError};
pub use shape::{Contact, IndenterShape};
pub use validity::{Bounded, ContactError, ContactLaw, Validity};
pub use viscoelastic::{
    DepthHistory, HistoryError, PowerLaw, PronySeries, PronyTerm, lee_radok_force,
    lee_radok_force_of, ting_force,
};
