//! A session: what it contains, and its samples as a table.

use crate::error::refused;
use numpy::{IntoPyArray, PyArray1};
use palpate_analysis::analysed_session::{StreamedAnalysis, stream_analysed};
use palpate_analysis::exports::sample_table;
use palpate_model::rig::Phase;
use palpate_sessions::EntryKind;
use palpate_tables::export::{SampleSelection, SampleTable};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::PathBuf;

/// A recorded session, read through once, so that it is known to be whole.
#[pyclass(frozen, module = "palpate._native")]
pub struct NativeSession {
    path: PathBuf,
    read: StreamedAnalysis,
}

fn text_of(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(refused)
}

fn phase(name: &str) -> PyResult<Phase> {
    let found = Phase::ALL.into_iter().find(|phase| phase.name() == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = Phase::ALL.iter().map(|phase| phase.name()).collect();
        refused(format!("'{name}' is not a phase; the phases are {}", names.join(", ")))
    })
}

/// Which samples and columns of a session: the options of `palpate export`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Selection {
    columns: Vec<String>,
    phases: Vec<String>,
    cycles: Vec<u32>,
    from_s: Option<f64>,
    until_s: Option<f64>,
    decimate: Option<u64>,
}

impl Selection {
    fn read(self) -> PyResult<SampleSelection> {
        if let (Some(from), Some(until)) = (self.from_s, self.until_s)
            && from > until
        {
            return Err(refused(format!(
                "from_s {from} is after until_s {until}; give the earlier time as from_s"
            )));
        }
        if self.decimate == Some(0) {
            return Err(refused("decimate 0 leaves no sample; give 1 or more"));
        }
        Ok(SampleSelection {
            phases: self.phases.iter().map(|name| phase(name)).collect::<PyResult<_>>()?,
            cycles: self.cycles,
            columns: self.columns,
            from_s: self.from_s,
            to_s: self.until_s,
            every: self.decimate.filter(|every| *every > 1),
        })
    }
}

#[pymethods]
impl NativeSession {
    /// Opens a session folder, or the file of its log, as an analysis of it does.
    #[new]
    fn new(py: Python<'_>, path: PathBuf, analysis: Option<String>) -> PyResult<Self> {
        let read = py.detach(|| stream_analysed(&path, analysis.as_deref())).map_err(refused)?;
        Ok(Self { path, read })
    }

    /// The manifest as JSON, with the calibration that the forces are made with.
    fn manifest(&self) -> PyResult<String> {
        text_of(&self.read.edited.outline.manifest)
    }

    /// The end record as JSON; null if the recording was interrupted.
    fn end(&self) -> PyResult<String> {
        text_of(&self.read.edited.outline.end)
    }

    /// Remarks that a user of the data must know.
    fn notes(&self) -> Vec<String> {
        self.read.edited.outline.notes.clone()
    }

    /// Number of samples.
    fn sample_count(&self) -> u64 {
        self.read.edited.outline.samples
    }

    /// Inputs, decisions and fits of the run as a list in JSON.
    fn events(&self, py: Python<'_>) -> PyResult<String> {
        let entries = &self.read.edited.outline.entries;
        py.detach(|| {
            let events = entries.iter().map(|entry| {
                let kind = match entry.kind {
                    EntryKind::Input => "input",
                    EntryKind::Decision => "decision",
                    EntryKind::Fit => "fit",
                };
                json!({
                    "order": entry.order, "kind": kind, "session_time_s": entry.now.seconds().0,
                    "after_sample": entry.after_sample, "body": entry.body,
                })
            });
            text_of(&events.collect::<Vec<Value>>())
        })
    }

    /// Edits as a list in JSON.
    fn edits(&self) -> PyResult<String> {
        text_of(&self.read.edited.edits.all)
    }

    /// Analyses that are not withdrawn, as a list in JSON.
    fn analyses(&self) -> PyResult<String> {
        text_of(&self.read.analyses.active().collect::<Vec<_>>())
    }

    /// The selected samples. Texts are plain Arrow texts on request, else views.
    fn samples(
        &self,
        py: Python<'_>,
        selection: Selection,
        has_plain_texts: bool,
    ) -> PyResult<NativeTable> {
        let selection = selection.read()?;
        let table = py.detach(|| sample_table(&self.read, &self.path, &selection));
        Ok(NativeTable { table: table.map_err(refused)?, has_plain_texts })
    }
}

/// Samples in memory, for every library that reads Arrow's PyCapsule interface.
#[pyclass(frozen, module = "palpate._native")]
pub struct NativeTable {
    table: SampleTable,
    has_plain_texts: bool,
}

#[pymethods]
impl NativeTable {
    /// A stream over the same cells; a requested schema is the reader's to convert to.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let stream = self.table.stream(self.has_plain_texts);
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    fn __len__(&self) -> usize {
        self.table.rows()
    }

    /// Names of the columns, in order.
    fn names(&self) -> Vec<String> {
        self.table.names()
    }

    /// A column of numbers, NaN where a cell is empty; `None` for text.
    fn numbers<'py>(&self, py: Python<'py>, name: &str) -> Option<Bound<'py, PyArray1<f64>>> {
        let numbers = py.detach(|| self.table.numbers(name))?;
        Some(numbers.into_pyarray(py))
    }

    /// Units and provenance, as in exported files.
    fn metadata(&self) -> Vec<(String, String)> {
        self.table.metadata()
    }
}
