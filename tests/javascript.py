"""The scripts of a page, run by node, or by Chromium where there is no node."""

import json
import shutil
import subprocess
from importlib.resources import files

import pytest

from browser_samples import Browser

LONGEST = 300.0  # [s]


def script(*names):
    """Return scripts of the pages as one text."""
    home = files("deboom.report")
    return "\n".join(home.joinpath(name).read_text(encoding="utf-8") for name in names)


def evaluated(program, folder):
    """Return the value that a program, the body of a function, returns; numbers stay as they are.

    - `folder`: an empty one for the files of this call.
    """
    whole = f"function program() {{\n{program}\n}}\n"
    node = shutil.which("node")
    if node is None:
        return _in_chromium(whole, folder)
    path = folder / "program.js"
    path.write_text(f"{whole}process.stdout.write(JSON.stringify(program()));\n", encoding="utf-8")
    done = subprocess.run([node, path], capture_output=True, check=False, timeout=LONGEST)
    assert done.returncode == 0, done.stderr.decode()
    return json.loads(done.stdout)


def _in_chromium(whole, folder):
    try:
        browser = Browser()
    except pytest.skip.Exception:
        pytest.skip("there is neither node nor Chromium on this machine to run a page's scripts")
    page = folder / "program.html"
    page.write_text("<!DOCTYPE html><title>program</title>", encoding="utf-8")
    try:
        browser.open(page)
        return json.loads(
            browser.value(f"(() => {{ {whole} return JSON.stringify(program()); }})()")
        )
    finally:
        browser.close()
