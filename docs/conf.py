"""The documentation site: `make docs` builds it offline into build/docs; warnings are errors."""

from __future__ import annotations

import dataclasses
import inspect
import os
import pydoc
import re
import shutil
import sys
import tempfile
import tomllib
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from docutils import nodes
from numpydoc.xref import DEFAULT_LINKS

import deboom
from deboom.report import Report
from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.runner import load_study, run_study

sys.path.insert(0, str(Path(__file__).parent))
from keys_of_summaries import table as keys_of_summaries
from reference_pages import argument_types, write_reference
from types_on_the_path import table

HERE = Path(__file__).parent
# the tutorials type deboom
os.environ["PATH"] = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
project = "deboom"
author = "The deboom developers"
copyright = author  # noqa: A001 (Sphinx's name)
version = release = deboom.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["_templates", "gallery/**/README.rst", "gallery/README.rst"]
templates_path = ["_templates"]

html_theme = "pydata_sphinx_theme"
html_title = "deboom"
html_static_path = ["_static"]
html_extra_path = ["_live"]
mathjax_path = "mathjax/tex-svg.js"
MATHJAX = files("mathjax") / "static" / "mathjax"
"""MathJax with its licence (Apache 2.0), from the package django-static-mathjax."""
html_css_files = ["site.css"]
html_search_scorer = str(HERE / "search_scorer.js")
html_show_sourcelink = False
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_prev_next": True,
    "header_links_before_dropdown": 8,
    "navbar_align": "left",
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]

autosummary_generate = True
autosummary_imported_members = True
autodoc_typehints = "none"
autodoc_preserve_defaults = True
default_role = "py:obj"
numpydoc_show_class_members = False
numpydoc_xref_param_type = True
DEFAULT_LINKS.clear()  # glossaries of Python and numpy, of which there is no inventory here
numpydoc_xref_aliases = {
    "DataFrame": "pandas.DataFrame",
    "array": "numpy.ndarray",
    "ndarray": "numpy.ndarray",
    "Generator": "numpy.random.Generator",
    **{name.rpartition(".")[2]: name for name in argument_types()},
    **{name: f"deboom.{name}" for name in deboom.__all__ if name[0].isupper()},
}
numpydoc_xref_ignore = "all"

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
    "image_srcset": ["2x"],
    "backreferences_dir": "api/backreferences",
    "doc_module": ("deboom",),
}

PROJECT = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ADDRESSES = PROJECT.get("urls", {})
"""Where source and issues are: a fork states its own."""
OUTSIDE = {
    "numpy": "https://numpy.org/doc/stable/reference/generated/{}.html",
    "numpy.random": "https://numpy.org/doc/stable/reference/random/generator.html#{}",
    "pandas": "https://pandas.pydata.org/docs/reference/api/{}.html",
}
"""Pages of other packages, by module; the build needs no network for them."""

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


EQUATIONS = ("physics", "compressor-physics", "exploration")
OF_PHYSICS = re.compile(r"`([a-z]\w*)(\.\w+)`")


def _link_of_physics(match: re.Match[str]) -> str:
    """Link a function that a table of equations names, where its module has a page."""
    if find_spec(f"deboom.physics.{match[1]}") is None:
        return match[0]
    return f"{{py:obj}}`{match[1]}{match[2]} <deboom.physics.{match[1]}{match[2]}>`"


def link_page(app: Any, name: str, source: list[str]) -> None:
    """Link the citations of a page in Markdown and of an example, whose pictures are described."""
    if name.startswith("gallery/"):
        title = re.search(r"^(.+)\n===", source[0], re.MULTILINE)
        named = re.sub(r":alt: plot .*", f":alt: {title[1]}" if title else ":alt:", source[0])
        source[0] = linked(named, ":ref:`{name} <{label}>`")
    elif name in EQUATIONS:
        source[0] = linked(OF_PHYSICS.sub(_link_of_physics, source[0]), "[{name}](#{label})")
    elif app.env.doc2path(name).suffix == ".md" and name != "bibliography":
        source[0] = linked(source[0], "[{name}](#{label})")


OF_CODE = re.compile(r"`(?P<module>deboom(?:\.\w+)*)\.(?P<name>\w+)\(\)`")


