#!/usr/bin/env python3
"""A thousand loading curves of 4000 samples fitted with Hertz's law, contact and force zero free: palpate on two threads,
then nanite, with which PyJibe fits, in one process. The same curves for both; exit code 1 if the moduli differ.

Usage: benches/nanite_loadings.py [CURVES]     (1000 without; needs `pip install nanite`)
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import nanite
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
SAMPLES, RADIUS_MM, POISSON, MODULUS_MPA, NOISE_N = 4000, 4.0, 0.4, 0.02, 2e-4
# Beyond the first fit, nanite's curves are few: it is slow, and its time for each is the same.
THEIRS_MAX = 100


def curves(count):
    draws = np.random.default_rng(1)
    depth = np.linspace(-0.1, 0.15, SAMPLES)
    plane = 4 / 3 * MODULUS_MPA / (1 - POISSON**2) * RADIUS_MM**0.5
    for _ in range(count):
        contact, zero = draws.normal(0, 0.01), draws.normal(0, 1e-3)
        force = plane * np.clip(depth - contact, 0, None) ** 1.5 + zero + draws.normal(0, NOISE_N, SAMPLES)
        yield np.column_stack([depth, force])


def theirs(curve):
    depth, force = 1e-3 * curve[:, 0], curve[:, 1]
    data = {"force": force, "height (measured)": -depth, "tip position": -depth,
            "time": np.linspace(0, 1, SAMPLES), "segment": np.zeros(SAMPLES, dtype=np.uint8)}
    indentation = nanite.Indentation(data=data, metadata={"imaging mode": "force-distance", "spring constant": 1.0,
                                                          "path": "none", "enum": 0})
    start = nanite.model.model_hertz_paraboloidal.get_parameter_defaults()
    start["R"].value, start["nu"].value, start["E"].value = 1e-3 * RADIUS_MM, POISSON, 1e4
    start["baseline"].vary = True
    indentation.fit_model(model_key="hertz_para", params_initial=start, range_x=(0, 0), range_type="absolute",
                          x_axis="tip position", y_axis="force", segment=0, weight_cp=False)
    return 1e-6 * indentation.fit_properties["params_fitted"]["E"].value


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    made = list(curves(count))
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "curves"
        np.concatenate(made).astype("<f8").tofile(file)
        command = ["cargo", "run", "--quiet", "-p", "palpate-indentation", "--example", "loading_speed", "--",
                   str(file), str(SAMPLES), str(RADIUS_MM), str(POISSON)]
        done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE)
    ours = json.loads(done.stdout)
    theirs(made[0])  # Warm.
    start = time.perf_counter()
    found = [theirs(curve) for curve in made[:THEIRS_MAX]]
    seconds = (time.perf_counter() - start) / len(found) * count
    moduli = np.array(ours["moduli_mpa"])
    apart = np.max(np.abs(np.array(found) / moduli[:len(found)] - 1))
    scatter = np.std(moduli) / MODULUS_MPA
    print(f"{count} curves of {SAMPLES} samples: palpate {ours['seconds']:.2f} s on two threads; nanite "
          f"{nanite.__version__} {seconds:.2f} s on one, from {len(found)} of them; ratio {seconds / ours['seconds']:.1f}")
    print(f"moduli are at most {1e2 * apart:.4f} % apart, where noise scatters them by {1e2 * scatter:.2f} %; "
          f"mean off by {1e2 * (np.mean(moduli) / MODULUS_MPA - 1):.3f} %")
    # A tenth of the noise: what an optimiser's stopping early may make.
    return int(not apart < 0.1 * scatter)


if __name__ == "__main__":
    sys.exit(main())
