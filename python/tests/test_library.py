"""A search finds what the command finds."""
import shutil

import palpate
import pytest


@pytest.fixture(scope="module")
def home(recorded, command, tmp_path_factory):
    """A library of three sessions, one of them tagged and fitted."""
    home = tmp_path_factory.mktemp("library")
    for name in ("ramp-hold-lab", "hold-until-lab", "over-force-galil"):
        shutil.copytree(recorded.parent / name, home / "sessions" / name)
    command("fit", home / "sessions/ramp-hold-lab", "--save", "all of it")
    command("tag", home / "sessions/ramp-hold-lab", "+pilot")
    return home


def listed(command, home, *words):
    return command("find", *words, "--limit", "1000", home=home)["sessions"]


@pytest.mark.parametrize(("query", "options", "words"), [
    ("", {}, []),
    ("depth>=10mm", {}, ["--where", "depth>=10mm"]),
    ("ramp fit.tau_eps>0.5", {}, ["ramp", "--where", "fit.tau_eps>0.5"]),
    ("protocol:ramp depth>=10mm", {"protocol": "ramp-hold"}, ["protocol:ramp", "--where", "depth>=10mm", "--protocol", "ramp-hold"]),
    ("", {"tag": ["pilot"], "sort": "specimen", "reverse": True}, ["--tag", "pilot", "--sort", "specimen", "--reverse"]),
    ("", {"protocol": "ramp-hold", "limit": 1, "page": 2}, ["--protocol", "ramp-hold", "--page", "2"]),
])
def test_find_is_that_of_the_command(command, home, query, options, words):
    pytest.importorskip("polars")
    found = palpate.library(home).find(query, **options)
    if "limit" in options:
        assert found.to_dicts() == command("find", *words, "--limit", "1", home=home)["sessions"]
    else:
        assert found.to_dicts() == listed(command, home, *words)


def test_other_frames_hold_the_same_sessions(command, home):
    expected = listed(command, home)
    library = palpate.library(home)
    for kind, module in (("pandas", "pandas"), ("arrow", "pyarrow")):
        pytest.importorskip(module)
        found = library.find(frame=kind)
        assert list(found["folder"]) == [one["folder"] for one in expected] or found["folder"].to_pylist() == [
            one["folder"] for one in expected
        ]
    with pytest.warns(palpate.PalpateWarning, match="no session has a value named nonsense"):
        empty = library.find("nonsense>1")
    assert len(empty) == 0 and set(empty.columns) == set(expected[0])


def test_words_of_one_field_are_not_found_in_another(home):
    library = palpate.library(home)
    assert len(library.find("tag:pilot")) == 1 and len(library.find("specimen:pilot")) == 0
    with pytest.raises(palpate.PalpateError, match="'specimn' in 'specimn:pig' is not a field"):
        library.find("specimn:pig")


def test_a_found_session_opens(home):
    library = palpate.library(home)
    (folder,) = library.find(tag="pilot")["folder"]
    session = library.open(folder)
    assert list(session.fits) == ["all of it"] and session.fits["all of it"].parameters["tau_eps"].value > 0
