"""The palpate that a script is about: PALPATE names it, else it is the development build, made if it is out of date."""
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "palpate"


def palpate():
    if "PALPATE" in os.environ:
        return pathlib.Path(os.environ["PALPATE"]).resolve()
    subprocess.run(["cargo", "build", "--quiet"], cwd=ROOT, check=True)
    listed = subprocess.run(["cargo", "metadata", "--no-deps", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True)
    return pathlib.Path(json.loads(listed.stdout)["target_directory"]) / "debug" / "palpate"


def skip(kind, name, script, reason="it is not installed", advice="scripts/install-test-tools installs it"):
    """Says that a script does not try something for want of a program or file, to the gate too."""
    print(f"skipped: there is no {kind} {name}; {advice}")
    if "PALPATE_SKIPPED" in os.environ:
        with open(os.environ["PALPATE_SKIPPED"], "a") as skipped:
            skipped.write(f"{kind}\t{name}\t{script}\t{reason}\n")
