"""Sphinx makes the site of these pages: ``make docs``. Nothing in it comes from elsewhere: a robot has no internet."""

from __future__ import annotations

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from canhelm import __version__

project = "canhelm"
version = release = __version__
copyright = "the canhelm developers"

extensions = ["myst_parser"]
myst_heading_anchors = 4
highlight_language = "none"
nitpicky = True

html_theme = "alabaster"
html_theme_options = {"page_width": "72em", "sidebar_width": "16em", "fixed_sidebar": True, "show_powered_by": False}
html_copy_source = False
html_show_copyright = False


def setup(app: Sphinx) -> None:
    """Conversations with the CiA 309-3 gateway (```309) are shown as they are."""
    app.add_lexer("309", TextLexer)
