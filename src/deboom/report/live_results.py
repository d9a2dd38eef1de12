"""The page of `deboom serve`: runs of a results folder, and searches as they grow."""

from __future__ import annotations

from importlib.resources import files

from deboom.report.interactive import digest_of

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
        f"default-src 'none'; script-src {digest_of(script)}; style-src {digest_of(style)}; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return text, policy
