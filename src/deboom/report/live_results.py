"""The page of `deboom serve`: runs of a results folder, and searches as they grow."""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files

_FOLDER = "deboom.report"


def live_results_page() -> tuple[str, str]:
    """Return the page and its Content-Security-Policy: this script, this style, this address."""
    parts = files(_FOLDER)
    scripts = ("page_parts.js", "live_results.js")
    script = "".join(parts.joinpath(name).read_text(encoding="utf-8") for name in scripts)
    style = parts.joinpath("live_results.css").read_text(encoding="utf-8")
    page = parts.joinpath("live_results.html").read_text(encoding="utf-8")
    text = page.replace("/* style */", style).replace("/* script */", script)
    policy = (
        f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return text, policy


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
