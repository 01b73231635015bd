"""Programs that serve a shared library or open its table, in a folder of their own outside the clone."""
import os
import socket
import subprocess
import sys
import time
import urllib.request

import program

# DuckDB's reader of Delta tables comes as a package for this version of DuckDB.
PACKAGES = ["deltalake==1.6.6", "polars==2.1.0", "pyarrow==26.0.1", "duckdb==1.5.5", "duckdb-extension-delta==1.5.5"]
SERVERS = ["moto[s3,server]==5.2.5", "ministack==1.5.33", "boto3"]
KEYS = {"AWS_ACCESS_KEY_ID": "lab", "AWS_SECRET_ACCESS_KEY": "laboratory", "AWS_REGION": "us-east-1", "AWS_ALLOW_HTTP": "true"}


# With the threads of its own command, moto's look at a name and its writing are two steps: now and then two writers at once both
# succeed. With one thread they are one.
MOTO = """
import sys
from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import run_simple
run_simple("127.0.0.1", int(sys.argv[1]), DomainDispatcherApplication(create_backend_app), threaded=False)
"""


def python(*more):
    """An interpreter that has them."""
    found = program.CACHE / "store" / "bin" / "python3"
    if not found.exists():
        subprocess.run([sys.executable, "-m", "venv", program.CACHE / "store"], check=True)
    subprocess.run([found, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES, *more], check=True)
    return found


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Server:
    """A server of objects on this computer, and where its store is."""

    def __init__(self, kind, folder, python):
        self.process, self.environment = None, {}
        if kind == "file":
            self.url = (folder / "store").as_uri()
            return
        port = free_port()
        endpoint = f"http://127.0.0.1:{port}"
        self.url = "s3://lab/rigs"
        self.environment = {**KEYS, "AWS_ENDPOINT": endpoint, "AWS_ENDPOINT_URL": endpoint}
        surroundings = dict(os.environ)
        if kind == "moto":
            command = [python, "-c", MOTO, str(port)]
        elif kind == "ministack":
            command = [python, "-m", "ministack"]
            surroundings.update(GATEWAY_PORT=str(port), SERVICES="s3")
        else:
            (folder / "objects/lab").mkdir(parents=True)
            command = [s3s_fs(), "--host", "127.0.0.1", "--port", str(port), "--access-key", KEYS["AWS_ACCESS_KEY_ID"],
                       "--secret-key", KEYS["AWS_SECRET_ACCESS_KEY"], folder / "objects"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(command, env=surroundings, **quiet)
        for _ in range(300):
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                break
            except OSError:
                time.sleep(0.1)
        if kind != "s3s-fs":
            urllib.request.urlopen(urllib.request.Request(f"{endpoint}/lab", method="PUT")).close()

    def stop(self):
        if self.process:
            self.process.kill()
            self.process.wait()


def s3s_fs():
    root = program.CACHE / "s3s"
    if not (root / "bin/s3s-fs").exists():
        subprocess.run(["cargo", "install", "--quiet", "s3s-fs", "--version", "0.14.1", "--features", "binary", "--root", root],
                       check=True)
    return root / "bin/s3s-fs"
