//! Identification of force models.
