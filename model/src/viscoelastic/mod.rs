//! Viscoelastic force models.
