"""Programs that open the table of a shared library, in a folder of their own outside the clone."""
import subprocess
import sys

import program

# DuckDB's reader of Delta tables comes as a package for this version of DuckDB.
PACKAGES = ["deltalake==1.6.6", "polars==2.1.0", "pyarrow==26.0.1", "duckdb==1.5.5", "duckdb-extension-delta==1.5.5"]
SERVERS = ["moto[s3,server]==5.2.5", "boto3"]


def python(*more):
    """An interpreter that has them."""
    found = program.CACHE / "store" / "bin" / "python3"
    if not found.exists():
        subprocess.run([sys.executable, "-m", "venv", program.CACHE / "store"], check=True)
    subprocess.run([found, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES, *more], check=True)
    return found
