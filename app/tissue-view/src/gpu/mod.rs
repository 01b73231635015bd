//! The renderer: what is drawn into which texture, in which order.

mod buffers;
mod pipelines;
mod targets;
mod uniforms;

pub(crate) use pipelines::Output;

use crate::camera::Eye;
use crate::level::{DetailLevel, LEVELS, Shading};
use crate::look::linear;
use crate::picture::Picture;
use crate::surface::SurfaceData;
use buffers::{SceneBuffers, Triangles, side_vertices};
use egui_wgpu::wgpu;
use pipelines::{Part, PipelineKey, Pipelines};
use targets::{CopyPipeline, Targets};
use thiserror::Error;

/// The adapter's reason why it cannot draw pictures.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the graphics adapter refuses the picture: {0}")]
pub struct RefusedError(String);

/// Draws pictures with an adapter, and keeps what is on it from one to the next.
///
/// The window keeps one in its `CallbackResources`; [`OffScreen`](crate::OffScreen) has its own.
#[derive(Debug)]
pub struct TissueRenderer {
    pipelines: Pipelines,
    buffers: SceneBuffers,
    targets: Option<Targets>,
    copy: CopyPipeline,
    abilities: AdapterAbilities,
    /// How the share of the sky was computed last; `None` before.
    openness: Option<Shading>,
    drawn: Option<DrawnPicture>,
}

/// What the picture in the targets was drawn of, but for what the buffers have.
#[derive(Clone, Debug, PartialEq)]
struct DrawnPicture {
    numbers: Vec<[[f32; 4]; uniforms::ROWS]>,
    parts: Vec<Part>,
    shape: targets::TargetShape,
    shading: Shading,
}

/// What an adapter can do that not all can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterAbilities {
    /// Samples per pixel: 4 or 1.
    samples: u32,
    /// Whether a texture may be read in another format than it is drawn in, which spares the copy its arithmetic.
    has_views: bool,
    /// Where [`LevelChooser`](crate::LevelChooser) should begin, counted in [`LEVELS`](crate::LEVELS).
    pub first_level: usize,
}

impl AdapterAbilities {
    #[must_use]
    pub fn of(adapter: &wgpu::Adapter) -> Self {
        let allows =
            |format, flag| adapter.get_texture_format_features(format).flags.contains(flag);
        let has_samples =
            allows(pipelines::COLOUR, wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4)
                && allows(pipelines::COLOUR, wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE)
                && allows(pipelines::DEPTH, wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4);
        let flags = adapter.get_downlevel_capabilities().flags;
        Self {
            samples: if has_samples { 4 } else { 1 },
            has_views: flags.contains(wgpu::DownlevelFlags::VIEW_FORMATS),
            first_level: match adapter.get_info().device_type {
                wgpu::DeviceType::Cpu => FIRST_OF_SOFTWARE,
                _ => 0,
            },
        }
    }

    /// What every adapter of WebGPU can.
    #[must_use]
    pub const fn least() -> Self {
        Self { samples: 1, has_views: false, first_level: 0 }
    }

    /// A level with the samples that the adapter allows: what is drawn, and what the user is shown.
    #[must_use]
    pub fn possible(self, level: DetailLevel) -> DetailLevel {
        DetailLevel { samples: level.samples.min(self.samples).max(1), ..level }
    }
}

/// A software renderer takes a second for a picture of the best level.
const FIRST_OF_SOFTWARE: usize = 3;

