//! The dent that the examples draw: 60 mm of tissue on 201 by 201 nodes under a ball of 6 mm radius.

#![allow(dead_code, reason = "each example takes its part")]

use palpate_haptics::scene::SceneSettings;
use palpate_haptics::surface::{
    ContactSide, Grid, HeightField, Surface, SurfaceContact, SurfaceRecovery,
};
use palpate_tissue_view::{Camera, FieldData, Probe};
use std::error::Error;

pub const NODES: usize = 201;
const SIDE_MM: f64 = 60.0;
const RADIUS_MM: f64 = 6.0;
const DEPTH_MM: f64 = 6.5;

pub struct Dent {
    pub field: FieldData,
    pub probe: Probe,
    /// Heights in mm, row by row.
    pub heights: Vec<f64>,
    pub depth_mm: f64,
}

impl Dent {
    /// The haptic surface under every point of the ball at once: the scene's own mesh and limits.
    pub fn haptic() -> Result<Self, Box<dyn Error>> {
        let settings = SceneSettings::default();
        let spacing = SIDE_MM / (NODES - 1) as f64;
        let grid = Grid::new(NODES, NODES, spacing)?;
        let field = HeightField::flat(grid, settings.max_shear_mm)?;
        let mut surface = Surface::new(field, settings.method, SurfaceRecovery::NONE, settings.cut);
        let middle = SIDE_MM / 2.0;
        let mut contacts = Vec::new();
        for index in 0..grid.nodes() {
            let [x, y] = [index % NODES, index / NODES].map(|step| step as f64 * spacing);
            let square = (x - middle).powi(2) + (y - middle).powi(2);
            if square < RADIUS_MM.powi(2) {
                let z = RADIUS_MM - DEPTH_MM - (RADIUS_MM.powi(2) - square).sqrt();
                if z < 0.0 {
                    contacts.push(SurfaceContact { x, y, z, side: ContactSide::Push });
                }
            }
        }
        surface.tick(&contacts);
        let rest = vec![0.0; grid.nodes()];
        Self::of(surface.heights(), &rest, DEPTH_MM)
    }

    /// A rigid ball on an elastic half space (Johnson, "Contact Mechanics", 1985, equations 3.41 and 3.42a): the ball itself within the
    /// radius of contact a, beyond it `((2 a^2 - r^2) asin(a / r) + r^2 (a / r) sqrt(1 - a^2 / r^2)) / (pi R)`.
    pub fn hertz() -> Result<Self, Box<dyn Error>> {
        let depth = 4.5_f64;
        let (middle, spacing) = (SIDE_MM / 2.0, SIDE_MM / (NODES - 1) as f64);
        let contact = (RADIUS_MM * depth).sqrt();
        let height = |index: usize| {
            let [x, y] = [index % NODES, index / NODES].map(|step| step as f64 * spacing - middle);
            let r = x.hypot(y);
            let parabola = depth - r * r / (2.0 * RADIUS_MM);
            if r <= contact {
                return -parabola;
            }
            let share = contact / r;
            let outside = (2.0 * contact.powi(2) - r * r) * share.asin()
                + r * r * share * (1.0 - share * share).sqrt();
            -outside / (std::f64::consts::PI * RADIUS_MM)
        };
        let heights: Vec<f64> = (0..NODES * NODES).map(height).collect();
        Self::of(&heights, &vec![0.0; heights.len()], depth)
    }

    fn of(heights: &[f64], rest: &[f64], depth_mm: f64) -> Result<Self, Box<dyn Error>> {
        let middle = SIDE_MM / 2.0;
        let spacing = SIDE_MM / (NODES - 1) as f64;
        let centre = [middle, middle, RADIUS_MM - depth_mm];
        Ok(Self {
            field: FieldData::new(NODES, spacing, heights)?.with_rest(rest)?,
            probe: Probe::new(centre, RADIUS_MM)?.with_axis([0.22, 0.10, 1.0])?,
            heights: heights.to_vec(),
            depth_mm,
        })
    }

    pub fn spacing_mm(&self) -> f64 {
        SIDE_MM / (NODES - 1) as f64
    }

    pub fn camera(&self) -> Camera {
        let mut camera = Camera::of([SIDE_MM; 2]).looking_at([29.0, 29.0, 2.0]);
        camera.orbit(0.0, -0.06);
        camera.zoom(1.75);
        camera
    }
}
