//! Contact laws: the force of a rigid, frictionless indenter in an elastic or viscoelastic specimen, how far each law holds, and
//! the relaxation modulus of a record.
//!
//! `scripts/contact-oracle` compares the forces with finite elements.
//!
//! This crate never reads a file or a clock and starts no thread. Start reading at [`IndenterShape`] and [`ContactLaw`].

mod document;
mod fit;
mod half_space;
mod hayes;
mod invalid_value;
mod layer;
mod load_curve;
mod quadrature;
mod shape;
mod superposition;
mod triangle;
mod validity;
mod viscoelastic;

pub use document::{Indenter, PoissonBasis, PyramidFaces, Quantity, Specimen};
pub use fit::{
    LoadingFit, LoadingFitError, LoadingKnowledge, LoadingSample, ModulusTerm, RELATIVE_ERROR_MAX,
    RelaxationFamily, RelaxationFit, RelaxationFitError, TERMS_MAX, UnloadingFit,
    UnloadingFitError, fit_loading, fit_relaxation, fit_unloading, vary_uncertain_numbers,
};
pub use hayes::HayesFactor;
pub use invalid_value::InvalidValue;
pub use layer::{Base, Layer, LayerError};
pub use shape::{Contact, IndenterShape};
pub use superposition::{
    Arrhenius, LawRefusal, MasterCurve, ModulusError, Plot, SuperpositionError, Sweep,
    SweepOverlap, SweepSine, WilliamsLandelFerry, master_curve,
};
pub use validity::{Bounded, ContactError, ContactLaw, Validity};
pub use viscoelastic::{
    CreepSeries, CreepTerm, DepthHistory, HistoryError, LoadHistoryError, PowerLaw, RelaxationMode,
    RelaxationModulus, lee_radok_force, lee_radok_force_of, load_and_slope, load_history,
    repeated_contact_force, ting_force,
};
