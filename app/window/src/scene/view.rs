//! The picture of a scene, and what the pointer and the keys do in it.

use super::camera::Lens;
use super::detail::PictureDetail;
use super::graphics::PictureGraphics;
use super::hand::{ToolGround, ToolTarget};
use super::look::{PicturedTissue, SceneLook, SeenRanges};
use super::overlay::OverlayPainter;
use crate::widgets::{NamedControl, quiet_ui, tokens_of};
use eframe::egui::{
    Event, EventFilter, Key, Label, PointerButton, Pos2, Rect, Response, RichText, Role, Sense,
    Stroke, StrokeKind, TextStyle, Ui, WidgetInfo, vec2,
};
use eframe::egui_wgpu::Callback;
use palpate_haptics::scene::stylus_axis;
use palpate_tissue_view::{
    AdapterAbilities, Camera, DetailLevel, EyeLayout, Picture, PictureShape, Probe, TissueCallback,
    Vec3,
};
use std::sync::Arc;

/// Name of the picture, for the palette and for who reads the screen aloud.
pub const NAME: &str = "scene picture";
/// Radians per point of a drag and per press of a key.
const ORBIT: [f64; 2] = [0.008, 0.1];
/// Zoom per point of the wheel and per press of a key.
const ZOOM: [f64; 2] = [0.002, 1.15];
/// Depth per point of the wheel, in mm.
const WHEEL_MM: f64 = 0.02;
/// Room for the line below the picture.
const FOOT: f32 = 20.0;

/// The scene at one moment.
#[derive(Clone, Copy, Debug)]
pub struct ScenePicture<'a> {
    pub tissue: PicturedTissue<'a>,
    /// Where the tip of the device is, in mm.
    pub device: Vec3,
    /// Yaw, pitch and roll of the stylus in rad.
    pub turn: Vec3,
    /// The contact point; `None` without contact.
    pub contact: Option<Vec3>,
    /// Force on the hand, in N.
    pub force: Vec3,
    /// Whether the scene runs, so that one picture follows the other.
    pub is_running: bool,
}

/// Camera and hand of a scene.
#[derive(Clone, Debug)]
pub struct SceneView {
    camera: Camera,
    /// What the camera was fitted to; `None` before the first picture.
    shape: Option<PictureShape>,
    hand: ToolTarget,
    pub look: SceneLook,
    detail: PictureDetail,
    seen: SeenRanges,
}

fn first_camera(ground: &ToolGround) -> Camera {
    match ground {
        ToolGround::Square(extent) => Camera::of(*extent),
        ToolGround::Mesh(mesh) => Camera::around(mesh.bounds()),
    }
}

impl SceneView {
    /// Of the tissue that the hand is over.
    #[must_use]
    pub fn of(hand: ToolTarget) -> Self {
        Self {
            camera: first_camera(hand.ground()),
            shape: None,
            hand,
            look: SceneLook::default(),
            detail: PictureDetail::default(),
            seen: SeenRanges::default(),
        }
    }

    /// The same of other tissue, looked at from the start.
    pub fn take_tissue(&mut self, hand: ToolTarget) {
        let (look, detail) = (self.look, self.detail.clone());
        *self = Self { look, detail, ..Self::of(hand) };
    }

    /// Where the pointer and the keys want the tool.
    pub fn hand(&self) -> &ToolTarget {
        &self.hand
    }

    /// The longest side of the tissue in mm.
    pub fn side_mm(&self) -> f64 {
        let [low, high] = self.hand.ground().bounds();
        [0, 1, 2].map(|axis| high[axis] - low[axis]).into_iter().fold(0.0, f64::max)
    }

    pub fn reset(&mut self) {
        self.camera = first_camera(self.hand.ground());
        if let Some(shape) = self.shape {
            self.camera = self.fitted(shape);
        }
    }

    /// The camera from which all of the tissue is in a picture of this shape.
    fn fitted(&self, shape: PictureShape) -> Camera {
        match self.hand.ground() {
            ToolGround::Square(_) => self.camera.fitted(self.bounds(), shape),
            // An organ leaves the corners of its box free.
            ToolGround::Mesh(mesh) => self.camera.fitted_to(mesh.points(), shape),
        }
    }

