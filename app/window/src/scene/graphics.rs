//! The graphics adapter of the window, as far as the picture of a scene needs it.

use eframe::egui_wgpu::RenderState;
use palpate_tissue_view::{AdapterAbilities, TissueRenderer};

/// Why there is no picture where the window is not drawn by an adapter that can.
const NO_ADAPTER: &str = "This window is drawn without a graphics adapter, so there is no picture of the scene; numbers, \
                          plots, keys and pointer work as usual.";

/// Whether the renderer of pictures is made.
#[derive(Clone, Debug, Default)]
enum PictureRenderer {
    /// It takes a moment, so it is made with the first picture.
    #[default]
    NotYet,
    Made(AdapterAbilities),
    Refused(String),
}

/// The adapter, and the time of a frame.
#[derive(Default)]
pub struct PictureGraphics {
    adapter: Option<RenderState>,
    renderer: PictureRenderer,
    /// What the last frame took in ms, while frames follow each other.
    pub frame_ms: Option<f64>,
}

impl PictureGraphics {
    /// Takes the adapter that the window is drawn with.
    pub fn take(&mut self, adapter: Option<&RenderState>) {
        if self.adapter.is_none() {
            self.adapter = adapter.cloned();
        }
    }

    /// Makes the renderer if there is none yet; otherwise the sentence in place of the picture.
    pub fn abilities(&mut self) -> Result<AdapterAbilities, &str> {
        let Some(adapter) = &self.adapter else { return Err(NO_ADAPTER) };
        if matches!(self.renderer, PictureRenderer::NotYet) {
            self.renderer = make(adapter);
        }
        match &self.renderer {
            PictureRenderer::Made(abilities) => Ok(*abilities),
            PictureRenderer::Refused(reason) => Err(reason.as_str()),
            PictureRenderer::NotYet => Err(NO_ADAPTER),
        }
    }
}

fn make(adapter: &RenderState) -> PictureRenderer {
    let abilities = AdapterAbilities::of(&adapter.adapter);
    match TissueRenderer::checked(&adapter.device, adapter.target_format, abilities) {
        Ok(renderer) => {
            adapter.renderer.write().callback_resources.insert(renderer);
            PictureRenderer::Made(abilities)
        }
        Err(refused) => PictureRenderer::Refused(format!(
            "There is no picture of the scene, because {refused}. Update the driver of the graphics adapter; numbers, \
             plots, keys and pointer work as usual."
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_an_adapter_there_is_a_sentence() {
        let mut graphics = PictureGraphics::default();
        graphics.take(None);
        assert!(graphics.abilities().unwrap_err().contains("without a graphics adapter"));
    }
}
