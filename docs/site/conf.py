"""How Sphinx makes the site out of the pages that build.py puts together. Nothing is loaded from elsewhere."""

import contextdb

project = "contextdb"
author = "contextdb contributors"
project_copyright = author
release = version = contextdb.__version__
extensions = ["myst_parser"]
myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4
suppress_warnings = ["misc.highlighting_failure"]
html_theme = "furo"
html_title = "contextdb"
html_show_sourcelink = False
html_copy_source = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_extra_path = ["extra"]
html_theme_options = {"navigation_with_keys": True, "top_of_page_buttons": []}
html_use_index = False