def _link_of_code(match: re.Match[str]) -> str:
    """Link a function to its page, which has the short name where `import deboom` exports it."""
    module, name = match["module"], match["name"]
    exported = getattr(deboom, name, None)
    page = "deboom" if getattr(exported, "__module__", None) == module else module
    return f"{{py:obj}}`{module}.{name}() <{page}.{name}>`"


def write_from_code(_app: Any, name: str, source: list[str]) -> None:
    """Write what pages take from the code, and the addresses of source and issues."""
    if name == "from-folder-to-page":
        source[0] = OF_CODE.sub(_link_of_code, source[0]).replace("% types on the path", table())
    if name == "summary-keys":
        source[0] = source[0].replace("% keys of summaries", keys_of_summaries())
    source[0] = source[0].replace("% addresses", address_line())
    if where := ADDRESSES.get("Source"):
        source[0] = source[0].replace("<address of the clone>", where)


def address_line() -> str:
    """Say where source and issues are, or where a fork states them."""
    if not ADDRESSES:
        return "Source and issues are at the address that you have deboom from."
    return "Addresses: " + ", ".join(f"[{name}]({url})" for name, url in ADDRESSES.items()) + "."


MAGNITUDE = re.compile(r"``.*?``|`[^`]*`|\|(\w+)\|", re.DOTALL)


def link_docstring(
    _app: Any, _what: str, _name: str, _value: Any, _options: Any, lines: list[str]
) -> None:
    """Link the citations of a docstring, whose magnitudes such as |K| are no substitutions."""
    text = MAGNITUDE.sub(
        lambda match: rf"\|{match[1]}\|" if match[1] else match[0], "\n".join(lines)
    )
    lines[:] = linked(text, ":ref:`{name} <{label}>`").split("\n")


FIELD = re.compile(
    r"^- (?P<names>`\w+`(?P<shape> \([^)]*\))?(?:, `\w+`(?: \([^)]*\))?)*)"
    r"(?P<optional>, optional)?(?P<text>[: ].*)$"
)
"""First line of a field in the docstring of a class, or of a parameter in that of a method."""
OUTCOME = re.compile(
    r"^- (?P<what>returns|raises|warns)(?P<kind> [A-Z]\w+)?(?P<shape> \([^)]*\))?:? ?(?P<text>.*)$"
)
ARRAY = re.compile(r"\b(?:[A-Z]\w*)?Array\b|\bnpt\.(?:ArrayLike|NDArray\[[^]]*\])")
CONSTANT = re.compile(r"=([A-Z][A-Z_]+)\b")


def head_lists(
    _app: Any, what: str, _name: str, value: Any, _options: Any, lines: list[str]
) -> None:
    """Turn a list of fields or parameters, and what is returned and raised, into sections."""
    if "Parameters" in lines or what not in ("class", "exception", "function", "method"):
        return
    fields = what == "class" and dataclasses.is_dataclass(value)
    kinds = getattr(value, "__annotations__", {})
    if fields:
        kinds = {field.name: field.type for field in dataclasses.fields(value)}
    first = "Attributes" if fields else "Parameters"
    sections: dict[str, list[str]] = {first: [], "Returns": [], "Raises": [], "Warns": []}
    text, section = [], None
    for line in lines:
        if match := FIELD.match(line):
            section = sections[first]
            names = re.findall(r"`(\w+)`", match["names"])
            kind = _kind(kinds.get(names[0]), match["shape"], match["optional"])
            section += [f"{', '.join(names)} : {kind}".removesuffix(" : ")]
            section += [f"    {match['text'].removeprefix(':').strip()}"]
        elif match := OUTCOME.match(line):
            section = sections[match["what"].capitalize()]
            kind = match["kind"] or _kind(kinds.get("return"), match["shape"])
            section += [kind.strip(), f"    {match['text']}"]
        elif section is not None and line.startswith("  "):
            section.append(f"    {line.strip()}")
        else:
            section = None
            text.append(line)
    for name, entries in sections.items():
        if entries:
            text += ["", name, "-" * len(name), *entries, ""]
    lines[:] = text


