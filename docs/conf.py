"""The documentation site: `make docs` builds it offline into build/docs; warnings are errors."""

from __future__ import annotations

import deboom

project = "deboom"
author = "The deboom developers"
copyright = author  # noqa: A001 (Sphinx's name)
version = release = deboom.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["_templates", "gallery/**/README.rst", "gallery/README.rst"]
templates_path = ["_templates"]

html_theme = "pydata_sphinx_theme"
html_title = "deboom"
html_show_sourcelink = False
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]

autosummary_generate = True
autosummary_imported_members = True
autodoc_typehints = "none"
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "subsection_order": [
        f"../examples/{subject}" for subject in ("measurement", "mounts", "vehicles", "compressor")
    ],
    "within_subsection_order": "ExampleTitleSortKey",
    "filename_pattern": r"/\w+\.py$",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "min_reported_time": 1000,
    "plot_gallery": True,
}
