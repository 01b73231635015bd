"""What a built palpate contains: its crates as CycloneDX, and their licences as text."""
import hashlib
import json
import pathlib
import re
import subprocess
import tomllib
import uuid

from program import ROOT

# C libraries inside crates: where their version stands.
BUNDLED = {"libsqlite3-sys": ("sqlite", "sqlite3/sqlite3.h", r'#define SQLITE_VERSION\s+"([\d.]+)"'),
           "zstd-sys": ("zstd", "Cargo.toml", r'\+zstd\.([\d.]+)"')}
LICENCE_FILE = re.compile(r"(un)?licen[cs]e|copying|copyright|notice|ofl|ufl", re.IGNORECASE)


def cargo(*words):
    return subprocess.run(["cargo", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout


class Crates:
    """The crates that a build of palpate with these features for this target is linked from, and who uses whom."""

    def __init__(self, target, features):
        self.metadata = json.loads(cargo("metadata", "--locked", "--format-version", "1", "--filter-platform", target))
        self.facts = {(one["name"], one["version"]): one for one in self.metadata["packages"]}
        lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
        self.sums = {(one["name"], one["version"]): one.get("checksum") for one in lock["package"]}
        tree = cargo("tree", "--locked", "--package", "palpate", *features, "--target", target,
                     "--edges", "normal,no-proc-macro", "--prefix", "depth", "--format", " {p}")
        self.uses, path = {}, []
        for line in tree.splitlines():
            depth, name, version, *_ = line.split()
            crate = name, version.removeprefix("v")
            path[int(depth):] = [crate]
            self.uses.setdefault(crate, set())
            if len(path) > 1:
                self.uses[path[-2]].add(crate)

    def foreign(self):
        return sorted(one for one in self.uses if self.facts[one]["source"])

    def folder(self, crate):
        return pathlib.Path(self.facts[crate]["manifest_path"]).parent


def reference(crate):
    return f"pkg:cargo/{crate[0]}@{crate[1]}"


def component(crates, crate):
    facts = crates.facts[crate]
    made = {"type": "library", "bom-ref": reference(crate), "name": crate[0], "version": crate[1],
            "licenses": [{"expression": facts["license"].replace("/", " OR ")}]}
    if facts["source"]:
        made["purl"] = reference(crate)
        made["hashes"] = [{"alg": "SHA-256", "content": crates.sums[crate]}]
    if facts["repository"]:
        made["externalReferences"] = [{"type": "vcs", "url": facts["repository"]}]
    if crate[0] in BUNDLED:
        name, file, pattern = BUNDLED[crate[0]]
        text = (crates.folder(crate) / file).read_text(encoding="utf-8", errors="replace")
        version = re.search(pattern, text)[1]
        purl = f"pkg:generic/{name}@{version}"
        made["components"] = [{"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}]
    return made


def bill_of_materials(crates, binary, commit, timestamp):
    """The CycloneDX document of a binary. The same binary has the same document."""
    (root,) = [one for one in crates.uses if one[0] == "palpate"]
    digest = hashlib.sha256(binary.read_bytes()).hexdigest()
    program = {**component(crates, root), "type": "application", "hashes": [{"alg": "SHA-256", "content": digest}],
               "properties": [{"name": "palpate:commit", "value": commit}]}
    return {"$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json", "bomFormat": "CycloneDX", "specVersion": "1.6",
            "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, digest)}", "version": 1,
            "metadata": {"timestamp": timestamp, "component": program},
            "components": [component(crates, one) for one in sorted(crates.uses) if one != root],
            "dependencies": [{"ref": reference(one), "dependsOn": sorted(map(reference, used))}
                             for one, used in sorted(crates.uses.items())]}


def licences(crates):
    """The licence texts of all foreign crates, each once."""
    texts, without = {}, []
    for crate in crates.foreign():
        files = [one for one in sorted(crates.folder(crate).rglob("*")) if LICENCE_FILE.match(one.name) and one.suffix in ("", ".md", ".txt")
                 and one.is_file()]
        for file in files:
            texts.setdefault(file.read_text(encoding="utf-8", errors="replace").strip(), []).append(crate)
        if not files:
            without.append(crate)

    def row(crate):
        facts = crates.facts[crate]
        return f"{crate[0]} {crate[1]}: {facts['license']}, {facts['repository'] or 'https://crates.io/crates/' + crate[0]}"

    parts = ["palpate is linked with the crates below; their sources are at the addresses given and on https://crates.io.",
             "\n".join(map(row, crates.foreign()))]
    for text, users in texts.items():
        parts.append(f"{'=' * 80}\nOf {', '.join(dict.fromkeys(f'{name} {version}' for name, version in users))}:\n\n{text}")
    if without:
        parts.append(f"{'=' * 80}\nWithout a licence file of their own: {', '.join(f'{name} {version}' for name, version in without)}.")
    return "\n\n".join(parts) + "\n"
