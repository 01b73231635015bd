"""Fits of arrays and sessions have the numbers of the command line."""
import math

import numpy as np
import palpate
import pytest


def same(ours, theirs, path="report"):
    """Equal to 1e-12, apart from the duration of the fit."""
    if isinstance(theirs, dict):
        assert ours.keys() == theirs.keys(), path
        for key in theirs:
            if key not in ("seconds", "record"):
                same(ours[key], theirs[key], f"{path}.{key}")
    elif isinstance(theirs, list):
        assert len(ours) == len(theirs), path
        for number, (one, other) in enumerate(zip(ours, theirs)):
            same(one, other, f"{path}[{number}]")
    elif isinstance(theirs, float):
        assert math.isclose(ours, theirs, rel_tol=1e-12, abs_tol=1e-300), (path, ours, theirs)
    else:
        assert ours == theirs, path


@pytest.mark.parametrize("family", [None, "series-3", "prony-2"])
def test_fit_of_arrays_is_that_of_a_table(command, arrays, table, family):
    fit = palpate.fit(*arrays, family=family)
    words = ["--family", family] if family else []
    same(fit.to_dict(), command("fit", table, *words))


def test_fixed_and_free_parameters_and_intervals_are_those_of_the_command(command, arrays, table):
    thin = [column[::50] for column in arrays]
    path = table.with_name("thin.csv")
    path.write_text("t_s,depth_mm,force_N\n" + "\n".join(",".join(map(repr, row)) for row in zip(*(c.tolist() for c in thin))))
    fit = palpate.fit(*thin, fixed={"f0": 0.0}, free="x_contact", profile=True, bootstrap=40, seed=7)
    options = ["--fixed", "f0=0", "--free", "x_contact", "--profile", "--bootstrap", "40", "--seed", "7"]
    same(fit.to_dict(), command("fit", path, *options))
    assert fit.parameters["f0"].is_fixed and not fit.parameters["x_contact"].is_fixed


def test_several_arrays_are_one_joint_fit(command, arrays, table):
    halves = [[column[:30000] for column in arrays], [column[::2] for column in arrays]]
    paths = []
    for number, half in enumerate(halves):
        paths.append(table.with_name(f"half-{number}.csv"))
        rows = zip(*(column.tolist() for column in half))
        paths[-1].write_text("t_s,depth_mm,force_N\n" + "\n".join(",".join(map(repr, row)) for row in rows))
    t, depth, force = zip(*halves)
    joint = palpate.fit(list(t), list(depth), list(force), share=["tau_eps", "mu1"])
    same(joint.to_dict(), command("fit", *paths, "--share", "tau_eps,mu1"))
    first, second = joint.records
    assert first.parameters["tau_eps"].value == second.parameters["tau_eps"].value
    assert first.parameters["mu3"].value != second.parameters["mu3"].value
    assert [len(record.curves) for record in joint.records] == [1, 1]
    assert "2 records together, shared: tau_eps, mu1" in repr(joint)
    # Without names all parameters of the specimen are shared.
    assert palpate.fit(list(t), list(depth), list(force))["shared"] == ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"]


def test_fit_of_a_session_is_that_of_the_command(command, recorded):
    session = palpate.open(recorded)
    fit = session.fit()
    same(fit.to_dict(), command("fit", recorded))
    same(session.fit("maxwell", systematic=False).to_dict(), command("fit", recorded, "--family", "maxwell", "--no-systematic"))
    tau = fit.parameters["tau_eps"]
    assert tau.ci95[0] < tau.value < tau.ci95[1] and tau.budget["noise"] > 0
    assert repr(fit).splitlines()[1].startswith("  tau_eps = ") and "±" in repr(fit)
    # The curve is on the time axis of the samples.
    (curve,) = fit.curves
    samples = session.samples("numpy", phase="ramp,hold", columns="t_s,force_N")
    np.testing.assert_allclose(curve.t, samples["t_s"], atol=1e-9)
    known = np.isfinite(curve.force)
    np.testing.assert_array_equal(curve.force[known], samples["force_N"][known])
    assert np.sqrt(np.mean((curve.force - curve.modelled)[known] ** 2)) == pytest.approx(fit["rmse_n"], rel=1e-6)


def test_saved_fit_is_stored_with_the_session(command, session):
    opened = palpate.open(session)
    assert opened.fits == {}
    made = opened.fit(save="whole hold", by="Ada", reason="first look")
    assert dict(opened.fits["whole hold"]) == dict(made)
    (stored,) = command("info", session)["analyses"]
    assert (stored["name"], stored["by"], stored["reason"]) == ("whole hold", "Ada", "first look")
    with pytest.raises(palpate.PalpateError, match="already has an analysis 'whole hold'"):
        opened.fit(save="whole hold")


def test_uncertain_and_censored_forces_count_as_they_should(arrays):
    t, depth, force = (column[::20] for column in arrays)
    plain = palpate.fit(t, depth, force)
    # A common uncertainty changes no value, and a censored force may be anything.
    weighted = palpate.fit(t, depth, force, sigma=0.02)
    assert weighted.parameters["mu1"].value == pytest.approx(plain.parameters["mu1"].value, rel=1e-9)
    sigma, wrong = np.full(len(t), 0.02), force.copy()
    sigma[100:200], wrong[100:200] = np.inf, np.nan
    assert palpate.fit(t, depth, wrong, sigma=sigma)["censored"] == 100


def test_every_kind_of_array_is_taken(arrays):
    polars = pytest.importorskip("polars")
    t, depth, force = (column[::50] for column in arrays)
    expected = palpate.fit(t, depth, force).parameters["tau_eps"].value
    for kind in (list, polars.Series, lambda column: np.repeat(column, 2)[::2]):
        assert palpate.fit(kind(t), kind(depth), kind(force)).parameters["tau_eps"].value == expected
