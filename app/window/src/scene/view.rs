//! The picture of a scene: surface, contact point, stylus and force, and what the pointer and the keys do in it.

use super::camera::{Camera, Lens, Vec3, along};
use super::facets::{SurfaceStyle, colour_depth, facets};
use super::hand::{ToolTarget, stylus};
use crate::theme::Tokens;
use crate::widgets::{NamedControl, tokens_of};
use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Align2, Event, EventFilter, FontId, Key, Painter, PointerButton, Pos2, Rect, Response, Role,
    Sense, Shape, Stroke, TextStyle, Ui, WidgetInfo, pos2, vec2,
};
use palpate_figures::tokens::viridis;
use palpate_haptics::surface::Heights;

/// Name of the picture, for the palette and for who reads the screen aloud.
pub const NAME: &str = "scene picture";
/// The force whose arrow is as long as a quarter of the scene, in N: what an Omni-class device gives at most.
const ARROW_NEWTONS: f64 = 3.3;
/// Forces below this have no arrow, in N.
const ARROW_MIN: f64 = 0.005;
/// Length of the stylus and radius of the contact point, in lengths of the scene.
const STYLUS: f64 = 0.3;
const CONTACT: f64 = 0.012;
/// Radians per point of a drag and per press of a key.
const ORBIT: [f64; 2] = [0.008, 0.1];
/// Zoom per point of the wheel and per press of a key.
const ZOOM: [f64; 2] = [0.002, 1.15];
/// Depth per point of the wheel, in mm.
const WHEEL_MM: f64 = 0.02;
/// Size of the colour bar, and its distance from the edges.
const BAR: [f32; 2] = [12.0, 160.0];
const EDGE: f32 = 12.0;

/// The scene at one moment.
#[derive(Clone, Copy, Debug)]
pub struct ScenePicture<'a> {
    pub now: Heights<'a>,
    /// Its heights at rest, in mm.
    pub rest: &'a [f64],
    /// Where the tip of the device is, in mm.
    pub device: Vec3,
    /// Yaw, pitch and roll of the stylus in rad.
    pub turn: Vec3,
    /// The contact point; `None` without contact.
    pub contact: Option<Vec3>,
    /// Force on the hand, in N.
    pub force: Vec3,
}

/// Camera and hand of a scene.
#[derive(Clone, Debug)]
pub struct SceneView {
    camera: Camera,
    extent: [f64; 2],
    hand: ToolTarget,
    /// Whether the lines of the mesh are drawn.
    pub has_lines: bool,
    /// The deepest depth since the scene began: colours do not change their meaning while one looks.
    deepest: f64,
}

impl SceneView {
    /// Of a surface of these lengths in mm.
    #[must_use]
    pub fn of(extent: [f64; 2]) -> Self {
        Self {
            camera: Camera::of(extent),
            extent,
            hand: ToolTarget::above(extent),
            has_lines: false,
            deepest: 0.0,
        }
    }

    /// Where the pointer and the keys want the tool.
    pub fn hand(&self) -> &ToolTarget {
        &self.hand
    }

    pub fn reset(&mut self) {
        self.camera = Camera::of(self.extent);
    }

    /// Draws the scene in the space there is; the hand follows pointer and keys.
    pub fn ui(&mut self, ui: &mut Ui, shown: &ScenePicture) -> Response {
        let size = ui.available_size().max(vec2(80.0, 80.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let response = response.named(NAME);
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, NAME));
        self.take_pointer(ui, &response, rect);
        self.take_keys(ui, &response);
        if ui.is_rect_visible(rect) {
            let painter = ui.painter().with_clip_rect(rect);
            self.paint(&painter, ui, rect, shown);
            if response.has_focus() {
                let focus = Stroke::new(1.5, tokens_of(ui).focus);
                painter.rect_stroke(rect.shrink(1.0), 2.0, focus, eframe::egui::StrokeKind::Inside);
            }
        }
        response
    }

