"""
Formulas as MathML, made when the pages are built.

MathJax and KaTeX come from a server or are a megabyte of script; images want LaTeX. MathML is part
of the page, needs no script, follows the text's size and colour, can be read aloud, and every
browser since 2023 draws it.
"""

from __future__ import annotations

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator


def _mathml(node: nodes.Element, display: str) -> str:
    latex = node.astext()
    try:
        return convert(latex, display=display)
    except Exception as error:  # whatever the converter stumbles over, the formula is at fault
        raise ExtensionError(f'{node.source}: no formula: {latex}: {error!r}') from error


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(_mathml(node, 'inline'))
    raise nodes.SkipNode


def _block(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, 'div', CLASS='formula'))
    self.body.append(_mathml(node, 'block'))
    if node['number']:
        number = get_node_equation_number(self, node)
        self.body.append(f'<span class="number">({number})')
        self.add_permalink_ref(node, 'Link to this equation')
        self.body.append('</span>')
    self.body.append('</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer; conf.py chooses it by `html_math_renderer`."""
    app.add_html_math_renderer('mathml', (_inline, None), (_block, None))
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
