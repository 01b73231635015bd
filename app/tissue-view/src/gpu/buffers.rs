//! What a scene has on the graphics processor, and which of it changes.

use super::pipelines::{OPENNESS, Pipelines};
use super::uniforms;
use crate::look::{ColourRamp, RAMP};
use crate::mesh::MeshData;
use crate::picture::Picture;
use crate::probe::{Probe, ProbeKind};
use crate::surface::{FieldData, SurfaceData};
use egui_wgpu::wgpu::{self, util::DeviceExt as _};
use std::sync::Arc;

/// What an upload changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct UploadedChanges {
    pub heights: bool,
    /// Anything that the picture shows, heights among it.
    pub any: bool,
}

/// Triangles with their count of indices.
#[derive(Debug)]
pub(super) struct Triangles {
    /// `None` where the shader makes places of indices.
    pub nodes: Option<wgpu::Buffer>,
    pub indices: wgpu::Buffer,
    pub count: u32,
}

/// What the triangles of a field depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FieldLines {
    sides: [u32; 2],
    every: u32,
    /// The node that is drawn whatever is left out; the first where nothing is.
    kept: [u32; 2],
}

#[derive(Debug)]
pub(super) struct SceneBuffers {
    /// For each eye.
    pub numbers: [wgpu::Buffer; 2],
    pub groups: [wgpu::BindGroup; 2],
    pub openness_group: wgpu::BindGroup,
    pub openness_view: wgpu::TextureView,
    heights: wgpu::Texture,
    values: wgpu::Texture,
    ramp: wgpu::Texture,
    sampler: wgpu::Sampler,
    shown: Option<Arc<SurfaceData>>,
    shown_ramp: Option<ColourRamp>,
    pub surface: Option<Triangles>,
    lines: Option<FieldLines>,
    /// One of so many nodes of a mesh is drawn.
    every: u32,
    pub probe: Option<Triangles>,
    probe_shape: Option<(f64, ProbeKind, f64)>,
}

fn new_texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

const READ: wgpu::TextureUsages =
    wgpu::TextureUsages::TEXTURE_BINDING.union(wgpu::TextureUsages::COPY_DST);

/// Rows of a texture from the first, as bytes.
fn write_rows(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    first_row: u32,
    bytes: &[u8],
    row_bytes: u32,
) {
    let rows = bytes.len() as u32 / row_bytes;
    let target = wgpu::TexelCopyTextureInfo {
        texture,
        mip_level: 0,
        origin: wgpu::Origin3d { x: 0, y: first_row, z: 0 },
        aspect: wgpu::TextureAspect::All,
    };
    let data = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row_bytes),
        rows_per_image: None,
    };
    let size = wgpu::Extent3d { width: texture.width(), height: rows, depth_or_array_layers: 1 };
    queue.write_texture(target, bytes, data, size);
}

/// From the first row that differs to after the last; `None` where all are equal.
fn changed_rows<T: PartialEq>(before: &[T], now: &[T], columns: usize) -> Option<[usize; 2]> {
    if before.len() != now.len() {
        return Some([0, now.len() / columns]);
    }
    let is_changed = |row: &usize| {
        let range = row * columns..(row + 1) * columns;
        before[range.clone()] != now[range]
    };
    let rows = now.len() / columns;
    let first = (0..rows).find(is_changed)?;
    let last = (first..rows).rev().find(is_changed)?;
    Some([first, last + 1])
}

