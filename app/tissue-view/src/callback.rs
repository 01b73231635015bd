//! The picture in a panel of the window.

use crate::gpu::TissueRenderer;
use crate::picture::Picture;
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor, wgpu};
use epaint::PaintCallbackInfo;

/// Draws a picture with the [`TissueRenderer`] that is kept in the window's `CallbackResources`; nothing without one.
///
/// `prepare` uploads what changed and draws into a texture with depth; `paint` copies it to the panel. There is one
/// renderer, so one picture to a window.
#[derive(Debug)]
pub struct TissueCallback {
    pub picture: Picture,
    /// Width and height of the panel in pixels of the screen.
    pub size_px: [u32; 2],
}

impl CallbackTrait for TissueCallback {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(renderer) = resources.get_mut::<TissueRenderer>() {
            renderer.prepare(device, queue, encoder, &self.picture, self.size_px);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        if let Some(renderer) = resources.get::<TissueRenderer>() {
            renderer.paint(pass);
        }
    }
}
