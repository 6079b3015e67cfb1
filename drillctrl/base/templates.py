"""Files from templates, which lie beside the module that fills them."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2


def filled(package: str, file: str, /, **words: object) -> str:
    """Return a filled template.

    Parameters
    ----------
    package : str
        The package in whose folder ``templates`` it lies.
    file : str
        Its name, such as ``controller.c.j2``.
    **words
        What it names; in a page of HTML they are escaped. A word that is missing is an error.
    """
    return _environment(package).get_template(file).render(words)


@functools.cache
def _environment(package: str) -> jinja2.Environment:
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        autoescape=jinja2.select_autoescape(("html.j2",)),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        auto_reload=False,
    )