impl SceneBuffers {
    pub fn new(device: &wgpu::Device, pipelines: &Pipelines) -> Self {
        let numbers = [(); 2].map(|()| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("numbers of a scene"),
                size: uniforms::BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let ramp = new_texture(device, [RAMP as u32, 1], wgpu::TextureFormat::Rgba8UnormSrgb, READ);
        let sized = SizedParts::new(device, pipelines, [2; 2], &numbers, &ramp, &sampler);
        Self {
            groups: sized.groups,
            openness_group: sized.openness_group,
            openness_view: sized.openness_view,
            heights: sized.heights,
            values: sized.values,
            numbers,
            ramp,
            sampler,
            shown: None,
            shown_ramp: None,
            surface: None,
            lines: None,
            every: 1,
            probe: None,
            probe_shape: None,
        }
    }

    /// Uploads what differs from what is there.
    pub fn update(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pipelines: &Pipelines,
        picture: &Picture,
    ) -> UploadedChanges {
        let mut changes = UploadedChanges::default();
        if self.shown_ramp.as_ref() != Some(&picture.look.ramp) {
            write_rows(queue, &self.ramp, 0, &picture.look.ramp.texels(), 4 * RAMP as u32);
            self.shown_ramp = Some(picture.look.ramp.clone());
            changes.any = true;
        }
        changes.any |= self.update_probe(device, picture);
        let before = self.shown.replace(Arc::clone(&picture.surface));
        let is_same = before.as_ref().is_some_and(|one| Arc::ptr_eq(one, &picture.surface));
        match &*picture.surface {
            SurfaceData::Field(field) => {
                changes.any |= self.update_lines(device, field, picture);
                if is_same {
                    return changes;
                }
                let before = before.as_deref().and_then(|one| match one {
                    SurfaceData::Field(field) => Some(field),
                    SurfaceData::Mesh(_) => None,
                });
                let field = self.update_field(device, queue, pipelines, before, field);
                UploadedChanges { heights: field.heights, any: changes.any | field.any }
            }
            SurfaceData::Mesh(mesh) => {
                let before = before.as_deref().and_then(|one| match one {
                    SurfaceData::Mesh(mesh) => Some(mesh),
                    SurfaceData::Field(_) => None,
                });
                let every = picture.level.every.max(1);
                if !is_same || every != self.every {
                    changes.any |= self.update_mesh(device, queue, before, (mesh, every));
                }
                changes
            }
        }
    }

    /// Uploads the nodes from the first that differs to the last, or all of another mesh.
    fn update_mesh(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        before: Option<&MeshData>,
        (now, every): (&MeshData, u32),
    ) -> bool {
        self.lines = None;
        let before = before.filter(|one| Arc::ptr_eq(&one.indices, &now.indices));
        let there = self.surface.as_ref().filter(|there| there.nodes.is_some());
        let (Some(before), Some(there)) = (before, there) else {
            self.surface = triangles(device, &now.nodes, &now.indices);
            self.every = 1;
            self.update_mesh_triangles(queue, now, every);
            return true;
        };
        let changed = changed_rows(&before.nodes, &now.nodes, 1);
        if let (Some([first, end]), Some(nodes)) = (changed, &there.nodes) {
            let bytes = bytemuck::cast_slice(now.nodes[first..end].as_flattened());
            queue.write_buffer(nodes, (first * size_of::<[f32; 8]>()) as u64, bytes);
        }
        // Which nodes are left out depends on which have moved.
        let is_other = every != self.every || (every > 1 && changed.is_some());
        if is_other {
            self.update_mesh_triangles(queue, now, every);
        }
        is_other || changed.is_some()
    }

    /// The triangles of a level of detail, in the buffer that has room for all.
    fn update_mesh_triangles(&mut self, queue: &wgpu::Queue, now: &MeshData, every: u32) {
        let Some(there) = &mut self.surface else { return };
        if (self.every, every) != (1, 1) {
            let indices = now.drawn(every);
            queue.write_buffer(&there.indices, 0, bytemuck::cast_slice(&indices));
            there.count = indices.len() as u32;
        }
        self.every = every;
    }

    fn update_field(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pipelines: &Pipelines,
        before: Option<&FieldData>,
        now: &FieldData,
    ) -> UploadedChanges {
        let sides = [now.columns, now.rows];
        let mut before = before;
        if [self.heights.width(), self.heights.height()] != sides {
            let sized =
                SizedParts::new(device, pipelines, sides, &self.numbers, &self.ramp, &self.sampler);
            self.groups = sized.groups;
            self.openness_group = sized.openness_group;
            self.openness_view = sized.openness_view;
            self.heights = sized.heights;
            self.values = sized.values;
            before = None;
        }
        let columns = now.columns as usize;
        let old = before.map_or(&[][..], |field| &field.heights);
        let heights = changed_rows(old, &now.heights, columns);
        if let Some([first, end]) = heights {
            let rows = &now.heights[first * columns..end * columns];
            write_rows(
                queue,
                &self.heights,
                first as u32,
                bytemuck::cast_slice(rows),
                8 * now.columns,
            );
        }
        let old = before.map_or(&[][..], |field| &field.values);
        let values = changed_rows(old, &now.values, columns).filter(|_| !now.values.is_empty());
        if let Some([first, end]) = values {
            let rows = &now.values[first * columns..end * columns];
            write_rows(
                queue,
                &self.values,
                first as u32,
                bytemuck::cast_slice(rows),
                4 * now.columns,
            );
        }
        UploadedChanges {
            heights: heights.is_some(),
            any: heights.is_some() || values.is_some() || old.len() != now.values.len(),
        }
    }

    fn update_lines(
        &mut self,
        device: &wgpu::Device,
        field: &FieldData,
        picture: &Picture,
    ) -> bool {
        let sides = [field.columns, field.rows];
        let every = picture.level.every.max(1);
        let kept = match &picture.probe {
            Some(probe) if every > 1 => [0, 1].map(|axis| {
                let node = (probe.centre[axis] / field.spacing_mm).round();
                (node.max(0.0) as u32).min(sides[axis] - 1)
            }),
            _ => [0; 2],
        };
        let lines = FieldLines { sides, every, kept };
        let is_new = self.lines != Some(lines);
        if is_new {
            self.lines = Some(lines);
            self.surface = Some(field_triangles(device, lines));
        }
        is_new
    }

    fn update_probe(&mut self, device: &wgpu::Device, picture: &Picture) -> bool {
        let size = picture.surface.size_mm();
        let shape = |probe: &Probe| (probe.radius, probe.kind, size);
        let now = picture.probe.as_ref().map(shape);
        let is_new = now.is_some() && now != self.probe_shape;
        if is_new {
            self.probe_shape = now;
            self.probe = picture.probe.as_ref().and_then(|probe| {
                let (nodes, indices) = probe.triangles(size);
                triangles(device, &nodes, &indices)
            });
        }
        is_new
    }
}

/// What has the size of a field.
struct SizedParts {
    heights: wgpu::Texture,
    values: wgpu::Texture,
    openness_view: wgpu::TextureView,
    openness_group: wgpu::BindGroup,
    groups: [wgpu::BindGroup; 2],
}

impl SizedParts {
    fn new(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        sides: [u32; 2],
        numbers: &[wgpu::Buffer; 2],
        ramp: &wgpu::Texture,
        sampler: &wgpu::Sampler,
    ) -> Self {
        let heights = new_texture(device, sides, wgpu::TextureFormat::Rg32Float, READ);
        let values = new_texture(device, sides, wgpu::TextureFormat::R32Float, READ);
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let openness = new_texture(device, sides.map(|side| side.div_ceil(2)), OPENNESS, usage);
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let [heights_view, values_view, openness_view, ramp_view] =
            [&heights, &values, &openness, ramp].map(view);
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let groups = [0, 1].map(|eye: usize| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("scene"),
                layout: &pipelines.scene_layout,
                entries: &[
                    entry(0, numbers[eye].as_entire_binding()),
                    entry(1, wgpu::BindingResource::TextureView(&heights_view)),
                    entry(2, wgpu::BindingResource::TextureView(&values_view)),
                    entry(3, wgpu::BindingResource::TextureView(&ramp_view)),
                    entry(4, wgpu::BindingResource::TextureView(&openness_view)),
                    entry(5, wgpu::BindingResource::Sampler(sampler)),
                ],
            })
        });
        let openness_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("openness"),
            layout: &pipelines.openness_layout,
            entries: &[
                entry(0, numbers[0].as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&heights_view)),
            ],
        });
        Self { heights, values, openness_view, openness_group, groups }
    }
}

