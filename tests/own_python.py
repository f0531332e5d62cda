"""A Python of its own for a script of tests, below target/."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def go_on_in(venv, requirements):
    """Goes on in the Python `target/VENV` with the packages of tests/REQUIREMENTS; it is made if
    it is not there."""
    folder = ROOT / "target" / venv
    python = folder / "bin" / "python"
    if Path(sys.prefix).resolve() == folder.resolve():
        return
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "-r", str(ROOT / "tests" / requirements)], check=True)
    os.execv(str(python), [str(python), *sys.argv])
