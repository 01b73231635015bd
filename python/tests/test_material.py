"""Moduli of a press are those of the command line."""
import shutil

import numpy as np
import palpate
import pytest

PRESS = {"radius": (6.00, 0.02), "thickness": (60.0, 0.5), "poisson": (0.49, 0.01), "depth_max": 0.9}
WORDS = ["--indenter", "flat-punch", "--radius", "6.00±0.02", "--thickness", "60.0±0.5", "--poisson", "0.49±0.01", "--depth-max", "0.9"]


def test_modulus_of_a_session_is_that_of_the_command(command, recorded):
    found = palpate.open(recorded).material("flat-punch", **PRESS)
    expected = command("material", recorded, *WORDS)
    # Whose command it is stands in no report.
    for key in expected.keys() - found.keys():
        assert key in ("command", "version")
    assert found.to_dict() == {key: expected[key] for key in found}
    assert found.modulus_kpa == pytest.approx(1e3 * expected["modulus_mpa"], rel=1e-12)
    assert repr(found).startswith("Young's modulus")
    # The curve is that of which the residuals are stated.
    assert len(found.depth) == found["samples"] and found.depth.max() == pytest.approx(found["depth_mm"])
    rms = np.sqrt(np.mean((found.force - found.law_force) ** 2))
    assert rms == pytest.approx(found["residual_n"], rel=1e-9)


def test_every_option_is_the_one_of_the_command(command, tmp_path):
    table = tmp_path / "press.csv"
    depth = np.linspace(-0.05, 0.3, 200)
    force = 0.0125 / (1 - 0.45**2) * 4 / 3 * np.sqrt(8.0) * np.clip(depth, 0, None)**1.5 + 1e-5 * np.sin(12.9898 * np.arange(200))
    rows = (f"{t!r},{x!r},{f!r}" for t, x, f in zip((depth + 0.05).tolist(), depth.tolist(), force.tolist()))
    table.write_text("\n".join(["t_s,depth_mm,force_N", *rows, ""]))
    sphere = {"radius": 8, "thickness": 500, "poisson": 0.45}
    words = ["--indenter", "sphere", "--radius", 8, "--thickness", 500, "--poisson", 0.45]
    # The modulus that made the table.
    assert palpate.material(table, "sphere", law="hertz", **sphere).modulus_kpa == pytest.approx(12.5, rel=5e-3)
    for options, flags in [
        ({"law": "hertz", "contact_error": 0}, ["--law", "hertz", "--contact-error", 0]),
        ({"law": "sneddon", "contact_error": "free", "zero_error": 1e-4},
         ["--law", "sneddon", "--contact-error", "free", "--zero-error", 1e-4]),
        ({"base": "frictionless", "poisson_measured": True}, ["--base", "frictionless", "--poisson-measured"]),
    ]:
        found = palpate.material(table, "sphere", **sphere, **options)
        expected = command("material", table, *words, *flags)
        assert found.to_dict() == {key: expected[key] for key in found}


def write_table(path, t, depth, force):
    rows = (f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), depth.tolist(), force.tolist()))
    path.write_text("\n".join(["t_s,depth_mm,force_N", *rows, ""]))
    return path


def same_as_command(command, found, *words):
    expected = command("material", found["source"], *words)
    assert found.to_dict() == {key: expected[key] for key in found}


#: A flat punch, of which the force is `4 R / (1 - nu) G d`, and its options.
PUNCH = {"radius": 3, "thickness": 800, "poisson": 0.45, "law": "sneddon"}
PUNCH_WORDS = ["--indenter", "flat-punch", "--radius", 3, "--thickness", 800, "--poisson", 0.45, "--law", "sneddon"]
PER_MM = 4 * 3 / (1 - 0.45)
NOISE = 1e-6 * np.sin(12.9898 * np.arange(4001) ** 2)


def test_modulus_of_an_unloading_is_the_one_that_made_it(command, tmp_path):
    depth = 0.001 * (200.0 - np.abs(np.arange(401) - 200.0))
    # Sneddon's cone.
    force = 2 / np.pi * 0.0125 / (1 - 0.45**2) * np.tan(np.radians(75)) * depth**2
    table = write_table(tmp_path / "back.csv", 0.01 * np.arange(401), depth, force)
    cone = {"half_angle": 75, "thickness": 5000, "poisson": (0.45, 0.01), "contact_error": 0}
    found = palpate.material(table, "cone", property="unloading", **cone)
    words = ["--indenter", "cone", "--half-angle", 75, "--thickness", 5000, "--poisson", "0.45±0.01", "--contact-error", 0]
    same_as_command(command, found, "--property", "unloading", *words)
    assert found.modulus_kpa == pytest.approx(12.5, rel=1e-5)
    low, high = found.total95_kpa
    assert low < 12.5 < high and len(found.depth) == found["samples"]
    assert found.law_force == pytest.approx(found.force, abs=1e-9)


