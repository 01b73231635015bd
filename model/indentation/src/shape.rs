//! Shapes of indenters.

/// A rigid indenter with an axis of symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IndenterShape {
    /// The flat end of a cylinder.
    FlatPunch { radius_mm: f64 },
    /// A sphere that is large against the contact: its surface counts as a parabola (Hertz 1882).
    Parabola { radius_mm: f64 },
    /// A sphere at any depth up to its radius (Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57).
    Sphere { radius_mm: f64 },
    /// A cone whose flank stands at this angle from its axis.
    Cone { half_angle_rad: f64 },
}

/// A contact at a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Radius in mm of the circle in which indenter and specimen touch.
    pub radius_mm: f64,
    /// Force over Young's modulus, in mm².
    pub force_over_modulus: f64,
}
