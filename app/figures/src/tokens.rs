//! Every colour of the window. Greys by default; a saturated colour means "look here".

use ecolor::Color32;

/// The colours of one theme, by use.
#[derive(Clone, Debug, PartialEq)]
pub struct Tokens {
    /// Behind everything.
    pub panel: Color32,
    /// Behind plots, text fields and the log.
    pub canvas: Color32,
    /// A control at rest.
    pub control: Color32,
    /// A control under the pointer or pressed.
    pub control_hover: Color32,
    /// Hairlines, frames and grids.
    pub line: Color32,
    pub text: Color32,
    /// Labels, units, remarks.
    pub text_quiet: Color32,
    /// Selected text and toggles.
    pub selection: Color32,
    /// Keyboard focus.
    pub focus: Color32,
    /// A run under way: strong but grey.
    pub active_fill: Color32,
    pub on_active: Color32,
    /// Something waits for the operator.
    pub notice_fill: Color32,
    pub on_notice: Color32,
    /// Something is wrong, and the stop control while motion is possible.
    pub alarm_fill: Color32,
    pub on_alarm: Color32,
    /// Sentences about what is wrong, on `panel` and `canvas`.
    pub alarm_text: Color32,
    /// Measured force: Okabe-Ito blue or sky blue.
    pub series: Color32,
    /// Interlock limits in plots: Okabe-Ito vermilion.
    pub limit: Color32,
    /// Sessions laid over each other, in turn: Okabe-Ito, darkened where a lit ground needs it, the ink, and what is
    /// furthest from these for eyes with and without red-green blindness.
    pub sessions: [Color32; 10],
    /// Shading of every other phase in plots; translucent, so the grid shows through.
    pub phase_band: Color32,
    /// The part of [`viridis`] that stands out from `canvas` as a line.
    pub ordered: [f32; 2],
}

const fn grey(level: u8) -> Color32 {
    Color32::from_gray(level)
}

/// For lit rooms.
pub const LIGHT: Tokens = Tokens {
    panel: grey(0xF0),
    canvas: grey(0xFC),
    control: grey(0xE0),
    control_hover: grey(0xD2),
    line: grey(0xC4),
    text: grey(0x1C),
    text_quiet: grey(0x58),
    selection: grey(0xC8),
    focus: Color32::from_rgb(0x00, 0x72, 0xB2),
    active_fill: grey(0x3A),
    on_active: grey(0xFF),
    notice_fill: Color32::from_rgb(0xE6, 0x9F, 0x00),
    on_notice: grey(0x10),
    alarm_fill: Color32::from_rgb(0xB4, 0x23, 0x18),
    on_alarm: grey(0xFF),
    alarm_text: Color32::from_rgb(0xA3, 0x1E, 0x12),
    series: Color32::from_rgb(0x00, 0x72, 0xB2),
    limit: Color32::from_rgb(0xD5, 0x5E, 0x00),
    sessions: [
        Color32::from_rgb(0x00, 0x72, 0xB2),
        Color32::from_rgb(0xC8, 0x55, 0x00),
        Color32::from_rgb(0x00, 0x80, 0x5C),
        Color32::from_rgb(0xA8, 0x4E, 0x80),
        Color32::from_rgb(0x8A, 0x66, 0x00),
        grey(0x1C),
        Color32::from_rgb(0x77, 0x66, 0xFF),
        Color32::from_rgb(0x66, 0x22, 0x00),
        Color32::from_rgb(0x00, 0x00, 0xB0),
        Color32::from_rgb(0x5E, 0x82, 0x00),
    ],
    phase_band: Color32::from_black_alpha(14),
    ordered: [0.0, 0.45],
};

/// For dim rooms.
pub const DARK: Tokens = Tokens {
    panel: grey(0x24),
    canvas: grey(0x18),
    control: grey(0x38),
    control_hover: grey(0x48),
    line: grey(0x50),
    text: grey(0xE8),
    text_quiet: grey(0xAC),
    selection: grey(0x50),
    focus: Color32::from_rgb(0x56, 0xB4, 0xE9),
    active_fill: grey(0xC8),
    on_active: grey(0x10),
    notice_fill: Color32::from_rgb(0xE6, 0x9F, 0x00),
    on_notice: grey(0x10),
    alarm_fill: Color32::from_rgb(0xC2, 0x2F, 0x22),
    on_alarm: grey(0xFF),
    alarm_text: Color32::from_rgb(0xFF, 0x9C, 0x8A),
    series: Color32::from_rgb(0x56, 0xB4, 0xE9),
    limit: Color32::from_rgb(0xD5, 0x5E, 0x00),
    sessions: [
        Color32::from_rgb(0x56, 0xB4, 0xE9),
        Color32::from_rgb(0xE6, 0x9F, 0x00),
        Color32::from_rgb(0x00, 0x9E, 0x73),
        Color32::from_rgb(0xCC, 0x79, 0xA7),
        Color32::from_rgb(0xF0, 0xE4, 0x42),
        grey(0xE8),
        Color32::from_rgb(0x4D, 0x7D, 0xFF),
        Color32::from_rgb(0xAA, 0xFF, 0x99),
        Color32::from_rgb(0xA0, 0x80, 0xFF),
        Color32::from_rgb(0xBB, 0xAA, 0x66),
    ],
    phase_band: Color32::from_rgba_premultiplied(14, 14, 14, 14),
    ordered: [0.5, 1.0],
};

