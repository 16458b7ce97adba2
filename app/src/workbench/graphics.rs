//! What draws the window: the adapter that it would choose.

use re_viewer::external::eframe::egui_wgpu::{RenderState, RendererOptions, wgpu};
use re_viewer::external::{re_renderer, tokio};

/// A graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// Through what it is spoken to.
    pub backend: String,
    /// Whether it is the processor that draws.
    pub software: bool,
}

/// Sets up a device as the window does, without a window, and tells which adapter it is on.
///
/// # Errors
/// Why there is none that the viewer can use, in one line.
pub fn adapter() -> Result<Adapter, String> {
    let options = re_viewer::native::eframe_options(None).wgpu_options;
    let runtime = tokio::runtime::Builder::new_current_thread().build().map_err(|error| error.to_string())?;
    let state = runtime.block_on(async {
        let instance = options.wgpu_setup.new_instance().await;
        RenderState::create(&options, &instance, None, RendererOptions::default()).await
    });
    let adapter = state.map_err(|error| one_line(&error.to_string()))?.adapter;
    re_renderer::device_caps::DeviceCaps::from_adapter(&adapter).map_err(|error| one_line(&error.to_string()))?;
    let info = adapter.get_info();
    let software = info.device_type == wgpu::DeviceType::Cpu;
    Ok(Adapter { name: info.name, backend: format!("{:?}", info.backend), software })
}

fn one_line(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}
