//! Pictures without a window.

use crate::gpu::{Output, TissueRenderer, samples_of};
use crate::picture::Picture;
use egui_wgpu::wgpu;
use thiserror::Error;

/// A picture that could not be made off the screen.
#[derive(Debug, Error)]
pub enum OffScreenError {
    #[error("there is no graphics adapter: {0}")]
    NoAdapter(String),
    #[error("the graphics adapter {adapter} gives no device: {reason}")]
    NoDevice { adapter: String, reason: String },
    #[error("the picture cannot be read from the graphics adapter: {0}")]
    Read(String),
}

/// An adapter and a renderer on it.
#[derive(Debug)]
pub struct OffScreen {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: TissueRenderer,
    adapter: String,
}

impl OffScreen {
    /// On the adapter that the system gives first. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` choose nothing here.
    pub fn new() -> Result<Self, OffScreenError> {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions::default();
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|err| OffScreenError::NoAdapter(err.to_string()))?;
        let info = adapter.get_info();
        let name = format!("{} ({:?})", info.name, info.backend);
        let limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        let descriptor =
            wgpu::DeviceDescriptor { required_limits: limits, ..wgpu::DeviceDescriptor::default() };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|err| {
                OffScreenError::NoDevice { adapter: name.clone(), reason: err.to_string() }
            })?;
        let window = wgpu::TextureFormat::Rgba8Unorm;
        let renderer = TissueRenderer::new(&device, window, samples_of(&adapter));
        Ok(Self { device, queue, renderer, adapter: name })
    }

    /// Name and interface of the adapter.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    #[must_use]
    pub fn renderer(&self) -> &TissueRenderer {
        &self.renderer
    }

    /// A picture of so many pixels as red, green, blue and opacity (sRGB), row by row from the top. A level of less
    /// resolution gives fewer pixels.
    pub fn colours(
        &mut self,
        picture: &Picture,
        size_px: [u32; 2],
    ) -> Result<Image<[u8; 4]>, OffScreenError> {
        self.read(picture, size_px, Output::Colours)
    }

    /// Normals of a picture, row by row from the top: a unit vector, and the distance along the line of sight in mm, which
    /// is negative for the probe. All zero where there is nothing.
    pub fn normals(
        &mut self,
        picture: &Picture,
        size_px: [u32; 2],
    ) -> Result<Image<[f32; 4]>, OffScreenError> {
        self.read(picture, size_px, Output::Normals)
    }

    /// Hands a picture to the adapter as the window does, its copy to the screen included, and does not wait.
    pub fn submit(&mut self, picture: &Picture, screen: &Screen) {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.prepare(&self.device, &self.queue, &mut encoder, picture, screen.size);
        {
            let attachment = wgpu::RenderPassColorAttachment {
                view: &screen.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(attachment)],
                ..wgpu::RenderPassDescriptor::default()
            });
            self.renderer.paint(&mut pass);
        }
        self.queue.submit([encoder.finish()]);
    }

    /// Waits until all that was handed over is drawn.
    pub fn wait(&self) -> Result<(), OffScreenError> {
        let poll = self.device.poll(wgpu::PollType::wait_indefinitely());
        poll.map(|_| ()).map_err(|err| OffScreenError::Read(err.to_string()))
    }

    /// A texture in place of a window.
    #[must_use]
    pub fn screen(&self, size: [u32; 2]) -> Screen {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("screen"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Screen { view: texture.create_view(&wgpu::TextureViewDescriptor::default()), size }
    }

    fn read<T: bytemuck::Pod>(
        &mut self,
        picture: &Picture,
        size_px: [u32; 2],
        output: Output,
    ) -> Result<Image<T>, OffScreenError> {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.draw(&self.device, &self.queue, &mut encoder, picture, (size_px, output));
        let lost = || OffScreenError::Read("there is no texture".to_owned());
        let texture = self.renderer.targets().ok_or_else(lost)?;
        let size = [texture.width(), texture.height()];
        let pixel = size_of::<T>() as u32;
        // Rows of a copy begin at multiples of 256 bytes (WebGPU, "bytesPerRow").
        let row = (size[0] * pixel).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read"),
            size: u64::from(row) * u64::from(size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::sync_channel(1);
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits below.
            let _ = sender.send(result);
        });
        self.wait()?;
        let failed = |err: String| OffScreenError::Read(err);
        let mapped = receiver.recv().map_err(|err| failed(err.to_string()))?;
        mapped.map_err(|err| failed(err.to_string()))?;
        let view = buffer.get_mapped_range(..).map_err(|err| failed(err.to_string()))?;
        let mut pixels = Vec::with_capacity((size[0] * size[1]) as usize);
        for line in view.chunks_exact(row as usize) {
            let line = &line[..(size[0] * pixel) as usize];
            pixels.extend(line.chunks_exact(pixel as usize).map(bytemuck::pod_read_unaligned::<T>));
        }
        Ok(Image { size, pixels })
    }
}

/// A texture in place of a window.
#[derive(Debug)]
pub struct Screen {
    view: wgpu::TextureView,
    size: [u32; 2],
}

/// Pixels row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// Width and height.
    pub size: [u32; 2],
    pub pixels: Vec<T>,
}