impl Tokens {
    /// The tokens of a theme.
    #[must_use]
    pub const fn of(is_dark: bool) -> &'static Self {
        if is_dark { &DARK } else { &LIGHT }
    }

    /// Behind a number that is below (-1 to 0) or above (0 to 1) those it is compared with: from the canvas to blue or to
    /// vermilion, which every kind of colour vision tells apart, and never so strong that text is hard to read on it.
    pub fn deviation(&self, share: f32) -> Color32 {
        let ink = if share < 0.0 { self.series } else { self.limit };
        self.canvas.lerp_to_gamma(ink, 0.4 * share.abs().min(1.0))
    }

    /// The line of one of `count` things that have an order, such as cycles.
    pub fn in_order(&self, index: usize, count: usize) -> Color32 {
        let [first, last] = self.ordered;
        let share = index as f32 / count.saturating_sub(1).max(1) as f32;
        viridis(first + share * (last - first))
    }
}

/// Every eighth of viridis (Smith & van der Walt, matplotlib 2015).
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2D, 0x7B],
    [0x3B, 0x52, 0x8B],
    [0x2C, 0x72, 0x8E],
    [0x21, 0x90, 0x8C],
    [0x27, 0xAD, 0x81],
    [0x5D, 0xC8, 0x63],
    [0xAA, 0xDC, 0x32],
    [0xFD, 0xE7, 0x25],
];

/// The colour of a share from 0 to 1: as light as the share is large, for every kind of colour vision.
#[must_use]
pub fn viridis(share: f32) -> Color32 {
    // What is no number is as little as can be.
    let share = if share.is_nan() { 0.0 } else { share };
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f32;
    let index = (place as usize).min(VIRIDIS.len() - 2);
    let part = place - index as f32;
    let [low, high] = [VIRIDIS[index], VIRIDIS[index + 1]];
    let mix = |channel: usize| {
        let [low, high] = [f32::from(low[channel]), f32::from(high[channel])];
        (low + part * (high - low)).round() as u8
    };
    Color32::from_rgb(mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, WCAG 2.2 (<https://www.w3.org/TR/WCAG22/#dfn-relative-luminance>).
    fn luminance(color: Color32) -> f64 {
        let linear = |channel: u8| {
            let value = f64::from(channel) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// A phase's shading as it stands on the canvas.
    fn band(tokens: &Tokens) -> Color32 {
        tokens.canvas.blend(tokens.phase_band)
    }

    #[test]
    fn text_is_readable_on_everything_it_stands_on() {
        assert!((contrast(grey(0), grey(255)) - 21.0).abs() < 1e-9);
        for tokens in [&LIGHT, &DARK] {
            for (text, ground) in [
                (tokens.text, tokens.panel),
                (tokens.text, tokens.canvas),
                (tokens.text, tokens.control),
                (tokens.text, tokens.control_hover),
                (tokens.text, tokens.selection),
                (tokens.text, band(tokens)),
                (tokens.text, tokens.deviation(-1.0)),
                (tokens.text, tokens.deviation(1.0)),
                (tokens.text_quiet, tokens.panel),
                (tokens.text_quiet, tokens.canvas),
                (tokens.text_quiet, band(tokens)),
                (tokens.alarm_text, tokens.panel),
                (tokens.alarm_text, tokens.canvas),
                (tokens.on_active, tokens.active_fill),
                (tokens.on_notice, tokens.notice_fill),
                (tokens.on_alarm, tokens.alarm_fill),
            ] {
                let ratio = contrast(text, ground);
                // WCAG 2.2 success criterion 1.4.3.
                assert!(ratio >= 4.5, "{text:?} on {ground:?} has {ratio:.2}");
            }
        }
    }

    #[test]
    fn lines_in_plots_stand_out_from_their_ground() {
        for tokens in [&LIGHT, &DARK] {
            for line in [tokens.series, tokens.limit]
                .into_iter()
                .chain(tokens.sessions)
                .chain((0..100).map(|index| tokens.in_order(index, 100)))
            {
                for ground in [tokens.canvas, band(tokens)] {
                    // WCAG 2.2 success criterion 1.4.11, graphical objects.
                    assert!(contrast(line, ground) >= 3.0, "{line:?} on {ground:?}");
                }
            }
        }
    }

    #[test]
    fn viridis_grows_lighter_all_the_way() {
        let lightness: Vec<f64> =
            (0..=256).map(|step| luminance(viridis(step as f32 / 256.0))).collect();
        assert!(lightness.windows(2).all(|pair| pair[0] < pair[1] + 0.001));
        assert!(lightness[0] < 0.03 && lightness[256] > 0.75);
        assert_eq!(viridis(f32::NAN), viridis(0.0));
    }
}
