//! Signal processing for contact, filters and plots.
