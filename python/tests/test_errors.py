"""What cannot be done is one sentence that says what is wrong and what to do."""
import shutil

import numpy as np
import palpate
import pytest

T = np.linspace(0.0, 10.0, 200)
DEPTH = np.minimum(T, 5.0)
FORCE = 0.1 * DEPTH


@pytest.fixture(scope="module")
def opened(recorded):
    return palpate.open(recorded)


def refusals(opened, folder):
    damaged = folder / "damaged"
    shutil.copytree(opened.path, damaged)
    log = damaged / "000.mcap"
    log.write_bytes(log.read_bytes()[:5000] + b"\0" * 100 + log.read_bytes()[5100:])
    (folder / "text.csv").write_text("a,b\n1,2\n")
    return {
        "no session exists at": lambda: palpate.open(folder / "nowhere"),
        "is damaged at byte": lambda: palpate.open(damaged),
        "has no analysis 'none'": lambda: palpate.open(opened.path, analysis="none"),
        "is not a palpate session": lambda: palpate.open(folder / "text.csv"),
        "arrays of one length": lambda: palpate.fit(T, DEPTH[:-1], FORCE),
        "times must increase": lambda: palpate.fit(T[::-1], DEPTH, FORCE),
        "the force stays at": lambda: palpate.fit(T, DEPTH, 0 * FORCE),
        "the depth stays at": lambda: palpate.fit(T, 0 * DEPTH + 1, FORCE),
        "has a force of NaN": lambda: palpate.fit(T, DEPTH, FORCE * np.nan),
        "uncertainty must be greater than zero": lambda: palpate.fit(T, DEPTH, FORCE, sigma=-1),
        "record more samples": lambda: palpate.fit([], [], []),
        "t is not an array of numbers": lambda: palpate.fit(["one", "two"], DEPTH, FORCE),
        "force has 2 dimensions": lambda: palpate.fit(T, DEPTH, np.ones((200, 2))),
        "sigma is not an array of numbers": lambda: palpate.fit(T, DEPTH, FORCE, sigma=["x"] * 200),
        "so depth must be a list of 2": lambda: palpate.fit([T, T], DEPTH, [FORCE, FORCE]),
        "record 2: ": lambda: palpate.fit([T, T], [DEPTH, DEPTH], [FORCE, FORCE * np.nan]),
        "share needs at least two records": lambda: palpate.fit(T, DEPTH, FORCE, share="mu1"),
        "cannot be shared": lambda: palpate.fit([T, T + 1], [DEPTH, DEPTH], [FORCE, FORCE], share="f0"),
        "'nothing' is not a model family": lambda: palpate.fit(T, DEPTH, FORCE, family="nothing"),
        "the model has no parameter 'mu9'": lambda: palpate.fit(T, DEPTH, FORCE, fixed={"mu9": 1}),
        "tau_eps cannot be fixed at 0": lambda: palpate.fit(T, DEPTH, FORCE, fixed={"tau_eps": 0}),
        "mu1 cannot be fixed at 'soft'": lambda: palpate.fit(T, DEPTH, FORCE, fixed={"mu1": "soft"}),
        "f0 is given twice": lambda: palpate.fit(T, DEPTH, FORCE, fixed={"f0": 1}, free=["f0"]),
        "give at least 40 repeats": lambda: palpate.fit(T, DEPTH, FORCE, bootstrap=3),
        "bootstrap cannot be 'many'": lambda: palpate.fit(T, DEPTH, FORCE, bootstrap="many"),
        "seed cannot be -1": lambda: palpate.fit(T, DEPTH, FORCE, seed=-1),
        "the default model has no unloading": lambda: opened.fit(unload=True),
        "compliance": lambda: opened.fit(compliance="last"),
        "'dwell' is not a phase": lambda: opened.samples(phase="dwell"),
        "the session has no column force": lambda: opened.samples(columns="force"),
        "is after until_s": lambda: opened.samples(from_s=3, until_s=2),
        "from_s cannot be nan": lambda: opened.samples(from_s=float("nan")),
        "decimate": lambda: opened.samples(decimate=0),
        "cycle cannot be -1": lambda: opened.samples(cycle=-1),
        "is not a kind of data frame": lambda: opened.samples("excel"),
        "is not a folder": lambda: palpate.library(folder / "nowhere").find(),
        "is not a condition": lambda: palpate.library(folder).find("depth="),
        "unexpected argument '--colour'": lambda: palpate.library(folder).find(colour="red"),
        "invalid value 'size'": lambda: palpate.library(folder).find(sort="size"),
        "neither a built-in protocol nor a file": lambda: palpate.run("ramp-hole"),
        "unexpected argument '--depht'": lambda: palpate.run("ramp-hold", depht=3),
        "is not empty; choose a new folder": lambda: palpate.run("ramp-hold", out=opened.path, time_scale="max"),
    }


def test_every_mistake_is_one_sentence(opened, tmp_path):
    wrong = []
    for expected, mistake in refusals(opened, tmp_path).items():
        with pytest.raises(palpate.PalpateError) as caught:
            mistake()
        sentence = str(caught.value)
        if expected not in sentence or "\n" in sentence or sentence.endswith("."):
            wrong.append((expected, sentence))
    assert not wrong


def test_nothing_but_the_one_exception_is_raised_for_odd_numbers():
    # Whatever the numbers, a fit is a report or a sentence.
    odd = [0.0, -0.0, 1e308, -1e308, 5e-324, np.inf, -np.inf, np.nan]
    for value in odd:
        for what in range(3):
            arrays = [T.copy(), DEPTH.copy(), FORCE.copy()]
            arrays[what][100] = value
            try:
                palpate.fit(*arrays)
            except palpate.PalpateError as refusal:
                assert str(refusal)