impl TissueRenderer {
    /// For copies into a window of a format.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        window: wgpu::TextureFormat,
        abilities: AdapterAbilities,
    ) -> Self {
        let pipelines = Pipelines::new(device);
        Self {
            buffers: SceneBuffers::new(device, &pipelines),
            pipelines,
            targets: None,
            copy: CopyPipeline::new(device, window, abilities.has_views),
            abilities,
            openness: None,
            drawn: None,
        }
    }

    /// The same, once the adapter has taken everything that a picture at its first level needs.
    pub fn checked(
        device: &wgpu::Device,
        window: wgpu::TextureFormat,
        abilities: AdapterAbilities,
    ) -> Result<Self, RefusedError> {
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut renderer = Self::new(device, window, abilities);
        let DetailLevel { samples, shading, .. } =
            abilities.possible(LEVELS[abilities.first_level.min(LEVELS.len() - 1)]);
        for part in [Part::Probe, Part::Field, Part::Sides, Part::Mesh] {
            let key = PipelineKey { part, samples, shading, output: Output::Colours };
            renderer.pipelines.make(device, key);
        }
        match pollster::block_on(scope.pop()) {
            None => Ok(renderer),
            Some(err) => Err(RefusedError(one_line(&err.to_string()))),
        }
    }

    /// Uploads what changed and draws a picture for so many pixels into an own texture.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        picture: &Picture,
        size_px: [u32; 2],
    ) {
        self.draw(device, queue, encoder, picture, (size_px, Output::Colours));
    }

    /// Copies the picture that was prepared to the viewport of a pass.
    pub fn paint(&self, pass: &mut wgpu::RenderPass) {
        if let Some(targets) = &self.targets {
            self.copy.draw(pass, targets);
        }
    }

    pub(crate) fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        picture: &Picture,
        (size_px, output): ([u32; 2], Output),
    ) {
        let level = self.abilities.possible(picture.level);
        let samples = if output == Output::Normals { 1 } else { level.samples };
        let divisor = level.divisor.max(1);
        let most = device.limits().max_texture_dimension_2d;
        let size = size_px.map(|side| side.div_ceil(divisor).clamp(1, most));
        let shape = targets::TargetShape { size, samples, output };
        if self.targets.as_ref().is_none_or(|targets| targets.shape != shape) {
            self.targets = Some(Targets::new(device, &self.copy, shape));
        }
        let changes = self.buffers.update(device, queue, &self.pipelines, picture);
        let eyes = picture.eyes.eyes();
        let eye_size = [(size[0] / eyes.len() as u32).max(1), size[1]];
        let drawn = DrawnPicture {
            numbers: eyes.iter().map(|&eye| uniforms::of(picture, eye, eye_size)).collect(),
            parts: parts_of(picture),
            shape,
            shading: level.shading,
        };
        if !changes.any && self.drawn.as_ref() == Some(&drawn) {
            return;
        }
        for (numbers, buffer) in drawn.numbers.iter().zip(&self.buffers.numbers) {
            queue.write_buffer(buffer, 0, bytemuck::cast_slice(numbers.as_flattened()));
        }
        let is_field = matches!(*picture.surface, SurfaceData::Field(_));
        if is_field && (changes.heights || self.openness != Some(level.shading)) {
            self.compute_openness(device, encoder, level.shading);
        }
        let parts = drawn.parts.clone();
        self.drawn = Some(drawn);
        for &part in &parts {
            let key = PipelineKey { part, samples, shading: level.shading, output };
            self.pipelines.make(device, key);
        }
        let Some(targets) = &self.targets else { return };
        let background = match output {
            Output::Colours => linear(picture.look.background),
            Output::Normals => [0.0; 3],
        };
        let mut pass = targets.begin(encoder, background);
        for (index, &eye) in eyes.iter().enumerate() {
            let left = if eye == Eye::Right { eye_size[0] } else { 0 };
            let [wide, high] = eye_size.map(|side| side as f32);
            pass.set_viewport(left as f32, 0.0, wide, high, 0.0, 1.0);
            pass.set_scissor_rect(left, 0, eye_size[0], eye_size[1]);
            pass.set_bind_group(0, &self.buffers.groups[index], &[]);
            for &part in &parts {
                let key = PipelineKey { part, samples, shading: level.shading, output };
                self.draw_part(&mut pass, picture, key);
            }
        }
    }

    fn draw_part(&self, pass: &mut wgpu::RenderPass, picture: &Picture, key: PipelineKey) {
        let Some(pipeline) = self.pipelines.get(key) else { return };
        pass.set_pipeline(pipeline);
        match (key.part, &*picture.surface) {
            (Part::Sides, SurfaceData::Field(field)) => {
                pass.draw(0..side_vertices(field, picture.level.every.max(1)), 0..1);
            }
            (Part::Probe, _) => draw_triangles(pass, self.buffers.probe.as_ref()),
            (Part::Field | Part::Mesh | Part::OpenMesh, _) => {
                draw_triangles(pass, self.buffers.surface.as_ref())
            }
            (Part::Sides, SurfaceData::Mesh(_)) => {}
        }
    }

    fn compute_openness(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        shading: Shading,
    ) {
        self.openness = Some(shading);
        let attachment = wgpu::RenderPassColorAttachment {
            view: &self.buffers.openness_view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                store: wgpu::StoreOp::Store,
            },
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("openness"),
            color_attachments: &[Some(attachment)],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(self.pipelines.openness(device, shading));
        pass.set_bind_group(0, &self.buffers.openness_group, &[]);
        pass.draw(0..3, 0..1);
    }

    pub(crate) fn targets(&self) -> Option<&wgpu::Texture> {
        self.targets.as_ref().map(|targets| &targets.picture)
    }
}

/// Words of several lines in one.
fn one_line(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The probe first: what it hides is not shaded.
fn parts_of(picture: &Picture) -> Vec<Part> {
    let mut parts = Vec::with_capacity(3);
    if picture.probe.is_some() {
        parts.push(Part::Probe);
    }
    match &*picture.surface {
        SurfaceData::Field(_) if picture.look.thickness_mm > 0.0 => {
            parts.extend([Part::Field, Part::Sides]);
        }
        SurfaceData::Field(_) => parts.push(Part::Field),
        SurfaceData::Mesh(mesh) if mesh.is_closed => parts.push(Part::Mesh),
        SurfaceData::Mesh(_) => parts.push(Part::OpenMesh),
    }
    parts
}

fn draw_triangles(pass: &mut wgpu::RenderPass, triangles: Option<&Triangles>) {
    let Some(Triangles { nodes, indices, count }) = triangles else { return };
    if let Some(nodes) = nodes {
        pass.set_vertex_buffer(0, nodes.slice(..));
    }
    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    pass.draw_indexed(0..*count, 0, 0..1);
}
