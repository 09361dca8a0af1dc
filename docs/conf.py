"""The manual: `make docs` builds it into build/docs."""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / '_ext'), str(HERE.parent)]

import slosh_ros  # noqa: E402

project = 'slosh_ros'
author = ElementTree.parse(HERE.parent / 'package.xml').findtext('maintainer')
copyright = f'2026, {author}'
release = version = slosh_ros.__version__

extensions = ['mathml', 'myst_parser', 'reference', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
myst_enable_extensions = ['dollarmath', 'colon_fence', 'deflist']
myst_heading_anchors = 3
html_math_renderer = 'mathml'
math_number_all = False
exclude_patterns = ['_ext']

# The docstrings tell types and shapes in words; nothing is to be looked up on the net.
default_role = 'code'
napoleon_google_docstring = False
napoleon_use_param = napoleon_use_rtype = False
napoleon_use_ivar = True
suppress_warnings = ['ref.python']  # attributes of one name in several classes
nitpick_ignore_regex = [('py:.*', r'(?!slosh_ros\.).*')]  # words of a type, as "array"
autodoc_typehints = 'none'
autodoc_member_order = 'bysource'
toc_object_entries = False

html_theme = 'furo'
html_title = f'slosh_ros {release}'
html_static_path = ['_static']
html_css_files = ['slosh.css']
html_copy_source = html_show_sourcelink = False
html_theme_options = {'source_repository': '', 'top_of_page_buttons': []}


def _types_are_words(app, what, name, obj, options, lines):
    """Keep the type of an attribute from being looked up: 'array, shape (3,)' is none."""
    lines[:] = [re.sub(r'^(:vartype \w+:|:type:) (.*)', r'\1 ``\2``', line) for line in lines]


def setup(app):
    """Run after napoleon, which makes the fields."""
    app.connect('autodoc-process-docstring', _types_are_words, priority=900)