/// `None` where there are none.
fn triangles<const N: usize>(
    device: &wgpu::Device,
    nodes: &[[f32; N]],
    indices: &[u32],
) -> Option<Triangles> {
    if indices.is_empty() {
        return None;
    }
    let buffer = |contents: &[u8], usage| {
        let label = Some("triangles");
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    };
    let nodes = nodes.as_flattened();
    Some(Triangles {
        nodes: Some(buffer(
            bytemuck::cast_slice(nodes),
            wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        )),
        indices: buffer(
            bytemuck::cast_slice(indices),
            wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        ),
        count: indices.len() as u32,
    })
}

/// The lines of nodes that are drawn of so many: every so many, the kept and the last.
fn drawn_lines(count: u32, every: u32, kept: u32) -> Vec<u32> {
    let mut lines: Vec<u32> = (0..count).step_by(every as usize).collect();
    lines.extend([kept, count - 1]);
    lines.sort_unstable();
    lines.dedup();
    lines
}

fn field_triangles(device: &wgpu::Device, lines: FieldLines) -> Triangles {
    let FieldLines { sides: [columns, rows], every, kept } = lines;
    let along_x = drawn_lines(columns, every, kept[0]);
    let along_y = drawn_lines(rows, every, kept[1]);
    let mut indices = Vec::with_capacity(6 * along_x.len() * along_y.len());
    for pair in along_y.windows(2) {
        let [row, next] = [pair[0], pair[1]].map(|row| row * columns);
        for cell in along_x.windows(2) {
            let (low, high) = (cell[0], cell[1]);
            indices.extend([
                row + low,
                row + high,
                next + high,
                row + low,
                next + high,
                next + low,
            ]);
        }
    }
    let contents = bytemuck::cast_slice(&indices);
    let usage = wgpu::BufferUsages::INDEX;
    let label = Some("cells");
    let buffer =
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage });
    Triangles { nodes: None, indices: buffer, count: indices.len() as u32 }
}

/// Six vertices for each drawn cell along the border.
pub(super) fn side_vertices(field: &FieldData, every: u32) -> u32 {
    let cells = |side: u32| (side - 1).div_ceil(every);
    12 * (cells(field.columns) + cells(field.rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_changed_are_found() {
        let before = [0.0; 12];
        let mut now = before;
        assert_eq!(changed_rows(&before, &now, 3), None);
        now[4] = 1.0;
        assert_eq!(changed_rows(&before, &now, 3), Some([1, 2]));
        now[11] = 1.0;
        assert_eq!(changed_rows(&before, &now, 3), Some([1, 4]));
        assert_eq!(changed_rows(&before[..9], &now, 3), Some([0, 4]));
    }

    #[test]
    fn thinning_keeps_the_ends_and_the_probe() {
        assert_eq!(drawn_lines(10, 3, 4), [0, 3, 4, 6, 9]);
        assert_eq!(drawn_lines(9, 3, 0), [0, 3, 6, 8]);
        assert_eq!(drawn_lines(4, 1, 0), [0, 1, 2, 3]);
    }
}