    /// The box of what is drawn, lowest and highest corner in mm: of a square with its sides.
    fn bounds(&self) -> [Vec3; 2] {
        let [low, high] = self.hand.ground().bounds();
        match self.hand.ground() {
            ToolGround::Square(_) => {
                [[low[0], low[1], -self.look.thickness_mm(self.side_mm())], high]
            }
            ToolGround::Mesh(_) => [low, high],
        }
    }

    /// All of the tissue is in the picture, whatever its shape; what was turned and zoomed stays so.
    fn fit(&mut self, rect: Rect) {
        let now = PictureShape::new([rect.width(), rect.height()].map(f64::from), self.eyes());
        self.camera = match self.shape.replace(now) {
            None => self.fitted(now),
            Some(before) if before != now => self.camera.reshaped(self.bounds(), [before, now]),
            Some(_) => self.camera,
        };
    }

    fn eyes(&self) -> EyeLayout {
        match self.look.has_two_eyes {
            true => EyeLayout::SideBySide,
            false => EyeLayout::Single,
        }
    }

    /// Draws the scene in the space there is, and below it how; the hand follows pointer and keys.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        shown: &ScenePicture,
        graphics: &mut PictureGraphics,
    ) -> Response {
        let size = (ui.available_size() - vec2(0.0, FOOT)).max(vec2(80.0, 80.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let response = response.named(NAME);
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, NAME));
        self.fit(rect);
        self.take_pointer(ui, &response, rect);
        self.take_keys(ui, &response);
        let frame_ms = graphics.frame_ms.filter(|_| shown.is_running);
        let drawn = graphics
            .abilities()
            .map_err(str::to_owned)
            .and_then(|abilities| self.draw(ui, rect, shown, (abilities, frame_ms)));
        match drawn {
            Ok(level) => self.foot_ui(ui, level, frame_ms),
            Err(reason) => {
                let ink = tokens_of(ui).text_quiet;
                let words = RichText::new(reason).color(ink);
                // The pointer reaches the picture through the words.
                ui.put(rect.shrink(24.0), Label::new(words).wrap().selectable(false));
            }
        }
        if response.has_focus() {
            let focus = Stroke::new(1.5, tokens_of(ui).focus);
            ui.painter().rect_stroke(rect.shrink(1.0), 2.0, focus, StrokeKind::Inside);
        }
        response
    }

    /// Draws the scene at the level that it returns, or says why not.
    fn draw(
        &mut self,
        ui: &Ui,
        rect: Rect,
        shown: &ScenePicture,
        (abilities, frame_ms): (AdapterAbilities, Option<f64>),
    ) -> Result<DetailLevel, String> {
        let level = self.detail.next(abilities, frame_ms, self.look.has_full_detail);
        let picture = self.picture(shown, level, ui)?;
        let (look, lenses) = (self.look, self.lenses(rect));
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        let size_px = pixels(rect, ui.pixels_per_point());
        painter.add(Callback::new_paint_callback(rect, TissueCallback { picture, size_px }));
        for lens in lenses {
            let above = OverlayPainter {
                painter: &painter.with_clip_rect(lens.rect.intersect(painter.clip_rect())),
                tokens: tokens_of(ui),
                font: TextStyle::Small.resolve(ui.style()),
            };
            above.touch(&lens, shown, self.side_mm());
            if let Some(legend) = look.legend(&self.seen) {
                above.legend(lens.rect, &legend);
            }
        }
        Ok(level)
    }

    /// The tissue and the probe as the loop computed them.
    fn picture(
        &mut self,
        shown: &ScenePicture,
        level: DetailLevel,
        ui: &Ui,
    ) -> Result<Picture, String> {
        let surface = self.look.surface(shown.tissue).map_err(|err| err.to_string())?;
        self.seen.take(self.look.colours, shown.tissue, &surface);
        let length = stylus_axis(shown.turn);
        let drawn = self.look.probe;
        let probe = Probe::new([0.0; 3], drawn.radius_mm(self.side_mm()))
            .and_then(|probe| probe.of_kind(drawn.kind()).with_axis(length))
            .and_then(|probe| probe.with_tip_at(shown.device));
        Ok(Picture {
            surface: Arc::new(surface),
            // A device that is lost has no place.
            probe: probe.ok(),
            camera: self.camera,
            eyes: self.eyes(),
            look: self.look.look(self.side_mm(), &self.seen, tokens_of(ui)),
            level,
        })
    }

    /// How the picture was drawn.
    fn foot_ui(&self, ui: &mut Ui, level: DetailLevel, frame_ms: Option<f64>) {
        let parts = [
            frame_ms.map(|frame_ms| format!("{frame_ms:.0} ms a frame")),
            Some(level.to_string()),
            self.look.contour_words(&self.seen),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        quiet_ui(ui, parts.join("; "));
    }

    /// What is seen, and where: one picture or one for each eye.
    fn lenses(&self, rect: Rect) -> Vec<Lens> {
        match self.look.has_two_eyes {
            true => Lens::pair(self.camera, rect).into(),
            false => vec![Lens::single(self.camera, rect)],
        }
    }

    /// The eye and the direction that it sees at a point of the screen.
    fn ray(&self, rect: Rect, at: Pos2) -> Option<[Vec3; 2]> {
        let lenses = self.lenses(rect);
        let under = lenses.iter().find(|lens| lens.rect.contains(at)).or(lenses.first())?;
        Some(under.ray(at))
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
            && let Some(ray) = self.ray(rect, at)
        {
            self.hand.go_to_seen(ray);
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
}

/// Width and height in pixels, with the edges where egui has them.
fn pixels(rect: Rect, pixels_per_point: f32) -> [u32; 2] {
    let side = |low: f32, high: f32| {
        let [low, high] = [low, high].map(|edge| (edge * pixels_per_point).round());
        (high - low).max(1.0) as u32
    };
    [side(rect.left(), rect.right()), side(rect.top(), rect.bottom())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{CentralPanel, Context, Modifiers, RawInput, pos2};
    use palpate_haptics::surface::{Grid, Heights};
    use palpate_tissue_view::ElasticModel;

    /// One frame of a picture of 800 by 600 points.
    fn frame(ctx: &Context, view: &mut SceneView, time: f64, events: Vec<Event>) -> Response {
        let grid = Grid::new(31, 31, 2.0).unwrap();
        let heights = vec![0.0; grid.nodes()];
        let shown = ScenePicture {
            tissue: PicturedTissue::Square {
                now: Heights::new(grid, &heights).unwrap(),
                model: ElasticModel::default(),
            },
            device: view.hand().at(),
            turn: [0.0, 0.5, 0.0],
            contact: None,
            force: [0.0, 0.0, f64::NAN],
            is_running: false,
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
                view.ui(ui, &shown, &mut PictureGraphics::default())
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
        let (ctx, mut view) = (Context::default(), SceneView::of(ToolTarget::above([60.0, 60.0])));
        let at = pos2(420.0, 330.0);
        let rect = frame(&ctx, &mut view, 0.0, Vec::new()).rect;
        frame(&ctx, &mut view, 0.1, vec![Event::PointerMoved(at)]);
        assert!(view.hand().at()[2] > 0.0);
        let [eye, ray] = view.ray(rect, at).unwrap();
        let picked = eye[0] - ray[0] * eye[2] / ray[2];
        assert!((view.hand().at()[0] - picked).abs() < 1e-9);
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
        let (ctx, mut view) = (Context::default(), SceneView::of(ToolTarget::above([60.0, 60.0])));
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
        let (ctx, mut view) = (Context::default(), SceneView::of(ToolTarget::above([60.0, 60.0])));
        let response = frame(&ctx, &mut view, 0.0, Vec::new());
        let down = || vec![key(Key::PageDown, Modifiers::NONE)];
        let start = view.hand().clone();
        frame(&ctx, &mut view, 0.1, down());
        assert_eq!(view.hand().at(), start.at(), "without the focus a key is another's");
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