def _kind(annotation: Any, shape: str | None, optional: str | None = None) -> str:
    """Return type, shape and whether it may be left out, as numpydoc writes them."""
    kind = re.sub(r"_(?!\w)", r"\_", ARRAY.sub("array", str(annotation or "")))
    parts = (kind, f"shape{shape}" if shape else "", "optional" if optional else "")
    return ", ".join(filter(None, parts))


SEE_ALSO = re.compile(r"^See Also\n-+\n(.+?)(?=\n\n|\n?\Z)", re.MULTILINE | re.DOTALL)


def describe_see_also(
    _app: Any, _what: str, _name: str, _value: Any, _options: Any, lines: list[str]
) -> None:
    """Write the first line of its docstring beside each name of a See Also."""

    def described(match: re.Match[str]) -> str:
        names = re.split(r",\s+|\n", match[1])
        entries = [f":obj:`~{name}`\n    {_first_line(pydoc.locate(name))}" for name in names]
        return "See Also\n--------\n" + "\n".join(entries)

    lines[:] = SEE_ALSO.sub(described, "\n".join(lines)).split("\n")


def _first_line(value: Any) -> str:
    return (inspect.getdoc(value) or "").partition("\n")[0]


def skip_foreign(
    _app: Any, what: str, _name: str, value: Any, _skip: bool, _options: Any
) -> bool | None:
    """Leave out of the page of a module what it takes from other packages."""
    home = getattr(value, "__module__", None) or "deboom"
    return True if what == "module" and not home.startswith("deboom") else None


def show_values(
    _app: Any,
    _what: str,
    _name: str,
    value: Any,
    _options: Any,
    signature: str | None,
    returns: Any,
) -> tuple[str | None, Any] | None:
    """Write the value of a constant into a signature in place of its name."""
    called = value.__init__ if inspect.isclass(value) else value
    names = getattr(inspect.unwrap(called), "__globals__", {}) if signature else {}

    def shown(match: re.Match[str]) -> str:
        constant = names.get(match[1])
        if dataclasses.is_dataclass(constant):
            return f"={type(constant).__name__}(…)"
        return f"={constant!r}" if isinstance(constant, int | float | str | tuple) else match[0]

    return (CONSTANT.sub(shown, signature), returns) if signature and names else None


def link_outside(_app: Any, _env: Any, node: Any, content: Any) -> Any:
    """Link a name of numpy or pandas to its page."""
    target = node.get("reftarget", "")
    page = OUTSIDE.get(target.rpartition(".")[0]) if node.get("refdomain") == "py" else None
    if page is None:
        return None
    return nodes.reference("", "", content, refuri=page.format(target), internal=False)


def write_live_page(path: Path) -> None:
    """Write the page with sliders of a small front, unless it is there: it takes a minute."""
    if path.is_file():
        return
    path.parent.mkdir(exist_ok=True)
    budget = {"with_": "prescribed", "generations": 10, "population": 40, "checks": 512}
    draw, Report.figure = Report.figure, lambda *_, **__: None  # nobody looks at its pictures
    try:
        with tempfile.TemporaryDirectory() as folder:
            run = run_study(load_study("front"), Path(folder), budget)
            write_interactive_page(run, studies=None, out=path.parent)
    finally:
        Report.figure = draw


def copy_mathjax(app: Any, error: Exception | None) -> None:
    """Put MathJax and its licence beside the site, which then needs no network."""
    if error is None and app.builder.name == "html":
        target = Path(app.outdir) / "_static" / "mathjax"
        target.mkdir(parents=True, exist_ok=True)
        for source in (MATHJAX / "es5" / "tex-svg.js", MATHJAX / "LICENSE"):
            shutil.copyfile(str(source), target / source.name)


def setup(app: Any) -> None:
    """Link what is cited, and write what is read from the code."""
    write_reference(HERE / "reference")
    write_live_page(HERE / "_live" / "interactive.html")
    app.connect("build-finished", copy_mathjax)
    app.connect("missing-reference", link_outside)
    app.connect("autodoc-process-docstring", head_lists, priority=400)
    app.connect("autodoc-process-docstring", describe_see_also, priority=400)
    app.connect("autodoc-process-signature", show_values)
    app.connect("autodoc-skip-member", skip_foreign)
    app.connect("source-read", write_from_code)
    app.connect("source-read", link_page)
    app.connect("autodoc-process-docstring", link_docstring)