    fn take_pointer(&mut self, ui: &Ui, response: &Response, rect: Rect) {
        let (wheel, seconds) =
            ui.input(|input| (f64::from(input.smooth_scroll_delta.y), input.stable_dt));
        let presses = response.is_pointer_button_down_on()
            && ui.input(|input| input.pointer.button_down(PointerButton::Primary));
        let turns = [PointerButton::Secondary, PointerButton::Middle];
        if turns.iter().any(|&button| response.dragged_by(button)) {
            let by = response.drag_delta();
            self.camera.orbit(-ORBIT[0] * f64::from(by.x), ORBIT[0] * f64::from(by.y));
        }
        let pointer = response.hover_pos().or(response.interact_pointer_pos());
        // A pointer that rests leaves the hand to the keys.
        let is_moved = ui.input(|input| {
            let mut events = input.events.iter();
            events.any(|event| matches!(event, Event::PointerMoved(_)))
        });
        if let Some(at) = pointer.filter(|_| presses || is_moved)
            && let Some(place) = self.camera.lens(rect).pick(at, 0.0)
        {
            self.hand.go(place);
        }
        if presses {
            response.request_focus();
            self.hand.press(f64::from(seconds));
            self.hand.rise(WHEEL_MM * wheel);
        } else if response.drag_stopped_by(PointerButton::Primary) || response.clicked() {
            self.hand.lift();
        }
        if !presses && response.hovered() && wheel != 0.0 {
            self.camera.zoom((ZOOM[0] * wheel).exp());
        }
    }

