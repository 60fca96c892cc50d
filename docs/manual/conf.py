"""Sphinx's settings for the manual. `build.py` lays out the pages that they are for."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import gonio

project = "gonio"
author = "The gonio developers"
copyright = author
version = release = gonio.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "mathematics",
]
root_doc = "index"
exclude_patterns = ["programs/*"]
smartquotes = False  # dashes and quotes are what the pages say
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", r"(?!gonio\.).*")
]  # types of NumPy, private classes: signatures name them as they are

myst_enable_extensions = ["dollarmath", "html_image"]
myst_dmath_allow_space = False
myst_heading_anchors = 4

add_module_names = False
autodoc_inherit_docstrings = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
maximum_signature_line_length = 88
python_use_unqualified_type_names = True

sphinx_gallery_conf = {
    "examples_dirs": ["programs"],
    "gallery_dirs": ["gallery"],
    "backreferences_dir": "gallery/uses",
    "doc_module": ("gonio",),
    "filename_pattern": r"plot_",
    "ignore_pattern": r"^(?!.*plot_)",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "remove_config_comments": True,
    "matplotlib_animations": False,
    "plot_gallery": "True",
    "abort_on_example_error": True,
    "image_srcset": ["2x"],
}

html_theme = "pydata_sphinx_theme"
html_title = "gonio"
html_baseurl = ""
html_static_path = ["gonio.css"]
html_css_files = ["gonio.css"]
html_show_search_summary = False  # pages that are opened as files may not read each other
html_show_sourcelink = False
html_copy_source = False
html_permalinks_icon = "#"
html_sidebars = {"index": [], "search": [], "genindex": []}
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": "gonio"},
    "navbar_align": "left",
    "header_links_before_dropdown": 8,
    "navbar_end": ["theme-switcher"],
    "navbar_persistent": ["search-button"],
    "navigation_with_keys": False,
    "show_prev_next": True,
    "show_nav_level": 1,
    "navigation_depth": 2,
    "collapse_navigation": False,
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "article_footer_items": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
