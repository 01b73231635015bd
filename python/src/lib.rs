//! `palpate._native`: use cases of palpate as functions of a Python module.
//!
//! An adapter without logic of its own. Arguments are plain values; answers are JSON as the command line prints it, Arrow
//! streams and numpy arrays. Names, defaults and documentation for people are in `palpate/`, beside this folder.

mod command_line;
mod error;
mod fit;
mod library;
mod material;
mod population;
mod run;
mod session;

/// Use cases of palpate; the package `palpate` is the way to them.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::command_line::command_line;
    #[pymodule_export]
    use super::error::PalpateError;
    #[pymodule_export]
    use super::fit::{fit_arrays, fit_session};
    #[pymodule_export]
    use super::library::{default_library, entry_fields, find};
    #[pymodule_export]
    use super::material::fit_material;
    #[pymodule_export]
    use super::population::{find_agreement, find_population};
    #[pymodule_export]
    use super::run::NativeRun;
    #[pymodule_export]
    use super::session::{NativeSession, NativeTable};
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