    fn take_keys(&mut self, ui: &Ui, response: &Response) {
        if !response.has_focus() {
            return;
        }
        // Arrows would go to the next field.
        let filter = EventFilter {
            horizontal_arrows: true,
            vertical_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let pressed: Vec<(Key, bool)> = ui.input(|input| {
            let keys = input.events.iter().filter_map(|event| match event {
                Event::Key { key, pressed: true, modifiers, .. }
                    if !modifiers.command && !modifiers.alt =>
                {
                    Some((*key, modifiers.shift))
                }
                _ => None,
            });
            keys.collect()
        });
        for (key, has_shift) in pressed {
            match (key, has_shift) {
                (Key::ArrowLeft, true) => self.camera.orbit(ORBIT[1], 0.0),
                (Key::ArrowRight, true) => self.camera.orbit(-ORBIT[1], 0.0),
                (Key::ArrowUp, true) => self.camera.orbit(0.0, ORBIT[1]),
                (Key::ArrowDown, true) => self.camera.orbit(0.0, -ORBIT[1]),
                (Key::Plus | Key::Equals, _) => self.camera.zoom(ZOOM[1]),
                (Key::Minus, _) => self.camera.zoom(1.0 / ZOOM[1]),
                (Key::Home, _) => self.reset(),
                (key, _) => {
                    self.hand.key(key, &self.camera);
                }
            }
        }
    }

    fn paint(&mut self, painter: &Painter, ui: &Ui, rect: Rect, shown: &ScenePicture) {
        let tokens = tokens_of(ui);
        let font = TextStyle::Small.resolve(ui.style());
        let lens = self.camera.lens(rect);
        let size = self.extent[0].max(self.extent[1]);
        let look = SurfaceStyle {
            deepest: colour_depth(self.deepest),
            // White in both themes: the colours before which they stand are the same.
            lines: self.has_lines.then_some(tokens.on_alarm.gamma_multiply(0.5)),
        };
        let [x, y, _] = shown.contact.unwrap_or(shown.device);
        let tool = shown.now.grid().nearest(x, y);
        let drawn = facets(shown.now, shown.rest, &lens, look, rect.height(), tool);
        self.deepest = self.deepest.max(drawn.deepest);
        painter.add(Shape::mesh(drawn.mesh));
        // The stylus is above what it touches; the force is drawn before both.
        stylus_shape(painter, &lens, shown, size, tokens);
        if let Some(seen) = shown.contact.and_then(|contact| lens.see(contact)) {
            let radius = (CONTACT * size * lens.points_per_mm(seen.distance)) as f32;
            painter.circle(seen.at, radius.max(3.0), tokens.canvas, Stroke::new(1.5, tokens.text));
        }
        force_shape(painter, &lens, shown, size, tokens, &font);
        bar_shape(painter, rect, look.deepest, tokens, &font);
        if drawn.every > 1 {
            let words =
                format!("the picture shows one of every {} nodes along each side", drawn.every);
            let at = rect.left_bottom() + vec2(EDGE, -EDGE);
            painter.text(at, Align2::LEFT_BOTTOM, words, font, tokens.text_quiet);
        }
    }
}

/// A stylus: a cone from the tip, its button to one side.
fn stylus_shape(painter: &Painter, lens: &Lens, shown: &ScenePicture, size: f64, tokens: &Tokens) {
    let [length, button] = stylus(shown.turn);
    let end = along(shown.device, length, STYLUS * size);
    let (Some(tip), Some(top)) = (lens.see(shown.device), lens.see(end)) else { return };
    let thick = |radius: f64, distance: f64| (radius * size * lens.points_per_mm(distance)) as f32;
    let aside = (top.at - tip.at).normalized().rot90();
    let (thin, wide) = (thick(0.003, tip.distance), thick(0.014, top.distance));
    let corners = [
        tip.at - aside * thin,
        tip.at + aside * thin,
        top.at + aside * wide,
        top.at - aside * wide,
    ];
    let edge = Stroke::new(1.0, tokens.canvas);
    painter.add(Shape::convex_polygon(corners.to_vec(), tokens.active_fill, edge));
    painter.circle(top.at, wide, tokens.active_fill, edge);
    let middle = along(shown.device, length, 0.6 * STYLUS * size);
    if let Some(seen) = lens.see(along(middle, button, 0.012 * size)) {
        painter.circle(seen.at, thick(0.005, seen.distance), tokens.canvas, Stroke::NONE);
    }
}

/// The force as an arrow from where the device touches, with its size in words.
fn force_shape(
    painter: &Painter,
    lens: &Lens,
    shown: &ScenePicture,
    size: f64,
    tokens: &Tokens,
    font: &FontId,
) {
    let newtons = super::camera::dot(shown.force, shown.force).sqrt();
    if newtons.is_nan() || newtons < ARROW_MIN {
        return;
    }
    let from = shown.contact.unwrap_or(shown.device);
    let to = along(from, shown.force, size / 4.0 / ARROW_NEWTONS);
    if let (Some(from), Some(to)) = (lens.see(from), lens.see(to)) {
        painter.arrow(from.at, to.at - from.at, Stroke::new(3.0, tokens.limit));
        let beside = to.at + vec2(8.0, 0.0);
        let words = format!("{newtons:.2} N");
        label(painter, beside, &words, tokens, font);
    }
}

/// Words on a ground of their own, so that they are readable before anything.
fn label(painter: &Painter, at: Pos2, words: &str, tokens: &Tokens, font: &FontId) {
    let text = painter.layout_no_wrap(words.to_owned(), font.clone(), tokens.text);
    let rect = Align2::LEFT_CENTER.anchor_size(at, text.size());
    painter.rect_filled(rect.expand(3.0), 2.0, tokens.canvas);
    painter.galley(rect.min, text, tokens.text);
}

/// The colours and the depths that they stand for.
fn bar_shape(painter: &Painter, rect: Rect, deepest: f64, tokens: &Tokens, font: &FontId) {
    let [wide, high] = [BAR[0], BAR[1].min(rect.height() - 4.0 * EDGE)];
    let top = pos2(rect.right() - EDGE - wide - 40.0, rect.top() + 2.5 * EDGE);
    let mut mesh = Mesh::default();
    const STEPS: u32 = 64;
    for step in 0..=STEPS {
        let share = step as f32 / STEPS as f32;
        let colour = viridis(share);
        let y = top.y + share * high;
        mesh.colored_vertex(pos2(top.x, y), colour);
        mesh.colored_vertex(pos2(top.x + wide, y), colour);
        if step > 0 {
            let first = 2 * (step - 1);
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 3, first + 2);
        }
    }
    painter.add(Shape::mesh(mesh));
    let text = |at: Pos2, align: Align2, words: String| {
        painter.text(at, align, words, font.clone(), tokens.text_quiet);
    };
    text(
        pos2(rect.right() - EDGE, rect.top() + EDGE),
        Align2::RIGHT_CENTER,
        "depth (mm)".to_owned(),
    );
    for share in [0.0_f32, 0.5, 1.0] {
        let at = pos2(top.x + wide + 6.0, top.y + share * high);
        text(at, Align2::LEFT_CENTER, format!("{}", f64::from(share) * deepest));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{CentralPanel, Context, Modifiers, RawInput};
    use palpate_haptics::surface::Grid;

    /// One frame of a picture of 800 by 600 points.
    fn frame(ctx: &Context, view: &mut SceneView, time: f64, events: Vec<Event>) -> Response {
        let grid = Grid::new(31, 31, 2.0).unwrap();
        let heights = vec![0.0; grid.nodes()];
        let shown = ScenePicture {
            now: Heights::new(grid, &heights).unwrap(),
            rest: &heights,
            device: view.hand().at(),
            turn: [0.0, 0.5, 0.0],
            contact: None,
            force: [0.0, 0.0, f64::NAN],
        };
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0))),
            time: Some(time),
            events,
            ..RawInput::default()
        };
        let mut response = None;
        let mut output = ctx.run_ui(input, |ui| {
            let panel = CentralPanel::no_frame();
            let content = |ui: &mut Ui| {
                // Something that the arrows would lead to.
                let _ = ui.button("beside");
                view.ui(ui, &shown)
            };
            response = Some(panel.show(ui, content).inner);
        });
        assert!(!output.shapes.is_empty());
        // Nothing is painted.
        output.textures_delta.clear();
        response.unwrap()
    }

    fn button(pos: Pos2, button: PointerButton, pressed: bool) -> Event {
        Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE }
    }

    fn key(key: Key, modifiers: Modifiers) -> Event {
        Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers }
    }

    #[test]
    fn a_button_held_presses_where_the_pointer_is_until_it_is_let_go() {
        let (ctx, mut view) = (Context::default(), SceneView::of([60.0, 60.0]));
        let at = pos2(420.0, 330.0);
        let rect = frame(&ctx, &mut view, 0.0, Vec::new()).rect;
        frame(&ctx, &mut view, 0.1, vec![Event::PointerMoved(at)]);
        assert!(view.hand().at()[2] > 0.0);
        let picked = view.camera.lens(rect).pick(at, 0.0).unwrap();
        assert!((view.hand().at()[0] - picked[0]).abs() < 1e-9);
        let before = view.camera;
        frame(&ctx, &mut view, 0.2, vec![button(at, PointerButton::Primary, true)]);
        for step in 3..8 {
            frame(&ctx, &mut view, f64::from(step) * 0.1, Vec::new());
        }
        assert!(view.hand().at()[2] < -0.2, "{:?}", view.hand());
        frame(&ctx, &mut view, 0.8, vec![button(at, PointerButton::Primary, false)]);
        assert!(view.hand().at()[2] > 0.0, "{:?}", view.hand());
        assert_eq!(view.camera, before);
    }

    #[test]
    fn the_other_button_turns_the_scene_and_presses_nothing() {
        let (ctx, mut view) = (Context::default(), SceneView::of([60.0, 60.0]));
        let at = pos2(420.0, 330.0);
        frame(&ctx, &mut view, 0.0, vec![Event::PointerMoved(at)]);
        frame(&ctx, &mut view, 0.1, vec![button(at, PointerButton::Secondary, true)]);
        let before = view.camera;
        let to = at + vec2(90.0, 0.0);
        frame(&ctx, &mut view, 0.2, vec![Event::PointerMoved(to)]);
        frame(&ctx, &mut view, 0.3, vec![button(to, PointerButton::Secondary, false)]);
        assert_ne!(view.camera, before);
        assert!(view.hand().at()[2] > 0.0);
    }

    #[test]
    fn keys_reach_the_picture_that_has_the_focus() {
        let (ctx, mut view) = (Context::default(), SceneView::of([60.0, 60.0]));
        let response = frame(&ctx, &mut view, 0.0, Vec::new());
        let down = || vec![key(Key::PageDown, Modifiers::NONE)];
        let start = *view.hand();
        frame(&ctx, &mut view, 0.1, down());
        assert_eq!(*view.hand(), start, "without the focus a key is another's");
        response.request_focus();
        frame(&ctx, &mut view, 0.2, down());
        assert!(view.hand().at()[2] < start.at()[2]);
        let camera = view.camera;
        frame(&ctx, &mut view, 0.3, vec![key(Key::ArrowLeft, Modifiers::NONE)]);
        assert_eq!(view.camera, camera);
        assert_ne!(view.hand().at()[0], start.at()[0]);
        let response = frame(&ctx, &mut view, 0.4, vec![key(Key::ArrowUp, Modifiers::SHIFT)]);
        assert_ne!(view.camera, camera);
        assert!(response.has_focus(), "arrows stay in the picture");
        frame(&ctx, &mut view, 0.5, vec![key(Key::Plus, Modifiers::NONE)]);
        frame(&ctx, &mut view, 0.6, vec![key(Key::Home, Modifiers::NONE)]);
        assert_eq!(view.camera, camera);
    }
}
