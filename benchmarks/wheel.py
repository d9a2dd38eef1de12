"""Build the distributions, check them, and use the wheel in a new environment and an empty folder.

What a user without the repository has: the studies, the demonstration platform, the README's lines.
The wheel is built from the source distribution, so that this one is complete as well.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

from packaging.metadata import Metadata

from deboom.files.run_folder import hash_sources

ROOT = Path(__file__).parents[1]
NEEDED = (
    "deboom/__init__.pyi",
    "deboom/bench/__init__.pyi",
    "deboom/py.typed",
    "deboom/bench/data/fleet.json",
    "deboom/report/page.html",
    "deboom/report/sheet.html",
    "deboom/studies/front.py",
    "deboom/studies/data/u06_f39_f45/platform.toml",
)
PYTHON_BLOCK = re.compile(r"^```python\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


def main() -> None:
    """Build, check, install, run; the first step that fails ends the check with its output."""
    with tempfile.TemporaryDirectory(prefix="deboom-wheel-") as temporary:
        place = Path(temporary)
        dist, empty, home = place / "dist", place / "empty", place / "env"
        empty.mkdir()
        _run(ROOT, sys.executable, "-m", "build", "--outdir", str(dist), str(ROOT))
        (wheel,) = dist.glob("*.whl")
        with zipfile.ZipFile(wheel) as content:
            names = set(content.namelist())
            (facts,) = (name for name in names if name.endswith(".dist-info/METADATA"))
            Metadata.from_email(content.read(facts))  # refuses what an index would refuse
        missing = [name for name in NEEDED if name not in names]
        strange = [n for n in names if not re.match(r"deboom(/|-[^/]+\.dist-info/)", n)]
        if missing or strange:
            sys.exit(f"{wheel.name} lacks {missing} and should not hold {strange}")
        venv.create(home, with_pip=True)
        scripts = home / ("Scripts" if os.name == "nt" else "bin")
        python, constraints = str(scripts / "python"), str(ROOT / "constraints.txt")
        _run(
            empty,
            python,
            "-m",
            "pip",
            "install",
            "-q",
            "--no-compile",
            "-c",
            constraints,
            str(wheel),
        )
        listed = _run(empty, str(scripts / "deboom"), "studies")
        study = ("correlation", "--group", "U06", "--designs", "16", "--resamples", "100")
        _run(empty, python, "-m", "deboom", "run", *study, "--draws", "4")
        results = list((empty / "results" / "correlation").glob("*/summary.json"))
        if "front" not in listed or len(results) != 1:
            sys.exit("the installed package lists no studies or keeps no results here")
        record = json.loads(results[0].with_name("run.json").read_text(encoding="utf-8"))
        if record["environment"]["sources_sha256"] != hash_sources(ROOT / "src" / "deboom"):
            sys.exit("the wheel's sources have another hash than those of the checkout")
        lines = "".join(PYTHON_BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8")))
        print(_run(empty, python, "-c", f"{lines}\nprint(len(front.table), 'designs')").strip())
        print(f"{wheel.name}: {len(names)} files, used from an empty folder")


def _run(folder: Path, *command: str) -> str:
    """Run a command without the repository on the path; its output, or its end."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
