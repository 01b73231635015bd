//! Pictures without a window.

use crate::gpu::{AdapterAbilities, Output, TissueRenderer};
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
    abilities: AdapterAbilities,
    adapter: String,
}

impl OffScreen {
    /// On the adapter that the system gives first. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` choose nothing here.
    pub fn new() -> Result<Self, OffScreenError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
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
        let abilities = AdapterAbilities::of(&adapter);
        let renderer = TissueRenderer::checked(&device, window, abilities).map_err(|err| {
            OffScreenError::NoDevice { adapter: name.clone(), reason: err.to_string() }
        })?;
        Ok(Self { device, queue, renderer, abilities, adapter: name })
    }

    /// Name and interface of the adapter.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    #[must_use]
    pub fn abilities(&self) -> AdapterAbilities {
        self.abilities
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

    /// The picture as it comes into a window of so many pixels, enlarged where its level has fewer.
    pub fn window(
        &mut self,
        picture: &Picture,
        screen: &Screen,
    ) -> Result<Image<[u8; 4]>, OffScreenError> {
        let mut encoder = self.encode(picture, screen);
        let read = self.copy_out(&mut encoder, &screen.texture, 4);
        self.queue.submit([encoder.finish()]);
        self.pixels(&read)
    }

    /// Hands a picture to the adapter as the window does, its copy to the screen included, and does not wait.
    pub fn submit(&mut self, picture: &Picture, screen: &Screen) {
        let encoder = self.encode(picture, screen);
        self.queue.submit([encoder.finish()]);
    }

    fn encode(&mut self, picture: &Picture, screen: &Screen) -> wgpu::CommandEncoder {
        let size = [screen.texture.width(), screen.texture.height()];
        let mut encoder = self.encoder();
        self.renderer.prepare(&self.device, &self.queue, &mut encoder, picture, size);
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
        drop(pass);
        encoder
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
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
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Screen { texture, view }
    }

    fn read<T: bytemuck::Pod>(
        &mut self,
        picture: &Picture,
        size_px: [u32; 2],
        output: Output,
    ) -> Result<Image<T>, OffScreenError> {
        let mut encoder = self.encoder();
        self.renderer.draw(&self.device, &self.queue, &mut encoder, picture, (size_px, output));
        let lost = || OffScreenError::Read("there is no texture".to_owned());
        let texture = self.renderer.targets().ok_or_else(lost)?;
        let read = self.copy_out(&mut encoder, texture, size_of::<T>() as u32);
        self.queue.submit([encoder.finish()]);
        self.pixels(&read)
    }

    /// A copy of a texture to where it can be read, of so many bytes to a pixel.
    fn copy_out(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        pixel_bytes: u32,
    ) -> ReadBuffer {
        let size = [texture.width(), texture.height()];
        // Rows of a copy begin at multiples of 256 bytes (W3C, "WebGPU", bytesPerRow).
        let alignment = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
        let row_bytes = (size[0] * pixel_bytes).next_multiple_of(alignment);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read"),
            size: u64::from(row_bytes) * u64::from(size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_bytes),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        ReadBuffer { buffer, size, row_bytes }
    }

    fn pixels<T: bytemuck::Pod>(&self, read: &ReadBuffer) -> Result<Image<T>, OffScreenError> {
        let (sender, receiver) = std::sync::mpsc::sync_channel(1);
        read.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits below.
            let _ = sender.send(result);
        });
        self.wait()?;
        let failed = |err: String| OffScreenError::Read(err);
        let mapped = receiver.recv().map_err(|err| failed(err.to_string()))?;
        mapped.map_err(|err| failed(err.to_string()))?;
        let view = read.buffer.get_mapped_range(..).map_err(|err| failed(err.to_string()))?;
        let line_bytes = read.size[0] as usize * size_of::<T>();
        let mut pixels = Vec::with_capacity(read.size[0] as usize * read.size[1] as usize);
        for line in view.chunks_exact(read.row_bytes as usize) {
            let line = line[..line_bytes].chunks_exact(size_of::<T>());
            pixels.extend(line.map(bytemuck::pod_read_unaligned::<T>));
        }
        Ok(Image { size: read.size, pixels })
    }
}

/// A texture on its way to where it can be read.
struct ReadBuffer {
    buffer: wgpu::Buffer,
    size: [u32; 2],
    row_bytes: u32,
}

/// A texture in place of a window.
#[derive(Debug)]
pub struct Screen {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

/// Pixels row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// Width and height.
    pub size: [u32; 2],
    pub pixels: Vec<T>,
}
