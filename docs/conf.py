"""Sphinx configuration. Figures are made by the project itself when the site is built."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "drillctrl"
author = copyright = "The drillctrl developers"
extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
templates_path = ["templates"]
html_theme = "pydata_sphinx_theme"
html_theme_options = {"show_prev_next": False, "secondary_sidebar_items": ["page-toc"]}
html_title = "drillctrl"
numpydoc_class_members_toctree = False
numpydoc_show_class_members = True
autosummary_generate = True
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("scraper",),
    "remove_config_comments": True,
    "download_all_examples": False,
    "abort_on_example_error": True,
}
