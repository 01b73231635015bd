//! The `palpate` program: the window, where it is built with one, or one headless command.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "window")]
    return palpate_cli::main(Some(&window::Desktop));
    #[cfg(not(feature = "window"))]
    palpate_cli::main(None)
}

#[cfg(feature = "window")]
mod window {
    use palpate_analysis::window_requests::{PlaybackRequest, WindowOpener, WorkbenchRequest};
    use palpate_window::playback::run_playback;
    use palpate_window::window::{WindowOptions, run_window};

    /// Windows on this computer's screen.
    pub struct Desktop;

    impl WindowOpener for Desktop {
        fn workbench(&self, request: WorkbenchRequest) -> Result<(), String> {
            run_window(WindowOptions::from_request(request))
        }

        fn playback(&self, request: PlaybackRequest) -> Result<(), String> {
            run_playback(request)
        }
    }
}