def test_relaxation_modulus_is_the_one_that_made_it(command, tmp_path):
    equilibrium, modulus, time, ramp = 0.004, 0.008, 2.0, 0.5
    t = 0.01 * np.arange(4001)
    speed, held = 0.3 / ramp, np.minimum(t, ramp)
    # What the ramp so far has pressed in, and how much of it is left.
    left = time * (np.exp(-(t - held) / time) - np.exp(-t / time))
    table = write_table(tmp_path / "hold.csv", t, speed * held, PER_MM * speed * (equilibrium * held + modulus * left) + NOISE)
    options = {**PUNCH, "contact_error": 0.002, "terms": 1}
    found = palpate.material(table, "flat-punch", property="relaxation", **options)
    words = [*PUNCH_WORDS, "--contact-error", 0.002, "--terms", 1]
    same_as_command(command, found, "--property", "relaxation", *words)
    (term,) = found["terms"]
    for number, exact in [(found["equilibrium_mpa"], equilibrium), (term["modulus_mpa"], modulus), (term["time_s"], time)]:
        assert number["value"] == pytest.approx(exact, rel=1e-3)
    assert repr(found).startswith("G instantaneous") and found.depth is None
    with pytest.raises(palpate.PalpateError, match="the property relaxation has no single Young's modulus"):
        found.modulus_kpa


def test_dynamic_moduli_are_those_that_made_them(command, tmp_path):
    storage, loss, frequency, mass = 0.009, 0.003, 0.5, (2.0, 0.1)
    t = 0.01 * np.arange(2001)
    turn = 2 * np.pi * frequency * t
    # The cell pushes the mass too: g mm/s² is 1e-6 N.
    inertia = 1e-6 * mass[0] * (2 * np.pi * frequency) ** 2
    moved = 0.01 * np.sin(turn)
    force = PER_MM * (storage * moved + 0.01 * loss * np.cos(turn)) - inertia * moved + NOISE[:2001]
    table = write_table(tmp_path / "sine.csv", t, 0.3 + moved, force + PER_MM * 0.004 * 0.3)
    options = {**PUNCH, "contact_error": 0, "frequency": frequency, "moving_mass": mass}
    found = palpate.material(table, "flat-punch", property="dynamic", **options)
    words = [*PUNCH_WORDS, "--contact-error", 0, "--frequency", frequency, "--moving-mass", "2.0±0.1"]
    same_as_command(command, found, "--property", "dynamic", *words)
    (sine,) = found["sines"]
    assert sine["shear_storage_mpa"]["value"] == pytest.approx(storage, rel=1e-3)
    assert sine["shear_loss_mpa"]["value"] == pytest.approx(loss, rel=1e-3)


def test_saved_modulus_is_stored_with_the_session(command, session):
    opened = palpate.open(session)
    assert opened.moduli == {}
    made = opened.material("flat-punch", **PRESS, save="stiffness", by="Ada", reason="first look")
    (stored,) = opened.moduli.values()
    assert dict(stored) == dict(made) and repr(stored) == repr(made)
    (known,) = command("info", session)["analyses"]
    assert (known["name"], known["analysis"], known["by"]) == ("stiffness", "material", "Ada")


def test_every_saved_property_is_read_back(recorded, tmp_path):
    path = shutil.copytree(recorded.parent / "every-motion", tmp_path / "every motion")
    opened = palpate.open(path)
    cone = {"half_angle": 80, "thickness": 50000, "poisson": 0.49}
    for name in ["unloading", "relaxation", "dynamic"]:
        found = opened.material("cone", property=name, **cone, save=name)
        assert dict(opened.moduli[name]) == dict(found) and repr(opened.moduli[name]) == repr(found)
    assert opened.moduli["unloading"].modulus_kpa > 0


def test_what_cannot_be_is_refused_in_one_sentence(recorded):
    material = palpate.open(recorded).material
    for call, sentence in [
        (lambda: material("ball", poisson=0.5), "'ball' is not an indenter; the indenters are flat-punch,"),
        (lambda: material("cone", radius=1, poisson=0.5), "a cone has no radius"),
        (lambda: material("cone", poisson=0.5), "a cone needs its half_angle"),
        (lambda: material("sphere", radius="wide", poisson=0.5), "radius cannot be 'wide'; give a number"),
        (lambda: material("sphere", radius=3, poisson=0.5, law="own"), "'own' is not a law; give one of hertz"),
        (lambda: material("sphere", radius=3, poisson=0.5, contact_error="no"), "contact_error cannot be 'no'"),
        (lambda: material("sphere", radius=3, poisson=0.5, property="creep"), "'creep' is not a property; give one of modulus"),
        (lambda: material("sphere", radius=3, poisson=0.5, terms=2), "terms belongs to the property relaxation; leave it out"),
        (lambda: material("sphere", radius=3, poisson=0.5, property="relaxation", depth_max=1), "depth_max belongs to"),
        (lambda: material("sphere", radius=3, poisson=0.5, property="relaxation", terms=1.5), "terms cannot be 1.5"),
        (lambda: material("sphere", radius=3, poisson=0.5, property="dynamic", thickness=60), "the session has no sine"),
        (lambda: material("sphere", radius=3, poisson=0.5), "the thickness of the specimen is not known"),
        (lambda: material("sphere", radius=3, poisson=0.6, thickness=60), "Poisson's ratio is 0.6"),
    ]:
        with pytest.raises(palpate.PalpateError, match=sentence):
            call()
