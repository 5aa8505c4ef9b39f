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
html_favicon = html_logo = "favicon.svg"
html_css_files = ["site.css"]
html_extra_path = ["extra"]
_LIGHT = {
    "color-brand-primary": "#a3440a",
    "color-brand-content": "#a3440a",
    "color-background-secondary": "#f4f1ea",
    "color-foreground-muted": "#5c6066",
    "color-sidebar-link-text--top-level": "#3a3530",
    "font-stack": "Inter, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif",
}
_DARK = {
    "color-brand-primary": "#f2a65a",
    "color-brand-content": "#f2a65a",
    "color-background-primary": "#14181c",
    "color-background-secondary": "#1b2126",
    "color-foreground-muted": "#9aa0a8",
    "color-sidebar-link-text--top-level": "#d5d8dc",
}
html_theme_options = {
    "navigation_with_keys": True,
    "top_of_page_buttons": [],
    "light_css_variables": _LIGHT,
    "dark_css_variables": _DARK,
}
html_use_index = False
