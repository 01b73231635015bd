"""Validates a crate with rocrate-validator (PyPI: roc-validator), without the network.

The validator fetches the JSON-LD context of RO-Crate from w3id.org. The npm package ro-crate has the same file, and stands
in for the network here, so that the gate validates anywhere.
"""
import json
import logging
import pathlib

import program

SPECIFICATION = "https://w3id.org/ro/crate/1.2"
CONTEXT = program.CACHE / "node" / "node_modules" / "ro-crate" / "lib" / "context.json"
# Each profile by itself: the validator's Process Run Crate 0.5 inherits from RO-Crate 1.1, whose rules want 1.1 in the
# metadata of a crate that follows 1.2.
PROFILES = ("ro-crate-1.2", "process-run-crate-0.5")


def load_context(context):
    """Answers the address of the context by the file, and no other address."""
    import requests
    from rocrate_validator.utils.http import HttpRequester

    text = context.read_bytes()
    if json.loads(text)["@id"] != f"{SPECIFICATION}/context":
        raise SystemExit(f"{context} is not the context of {SPECIFICATION}")

    def get(_, address, **__):
        answer = requests.Response()
        is_here = address == f"{SPECIFICATION}/context"
        answer.status_code = 200 if is_here else 404
        answer._content = text if is_here else b""
        answer.headers["Content-Type"] = "application/ld+json"
        return answer

    HttpRequester.get = get


def validate(crate, severity="REQUIRED", context=CONTEXT):
    """What the validator finds in a crate: a list of sentences for each profile."""
    from rocrate_validator import services
    from rocrate_validator.models import Severity, ValidationSettings

    load_context(context)
    logging.disable(logging.CRITICAL)
    found = {}
    for profile in PROFILES:
        settings = ValidationSettings(
            rocrate_uri=str(crate),
            profile_identifier=profile,
            requirement_severity=Severity[severity],
            enable_profile_inheritance=False,
            abort_on_first=False,
            disable_remote_crate_download=True,
            # Whether the addresses of people, licences and papers answer today is another question.
            skip_availability_check=True,
        )
        result = services.validate(settings)
        found[profile] = [f"{issue.severity.name} {issue.check.identifier}: {issue.message} ({issue.violatingEntity})" for issue in result.get_issues(Severity[severity])]
        checked = len(result.executed_checks)
        if not checked:
            raise SystemExit(f"the validator has checked nothing of {profile}")
        print(f"{pathlib.Path(crate).name}: {profile}, {checked} checks of severity {severity} and above, {len(found[profile])} faults")
    return found


if __name__ == "__main__":
    import sys

    severity = sys.argv[2].upper() if len(sys.argv) > 2 else "REQUIRED"
    everything = validate(pathlib.Path(sys.argv[1]), severity, pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else CONTEXT)
    for profile, sentences in everything.items():
        for sentence in sentences:
            print(f"{profile}: {sentence}")
    sys.exit(any(everything.values()))
