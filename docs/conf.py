"""The manual's build by Sphinx: `make docs`."""

from __future__ import annotations

import sys
from importlib.metadata import version as version_of
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))  # for docs_hooks

project = "Velatura"
author = "The Velatura authors"
copyright = author
version = release = version_of("velatura")

extensions = [
    "docs_hooks",
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
templates_path = ["_templates"]
default_role = "code"  # single backticks in docstrings

# The reference of the Python package
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config, record"}
autodoc_typehints_format = "short"
autosummary_generate = ["reference/api.rst"]
nitpick_ignore_regex = [("py:(class|obj|data|exc|func|attr)", r".*")]
nitpicky = True  # with -W, a reference to nothing ends the build
exclude_patterns = ["_templates", "examples", "figures", "gallery/*.ipynb"]

# Pages in Markdown. The notebook is stored as it ran, which a test repeats.
myst_enable_extensions = ["amsmath", "attrs_block", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_links_external_new_tab = False
nb_execution_mode = "off"
suppress_warnings = ["myst-nb.mime_priority"]  # widgets, which a stored notebook cannot show

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "backreferences_dir": "gallery/backreferences",
    "doc_module": ("velatura",),
    "reference_url": {"velatura": None},
    "within_subsection_order": "docs_hooks.ExampleOrder",
    "filename_pattern": r"\.py$",  # all are run
    "download_all_examples": False,
    "plot_gallery": True,
    "abort_on_example_error": True,
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "remove_config_comments": True,
}

html_title = f"Velatura {release}"
html_theme = "pydata_sphinx_theme"
html_theme_options = {
    "secondary_sidebar_items": ["page-toc", "sg_download_links"],
    "show_prev_next": False,
    "navbar_persistent": ["search-button"],  # the wider one has a label that differs from what it shows
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_show_sourcelink = False
html_context = {"default_mode": "auto"}  # light or dark, as the system is

# Formulas are typeset by a file of the site, whose glyphs are paths, so that neither a server nor fonts are needed.
_mathjax = find_spec("sphinx-mathjax-offline")
assert _mathjax and _mathjax.origin
html_static_path = ["_static", str(Path(_mathjax.origin).with_name("static") / "mathjax" / "tex-svg.js")]
html_css_files = ["manual.css"]
html_js_files = ["manual.js"]
mathjax_path = "tex-svg.js"
