"""The notebooks run from a folder of their own, in a kernel of this environment, and what they assert holds."""
import re
from pathlib import Path

import pytest

nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))
each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
COLOUR = re.compile("\x1b\\[[0-9;]*m")


@each_notebook
def test_notebook_runs(path, tmp_path, monkeypatch):
    # Figures are drawn into the notebook, as in Jupyter.
    monkeypatch.delenv("MPLBACKEND", raising=False)
    for name in ("PALPATE_HOME", "IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    folder = tmp_path / "folder"
    folder.mkdir()
    notebook = nbformat.read(path, as_version=4)
    # A cell records many sessions, on a computer that may be busy.
    client = nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    failure = None
    try:
        client.execute()
    except nbclient.exceptions.CellExecutionError as error:
        failure = COLOUR.sub("", str(error))
    if failure is not None:
        # The traceback of the cell, without that of the test around it.
        pytest.fail(failure, pytrace=False)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    said = [output.text for output in outputs if output.get("name") == "stderr"]
    assert not said, "".join(said)


@each_notebook
def test_notebook_is_stored_without_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    cells = notebook.cells
    for before, cell in zip([None, *cells], cells):
        # A person gave the name of a cell, so it stays when the cell changes.
        assert re.fullmatch("[a-z]+(-[a-z]+)*", cell.id), cell.id
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None, f"{cell.id} has outputs; clear them before you save"
            assert before is not None and before.cell_type == "markdown", f"nothing says what {cell.id} is for"
    assert cells[0].source.startswith("# ")
    assert path.stat().st_size < 20_000


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 4
