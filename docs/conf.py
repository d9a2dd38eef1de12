"""The documentation site: `make docs` builds it offline into build/docs; warnings are errors."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import deboom

sys.path.insert(0, str(Path(__file__).parent))
from types_on_the_path import table

project = "deboom"
author = "The deboom developers"
copyright = author  # noqa: A001 (Sphinx's name)
version = release = deboom.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["_templates", "gallery/**/README.rst", "gallery/README.rst"]
templates_path = ["_templates"]

html_theme = "pydata_sphinx_theme"
html_title = "deboom"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_prev_next": False,
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]

autosummary_generate = True
autosummary_imported_members = True
autodoc_typehints = "none"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "subsection_order": [
        f"../examples/{subject}"
        for subject in ("tutorials", "measurement", "mounts", "vehicles", "compressor")
    ],
    "within_subsection_order": "ExampleTitleSortKey",
    "filename_pattern": r"/\w+\.py$",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "write_computation_times": False,
    "min_reported_time": 1000,
    "plot_gallery": True,
    "capture_repr": ("_repr_html_",),
}

ENTRIES = dict(
    (name, label)
    for label, name in re.findall(
        r"^\((\S+)\)=\n\*\*(.+?)\*\*",
        Path(__file__).with_name("bibliography.md").read_text(encoding="utf-8"),
        flags=re.MULTILINE,
    )
)
"""Label of each entry of the bibliography by the words that cite it."""
KEPT = (
    r"^```.*?^```|^#.*?$|^\| (?:eq\.|place) .*?$"  # code, headings, heads of tables
    r"|``.*?``|`[^`]*`|\[[^\]]*\]\([^)]*\)"  # literals and links
)
CITED = re.compile(
    rf"{KEPT}|\b(?P<name>{'|'.join(map(re.escape, ENTRIES))})(?!\w)", re.MULTILINE | re.DOTALL
)


def linked(text: str, link: str) -> str:
    """Make the first mention of every entry a link, outside of code, headings and links."""
    seen = set()

    def replaced(match: re.Match[str]) -> str:
        name = match["name"]
        if name is None or name in seen:
            return match[0]
        seen.add(name)
        return link.format(name=name, label=ENTRIES[name])

    return CITED.sub(replaced, text)


def link_page(app: Any, name: str, source: list[str]) -> None:
    """Link the citations of a page in Markdown, and of an example."""
    if name.startswith("gallery/"):
        source[0] = linked(source[0], ":ref:`{name} <{label}>`")
    elif app.env.doc2path(name).suffix == ".md" and name != "bibliography":
        source[0] = linked(source[0], "[{name}](#{label})")


def write_types(_app: Any, name: str, source: list[str]) -> None:
    """Write the table of types into the page that leads through the code."""
    if name == "from-folder-to-page":
        source[0] = source[0].replace("% types on the path", table())


def link_docstring(
    _app: Any, _what: str, _name: str, _value: Any, _options: Any, lines: list[str]
) -> None:
    """Link the citations of a docstring."""
    lines[:] = linked("\n".join(lines), ":ref:`{name} <{label}>`").split("\n")


def setup(app: Any) -> None:
    """Link what is cited, and write what is read from the code."""
    app.connect("source-read", write_types)
    app.connect("source-read", link_page)
    app.connect("autodoc-process-docstring", link_docstring)
