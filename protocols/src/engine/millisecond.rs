//! What a rig that samples faster than once a millisecond felt in each: searches and rates judge that, at any rate.
//!
//! Criteria, noise they stand above and numbers in a row are weighed against each other for a sample a millisecond. Of
//! a rig that takes no more, each sample is its own mean, to the bit.

use palpate_model::rig::RigDescription;

/// Samples being averaged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Millisecond {
    samples: u32,
    count: u32,
    position: f64,
    force: f64,
}

impl Millisecond {
    /// For the samples of a rig.
    pub fn of(rig: &RigDescription) -> Self {
        Self { samples: rig.samples_per_ms(), count: 0, position: 0.0, force: 0.0 }
    }

    /// Takes a sample's position in mm and force in N; their means, once the millisecond is complete.
    pub fn push(&mut self, position: f64, force: f64) -> Option<(f64, f64)> {
        self.count += 1;
        self.position += position;
        self.force += force;
        if self.count < self.samples {
            return None;
        }
        let count = f64::from(self.count);
        let means = (self.position / count, self.force / count);
        (self.count, self.position, self.force) = (0, 0.0, 0.0);
        Some(means)
    }

    /// Begins anew.
    pub fn clear(&mut self) {
        (self.count, self.position, self.force) = (0, 0.0, 0.0);
    }
}
