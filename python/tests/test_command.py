"""The package brings the command along."""
import subprocess
import sys

import palpate


def test_the_command_is_installed_and_of_the_same_version(command):
    for program in ([str(command.program)], [sys.executable, "-m", "palpate"]):
        done = subprocess.run([*program, "--version"], capture_output=True, text=True)
        assert (done.returncode, done.stdout.split()) == (0, ["palpate", palpate.__version__])


def test_exit_codes_and_sentences_are_those_of_the_program(tmp_path):
    done = subprocess.run([sys.executable, "-m", "palpate", "info", tmp_path / "no"], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith("error: ") and "no session exists at" in done.stderr
    done = subprocess.run([sys.executable, "-m", "palpate"], capture_output=True, text=True)
    assert done.returncode == 2 and "without its window" in done.stderr


def test_the_ray_module_needs_no_native_code_to_explain_itself():
    done = subprocess.run([sys.executable, "-m", "palpate.ray", "--help"], capture_output=True, text=True)
    assert done.returncode == 0 and "LAKE" in done.stdout or "ray" in done.stderr
