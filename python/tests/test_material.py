"""The modulus of a press is that of the command line."""
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


def test_saved_modulus_is_stored_with_the_session(command, session):
    opened = palpate.open(session)
    assert opened.moduli == {}
    made = opened.material("flat-punch", **PRESS, save="stiffness", by="Ada", reason="first look")
    (stored,) = opened.moduli.values()
    assert dict(stored) == dict(made) and repr(stored) == repr(made)
    (known,) = command("info", session)["analyses"]
    assert (known["name"], known["analysis"], known["by"]) == ("stiffness", "material", "Ada")


def test_what_cannot_be_is_refused_in_one_sentence(recorded):
    material = palpate.open(recorded).material
    for call, sentence in [
        (lambda: material("ball", poisson=0.5), "'ball' is not an indenter; the indenters are flat-punch,"),
        (lambda: material("cone", radius=1, poisson=0.5), "a cone has no radius"),
        (lambda: material("cone", poisson=0.5), "a cone needs its half_angle"),
        (lambda: material("sphere", radius="wide", poisson=0.5), "radius cannot be 'wide'; give a number"),
        (lambda: material("sphere", radius=3, poisson=0.5, law="own"), "'own' is not a law; give one of hertz"),
        (lambda: material("sphere", radius=3, poisson=0.5, contact_error="no"), "contact_error cannot be 'no'"),
        (lambda: material("sphere", radius=3, poisson=0.5), "the thickness of the specimen is not known"),
        (lambda: material("sphere", radius=3, poisson=0.6, thickness=60), "Poisson's ratio is 0.6"),
    ]:
        with pytest.raises(palpate.PalpateError, match=sentence):
            call()
