//! What a picture's colours are.

use std::sync::Arc;

/// Red, green and blue as a display takes them (sRGB).
pub type Rgb = [u8; 3];

/// Colours of values, from the least to the greatest.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourRamp(Arc<[Rgb]>);

/// The texels of a ramp.
pub(crate) const RAMP: usize = 256;
/// Nine colours of viridis, in equal steps (van der Walt and Smith, matplotlib 1.5; in the public domain, CC0).
const VIRIDIS: [Rgb; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

impl ColourRamp {
    /// Of colours in equal steps; grey of none, and one colour of one.
    #[must_use]
    pub fn new(colours: &[Rgb]) -> Self {
        match colours {
            [] => Self(Arc::new([[128; 3]])),
            some => Self(some.into()),
        }
    }

    /// The colour at a share of the range from 0 to 1.
    #[must_use]
    pub fn at(&self, share: f64) -> Rgb {
        let last = self.0.len() - 1;
        let place = share.clamp(0.0, 1.0) * last as f64;
        // A share that is no number has the first colour.
        let low = place as usize;
        let (from, to) = (self.0[low], self.0[(low + 1).min(last)]);
        let part = place - low as f64;
        [0, 1, 2].map(|channel| {
            let [from, to] = [from, to].map(|colour| f64::from(colour[channel]));
            (from + part * (to - from)).round() as u8
        })
    }

    pub(crate) fn texels(&self) -> Vec<u8> {
        let colours = (0..RAMP).map(|texel| self.at(texel as f64 / (RAMP - 1) as f64));
        colours.flat_map(|[red, green, blue]| [red, green, blue, 255]).collect()
    }
}

impl Default for ColourRamp {
    fn default() -> Self {
        Self::new(&VIRIDIS)
    }
}

/// What the colours of the surface stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceColours {
    /// Moist tissue. Its texture of moisture and vessels is no data.
    Tissue { has_texture: bool },
    /// The values of the nodes, from the least to the greatest colour. A field without values is drawn as tissue.
    Values { range: [f64; 2] },
}

/// How a picture looks.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceStyle {
    pub colours: SurfaceColours,
    pub ramp: ColourRamp,
    /// Distance of the lines of equal depth in mm; `None` for no lines.
    pub contour_mm: Option<f64>,
    /// How high the sides of the block are drawn, in mm below rest; zero for no sides.
    pub thickness_mm: f64,
    /// What is behind the scene: the colour of the panel that the picture is in.
    pub background: Rgb,
    /// Colour of the lines of equal depth.
    pub ink: Rgb,
}

impl SurfaceStyle {
    /// Before a light panel.
    pub const LIGHT: Rgb = [244, 244, 242];
    /// Before a dark panel.
    pub const DARK: Rgb = [24, 26, 29];

    /// Moist tissue before a background.
    #[must_use]
    pub fn tissue(background: Rgb) -> Self {
        Self {
            colours: SurfaceColours::Tissue { has_texture: true },
            ramp: ColourRamp::default(),
            contour_mm: None,
            thickness_mm: 0.0,
            background,
            ink: [255, 255, 255],
        }
    }

    /// The values of the nodes as colours before a background.
    #[must_use]
    pub fn values(range: [f64; 2], background: Rgb) -> Self {
        Self { colours: SurfaceColours::Values { range }, ..Self::tissue(background) }
    }
}

/// Linear light of a colour of a display (IEC 61966-2-1).
pub(crate) fn linear([red, green, blue]: Rgb) -> [f64; 3] {
    [red, green, blue].map(|value| {
        let share = f64::from(value) / 255.0;
        if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_its_colours_and_what_is_between() {
        let ramp = ColourRamp::new(&[[0, 0, 0], [100, 200, 50], [255, 255, 255]]);
        assert_eq!(ramp.at(0.5), [100, 200, 50]);
        assert_eq!(ramp.at(0.25), [50, 100, 25]);
        assert_eq!(ramp.at(7.0), [255, 255, 255]);
        assert_eq!(ramp.at(f64::NAN), [0, 0, 0]);
        assert_eq!(ramp.texels().len(), 4 * RAMP);
        assert_eq!(ColourRamp::new(&[]).at(0.3), [128; 3]);
    }

    #[test]
    fn light_of_the_ends_is_none_and_all() {
        assert_eq!(linear([0, 255, 0]), [0.0, 1.0, 0.0]);
        // The middle grey of the standard.
        assert!((linear([188; 3])[0] - 0.5029).abs() < 1e-4);
    }
}
