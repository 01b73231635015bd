"""The examples of the docstrings and of the guide run, and print what they show."""
import doctest
import importlib
import pkgutil
import re

import palpate
import pytest

from pathlib import Path

GUIDE = Path(__file__).resolve().parents[2] / "docs/guide/python.md"
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.fixture()
def workplace(tmp_path, monkeypatch):
    """A folder with a session `demo`, as the pages assume."""
    matplotlib = pytest.importorskip("matplotlib")
    pytest.importorskip("polars")
    matplotlib.use("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PALPATE_HOME", str(tmp_path))


def modules():
    return [one.name for one in pkgutil.iter_modules(palpate.__path__) if one.name not in ("ray", "__main__", "_native")]


@pytest.mark.parametrize("name", ["", *modules()])
def test_docstrings(workplace, name):
    palpate.run("ramp-hold", depth=6, hold=10, time_scale="max", out="demo").wait()
    if name == "bluesky":
        pytest.importorskip("ophyd_async", reason="ophyd-async is not installed")
    module = importlib.import_module(f"palpate.{name}") if name else palpate
    failed, _ = doctest.testmod(module, optionflags=OPTIONS, extraglobs={"palpate": palpate})
    assert failed == 0


def test_guide(workplace):
    text = GUIDE.read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) >= 5
    # Later blocks go on where earlier ones ended, as a reader does.
    page = "\n".join(blocks)
    test = doctest.DocTestParser().get_doctest(page, {}, "python.md", str(GUIDE), 0)
    assert test.examples
    report = []
    doctest.DocTestRunner(optionflags=OPTIONS).run(test, out=report.append)
    assert not report, "".join(report)


def test_every_public_name_is_documented():
    for name in palpate.__all__:
        one = getattr(palpate, name)
        assert name == "__version__" or (one.__doc__ or "").strip(), name
