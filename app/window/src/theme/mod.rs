//! How the window looks: colour tokens and the type scale, applied once at the start.

use eframe::egui::{
    Context, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, RichText, Stroke, Style,
    TextStyle, Theme, ThemePreference, Visuals, vec2,
};
use lucide_icons::{Icon, LUCIDE_FONT_BYTES};
pub use palpate_figures::tokens::Tokens;

/// Text style of the numbers read from across the room.
#[must_use]
pub fn reading_style() -> TextStyle {
    TextStyle::Name("reading".into())
}

/// Sets both themes and starts with the light one: tissue laboratories are lit rooms.
pub fn apply(ctx: &Context) {
    for theme in [Theme::Light, Theme::Dark] {
        let tokens = Tokens::of(theme == Theme::Dark);
        ctx.set_visuals_of(theme, visuals(theme, tokens));
        ctx.style_mut_of(theme, set_type);
    }
    ctx.set_theme(ThemePreference::Light);
    ctx.set_fonts(fonts());
}

/// Family of the icons.
const ICONS: &str = "icons";
/// Size of an icon in points.
const ICON_SIZE: f32 = 19.0;

/// The fonts of egui and the icons of Lucide (lucide.dev, ISC licence).
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let data = FontData::from_static(LUCIDE_FONT_BYTES);
    fonts.font_data.insert(ICONS.to_owned(), data.into());
    fonts.families.insert(FontFamily::Name(ICONS.into()), vec![ICONS.to_owned()]);
    // The font of words has no raised minus; that of numbers has.
    let numbers = fonts.families.get(&FontFamily::Monospace).and_then(|all| all.first().cloned());
    let words = fonts.families.entry(FontFamily::Proportional).or_default();
    words.extend(numbers);
    fonts
}

/// An icon as text; whatever has it needs an accessible name, since a screen reader cannot read an icon.
#[must_use]
pub fn icon_text(icon: Icon) -> RichText {
    let font = FontId::new(ICON_SIZE, FontFamily::Name(ICONS.into()));
    RichText::new(char::from(icon)).font(font)
}

/// The colour in which the window is cleared: that of a canvas, on which plots and tables stand.
pub fn clear_color(visuals: &Visuals) -> [f32; 4] {
    visuals.extreme_bg_color.to_normalized_gamma_f32()
}

pub fn switch(ctx: &Context) {
    ctx.set_theme(match ctx.theme() {
        Theme::Dark => Theme::Light,
        Theme::Light => Theme::Dark,
    });
}

fn visuals(theme: Theme, tokens: &Tokens) -> Visuals {
    let mut visuals = theme.default_visuals();
    visuals.panel_fill = tokens.panel;
    visuals.window_fill = tokens.panel;
    visuals.extreme_bg_color = tokens.canvas;
    visuals.text_edit_bg_color = Some(tokens.canvas);
    visuals.weak_text_color = Some(tokens.text_quiet);
    visuals.error_fg_color = tokens.alarm_text;
    visuals.warn_fg_color = tokens.alarm_text;
    visuals.selection.bg_fill = tokens.selection;
    visuals.selection.stroke = Stroke::new(1.0, tokens.text);
    let widgets = &mut visuals.widgets;
    for (widget, fill) in [
        (&mut widgets.noninteractive, tokens.panel),
        (&mut widgets.inactive, tokens.control),
        (&mut widgets.hovered, tokens.control_hover),
        (&mut widgets.active, tokens.control_hover),
        (&mut widgets.open, tokens.control_hover),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = Stroke::new(1.0, tokens.line);
        widget.fg_stroke = Stroke::new(1.0, tokens.text);
        widget.corner_radius = CornerRadius::same(3);
        widget.expansion = 0.0;
    }
    // The focused control must be seen by those who work with the keyboard alone.
    widgets.hovered.bg_stroke = Stroke::new(1.0, tokens.text_quiet);
    widgets.active.bg_stroke = Stroke::new(2.0, tokens.focus);
    visuals
}

fn set_type(style: &mut Style) {
    let size = |points: f32, family: FontFamily| FontId::new(points, family);
    style.text_styles = [
        (TextStyle::Small, size(14.0, FontFamily::Proportional)),
        (TextStyle::Body, size(15.0, FontFamily::Proportional)),
        (TextStyle::Button, size(15.0, FontFamily::Proportional)),
        (TextStyle::Heading, size(17.0, FontFamily::Proportional)),
        (TextStyle::Monospace, size(14.0, FontFamily::Monospace)),
        (reading_style(), size(24.0, FontFamily::Monospace)),
    ]
    .into();
    style.spacing.item_spacing = vec2(6.0, 4.0);
    style.spacing.button_padding = vec2(8.0, 4.0);
    style.spacing.interact_size.y = 28.0;
    // Nothing slides or fades on an instrument; it also keeps an idle window from repainting.
    style.animation_time = 0.0;
}

/// Characters of sentences, and those that only numbers read from afar have.
const SENTENCE_CHARS: std::ops::RangeInclusive<char> = ' '..='~';
const READING_CHARS: &str = "-.0123456789";

/// Times a character is laid out in a row, so that it falls on each of the four fractions of a
/// pixel at which egui keeps a picture of it.
const REPEATS: usize = 6;

/// Draws every character of every size into the font atlas. Called in the first frame: a word
/// that first appears in a run would else cost a frame of it several milliseconds.
pub fn warm_up_fonts(ctx: &Context) {
    let style = ctx.global_style();
    for (name, font) in &style.text_styles {
        let text: String = if *name == reading_style() {
            READING_CHARS.chars().flat_map(repeated).collect()
        } else {
            SENTENCE_CHARS.flat_map(repeated).collect()
        };
        let color = style.visuals.text_color();
        ctx.fonts_mut(|fonts| fonts.layout_no_wrap(text, font.clone(), color));
    }
}

fn repeated(character: char) -> impl Iterator<Item = char> {
    std::iter::repeat_n(character, REPEATS)
}
