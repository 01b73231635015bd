//! The textures that are drawn into, and the copy of the finished picture into the window.

use super::pipelines::{
    COLOUR, DEPTH, NORMAL, Output, PipelineParts, SAMPLER, binding, layout, pipeline, shader,
    texture,
};
use egui_wgpu::wgpu;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TargetShape {
    pub size: [u32; 2],
    pub samples: u32,
    pub output: Output,
}

/// A picture, its depths, and its samples where there are several to a pixel.
#[derive(Debug)]
pub(super) struct Targets {
    pub shape: TargetShape,
    pub picture: wgpu::Texture,
    view: wgpu::TextureView,
    depth: wgpu::TextureView,
    samples: Option<wgpu::TextureView>,
    /// For the copy; `None` for normals, which are read alone.
    group: Option<wgpu::BindGroup>,
}

impl Targets {
    pub fn new(device: &wgpu::Device, copy: &CopyPipeline, shape: TargetShape) -> Self {
        let [width, height] = shape.size;
        let new = |format, sample_count, usage, view_formats: &[wgpu::TextureFormat]| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats,
            })
        };
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let format = if shape.output == Output::Colours { COLOUR } else { NORMAL };
        let none = wgpu::TextureUsages::empty();
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let is_picture = shape.output == Output::Colours;
        let raw = copy.reads.filter(|_| is_picture);
        let picture = new(format, 1, read, raw.as_slice());
        let picture_view = view(&picture);
        let read_view = picture.create_view(&wgpu::TextureViewDescriptor {
            format: raw,
            usage: raw.map(|_| wgpu::TextureUsages::TEXTURE_BINDING),
            ..wgpu::TextureViewDescriptor::default()
        });
        Self {
            shape,
            depth: view(&new(DEPTH, shape.samples, none, &[])),
            samples: (shape.samples > 1).then(|| view(&new(format, shape.samples, none, &[]))),
            group: is_picture.then(|| copy.group(device, &read_view)),
            view: picture_view,
            picture,
        }
    }

    /// A pass that begins with the background.
    pub fn begin<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        [r, g, b]: [f64; 3],
    ) -> wgpu::RenderPass<'a> {
        let (view, resolve_target, store) = match &self.samples {
            Some(samples) => (samples, Some(&self.view), wgpu::StoreOp::Discard),
            None => (&self.view, None, wgpu::StoreOp::Store),
        };
        let a = if self.shape.output == Output::Colours { 1.0 } else { 0.0 };
        let colours = wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }), store },
        };
        let depths = wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(colours)],
            depth_stencil_attachment: Some(depths),
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}

/// From a finished picture to the window.
#[derive(Debug)]
pub(super) struct CopyPipeline {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    /// The format in which the picture is read, where it is another than that in which it is drawn: a window that takes
    /// values as a display does gets them as they are.
    reads: Option<wgpu::TextureFormat>,
}

impl CopyPipeline {
    pub fn new(device: &wgpu::Device, window: wgpu::TextureFormat, has_views: bool) -> Self {
        let reads = (has_views && !window.is_srgb()).then_some(COLOUR.remove_srgb_suffix());
        let layout = layout(device, &[binding(0, texture(true)), binding(1, SAMPLER)]);
        let shader = shader(device, "copy", &[include_str!("../shaders/copy.wgsl")]);
        let is_encoded = f64::from(u8::from(!window.is_srgb() && reads.is_none()));
        let parts = PipelineParts {
            layout: &layout,
            shader: &shader,
            vertex: "copy_vertex",
            buffers: &[],
            fragment: "copy_colour",
            constants: &[("IS_ENCODED", is_encoded)],
            format: window,
            samples: 1,
            has_depth: false,
            has_back: true,
        };
        let pipeline = pipeline(device, &parts);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        Self { layout, pipeline, sampler, reads }
    }

    fn group(&self, device: &wgpu::Device, picture: &wgpu::TextureView) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("copy"),
            layout: &self.layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(picture)),
                entry(1, wgpu::BindingResource::Sampler(&self.sampler)),
            ],
        })
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass, targets: &Targets) {
        if let Some(group) = &targets.group {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
