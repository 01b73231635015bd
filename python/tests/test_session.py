"""Samples are those of an export, whatever frame they are in."""
import palpate
import pytest


@pytest.fixture(scope="module")
def exported(command, recorded, tmp_path_factory):
    """The parquet file of `palpate export`."""
    return command("export", recorded, "--format", "parquet", "--to", tmp_path_factory.mktemp("export"))["file"]


def test_polars_samples_are_those_of_the_export(recorded, exported):
    polars = pytest.importorskip("polars")
    from polars.testing import assert_frame_equal

    session = palpate.open(recorded)
    samples = session.samples()
    assert isinstance(samples, polars.DataFrame) and len(samples) == len(session)
    assert_frame_equal(samples, polars.read_parquet(exported))


def test_pandas_and_arrow_samples_are_those_of_the_export(recorded, exported):
    pandas, parquet = pytest.importorskip("pandas"), pytest.importorskip("pyarrow.parquet")
    session = palpate.open(recorded)
    table, file = session.samples("arrow"), parquet.read_table(exported)
    assert table.column_names == file.column_names and table.num_rows == file.num_rows
    for name in table.column_names:
        ours, theirs = table[name].combine_chunks(), file[name].combine_chunks()
        assert ours.cast(theirs.type).equals(theirs), name
    for key in (b"palpate.columns", b"palpate.session", b"palpate.calibration_sha256"):
        assert table.schema.metadata[key] == file.schema.metadata[key]
    frame = session.samples("pandas")
    pandas.testing.assert_frame_equal(frame, file.to_pandas(), check_dtype=False)
    assert '"force_N":"N"' in frame.attrs["palpate.columns"]


def test_frames_share_the_memory_of_the_samples(recorded):
    polars, pyarrow = pytest.importorskip("polars"), pytest.importorskip("pyarrow")
    native = palpate.open(recorded)._native
    everything = dict.fromkeys(("from_s", "until_s", "decimate"))
    everything.update(columns=["t_s", "force_N"], phases=[], cycles=[])
    table = native.samples(everything, False)

    def places(frame):
        return [chunk.buffers()[1].address for name in ("t_s", "force_N") for chunk in frame[name].chunks]

    first = places(pyarrow.table(table))
    assert first == places(pyarrow.table(table))
    # A frame of polars hands its cells on without a copy, so they are at the same place.
    assert first == places(polars.DataFrame(table).to_arrow())


def test_selections_are_those_of_the_export(command, recorded, tmp_path):
    polars = pytest.importorskip("polars")
    from polars.testing import assert_frame_equal

    session = palpate.open(recorded)
    hold = session.samples(phase=["ramp", "hold"], columns=["t_s", "force_N", "sample"], decimate=10, from_s=80.0, until_s=90)
    options = ["--phase", "ramp,hold", "--columns", "t_s,force_N,sample", "--decimate", "10", "--from", "80", "--until", "90"]
    file = command("export", recorded, "--format", "parquet", "--to", tmp_path, *options)["file"]
    assert_frame_equal(hold, polars.read_parquet(file))
    numbers = session.samples("numpy", cycle=1)
    assert "phase" not in numbers and len(numbers["t_s"]) == len(session.samples(cycle=[1]))


def test_masked_forces_are_empty_as_in_the_export(command, session, tmp_path):
    polars = pytest.importorskip("polars")
    from polars.testing import assert_frame_equal

    command("mask", session, "--name", "knock", "--leave-out", "85..86")
    file = command("export", session, "--format", "parquet", "--to", tmp_path, "--analysis", "knock")["file"]
    masked = palpate.open(session, analysis="knock").samples()
    assert_frame_equal(masked, polars.read_parquet(file))
    assert masked["force_N"].null_count() > palpate.open(session).samples()["force_N"].null_count()


def test_a_session_tells_what_it_contains(command, recorded):
    session, info = palpate.open(recorded), command("info", recorded)
    assert session.manifest["session_id"] == info["session_id"]
    assert (len(session), session.notes, session.fits) == (info["samples"], info["notes"], {})
    assert session.end["outcome"] == info["ending"]
    kinds = [event["kind"] for event in session.events]
    assert {"input", "decision", "fit"} >= set(kinds) >= {"decision"}
    assert [event["order"] for event in session.events] == sorted(event["order"] for event in session.events)
    assert "ramp-hold" in repr(session)


def test_plot_draws_force_depth_and_fit(recorded, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    session = palpate.open(recorded)
    axes = palpate.plot(session, fit=session.fit())
    measured, modelled = axes.lines
    samples = session.samples("numpy", columns="force_N")
    assert measured.get_ydata().max() == max(value for value in samples["force_N"] if value == value)
    assert 1000 < len(measured.get_ydata()) < 10000 and len(modelled.get_xdata()) > 1000
    axes.figure.savefig(tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 10_000
    assert palpate.plot(recorded, ax=axes) is axes
    matplotlib.pyplot.close("all")
