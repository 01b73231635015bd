//! What is compiled for the graphics processor, each when it is first needed.

use crate::level::Shading;
use egui_wgpu::wgpu;
use std::collections::BTreeMap;

pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
pub(super) const NORMAL: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const OPENNESS: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    Field,
    /// A mesh without an inner side that can be seen.
    Mesh,
    OpenMesh,
    Sides,
    Probe,
}

/// What comes out: a picture, or normals for checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Output {
    Colours,
    Normals,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PipelineKey {
    pub part: Part,
    pub samples: u32,
    pub shading: Shading,
    pub output: Output,
}

#[derive(Debug)]
pub(super) struct Pipelines {
    shader: wgpu::ShaderModule,
    openness_shader: wgpu::ShaderModule,
    pub scene_layout: wgpu::BindGroupLayout,
    pub openness_layout: wgpu::BindGroupLayout,
    made: BTreeMap<PipelineKey, wgpu::RenderPipeline>,
    openness: BTreeMap<Shading, wgpu::RenderPipeline>,
}

/// A binding that shaders read: one of numbers, of a texture, of a sampler.
pub(super) fn binding(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT;
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

pub(super) const NUMBERS: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

pub(super) const fn texture(filterable: bool) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

pub(super) const SAMPLER: wgpu::BindingType =
    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);

pub(super) fn shader(device: &wgpu::Device, label: &str, parts: &[&str]) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(parts.concat().into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
}

pub(super) fn layout(
    device: &wgpu::Device,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
}

/// Everything that pipelines of this crate differ in.
pub(super) struct PipelineParts<'a> {
    pub layout: &'a wgpu::BindGroupLayout,
    pub shader: &'a wgpu::ShaderModule,
    pub vertex: &'a str,
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub fragment: &'a str,
    pub constants: &'a [(&'a str, f64)],
    pub format: wgpu::TextureFormat,
    pub samples: u32,
    pub has_depth: bool,
    /// Whether triangles are drawn that face away.
    pub has_back: bool,
}

pub(super) fn pipeline(device: &wgpu::Device, parts: &PipelineParts) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(parts.layout)],
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: parts.constants,
        ..wgpu::PipelineCompilationOptions::default()
    };
    let depth = wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(parts.fragment),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: parts.shader,
            entry_point: Some(parts.vertex),
            compilation_options: compilation_options.clone(),
            buffers: parts.buffers,
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: (!parts.has_back).then_some(wgpu::Face::Back),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: parts.has_depth.then_some(depth),
        multisample: wgpu::MultisampleState {
            count: parts.samples,
            ..wgpu::MultisampleState::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: parts.shader,
            entry_point: Some(parts.fragment),
            compilation_options,
            targets: &[Some(parts.format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

impl Pipelines {
    pub fn new(device: &wgpu::Device) -> Self {
        let scene = [
            binding(0, NUMBERS),
            binding(1, texture(false)),
            binding(2, texture(false)),
            binding(3, texture(false)),
            binding(4, texture(true)),
            binding(5, SAMPLER),
        ];
        let parts = [
            include_str!("../shaders/scene.wgsl"),
            include_str!("../shaders/light.wgsl"),
            include_str!("../shaders/tissue.wgsl"),
        ];
        Self {
            shader: shader(device, "tissue", &parts),
            openness_shader: shader(
                device,
                "openness",
                &[include_str!("../shaders/openness.wgsl")],
            ),
            scene_layout: layout(device, &scene),
            openness_layout: layout(device, &scene[..2]),
            made: BTreeMap::new(),
            openness: BTreeMap::new(),
        }
    }

    /// Compiles one, unless that is done.
    pub fn make(&mut self, device: &wgpu::Device, key: PipelineKey) {
        let Self { shader, scene_layout, made, .. } = self;
        made.entry(key).or_insert_with(|| scene_pipeline(device, shader, scene_layout, key));
    }

    /// One that was made.
    pub fn get(&self, key: PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.made.get(&key)
    }

    /// The one that computes which share of the sky is seen; fewer directions and steps for simple shading.
    pub fn openness(&mut self, device: &wgpu::Device, shading: Shading) -> &wgpu::RenderPipeline {
        let Self { openness_shader, openness_layout, openness, .. } = self;
        openness.entry(shading).or_insert_with(|| {
            let constants = match shading {
                Shading::Full => [("DIRECTIONS", 12.0), ("STEPS", 10.0)],
                Shading::Simple => [("DIRECTIONS", 6.0), ("STEPS", 5.0)],
            };
            let parts = PipelineParts {
                layout: openness_layout,
                shader: openness_shader,
                vertex: "whole_vertex",
                buffers: &[],
                fragment: "open_sky",
                constants: &constants,
                format: OPENNESS,
                samples: 1,
                has_depth: false,
                has_back: true,
            };
            pipeline(device, &parts)
        })
    }
}

fn scene_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    key: PipelineKey,
) -> wgpu::RenderPipeline {
    let mesh = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
    let probe = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let buffer = |floats: u64, attributes| {
        [Some(wgpu::VertexBufferLayout {
            array_stride: 4 * floats,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        })]
    };
    let (mesh, probe) = (buffer(8, &mesh), buffer(6, &probe));
    let (vertex, buffers): (_, &[_]) = match key.part {
        Part::Field => ("field_vertex", &[]),
        Part::Mesh | Part::OpenMesh => ("mesh_vertex", &mesh),
        Part::Sides => ("side_vertex", &[]),
        Part::Probe => ("probe_vertex", &probe),
    };
    let fragment = match (key.output, key.part) {
        (Output::Colours, Part::Field | Part::Mesh | Part::OpenMesh) => "tissue_colour",
        (Output::Colours, Part::Sides) => "side_colour",
        (Output::Colours, Part::Probe) => "probe_colour",
        (Output::Normals, Part::Probe) => "probe_normal",
        (Output::Normals, _) => "surface_normal",
    };
    let is_full = f64::from(u8::from(key.shading == Shading::Full));
    let parts = PipelineParts {
        layout,
        shader,
        vertex,
        buffers,
        fragment,
        constants: &[("IS_FULL", is_full)],
        format: if key.output == Output::Colours { COLOUR } else { NORMAL },
        samples: key.samples,
        has_depth: true,
        has_back: !matches!(key.part, Part::Mesh | Part::Probe),
    };
    pipeline(device, &parts)
}
