"""A comparison as one page that needs nothing else and prints well."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from drillctrl.base.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>Feedback structures at {{ point }}</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 72rem; color: #222; }
h1 { font-size: 1.4rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.85rem; }
th, td { padding: 0.25rem 0.55rem; text-align: right; border-bottom: 1px solid #ccc; }
th:first-child, td:first-child { text-align: left; }
tr.unstable td { color: #999; }
figure { margin: 0; break-inside: avoid; } figure img { width: 100%; }
.figures { display: grid; grid-template-columns: 1fr 1fr; gap: 1rem; }
.wide { overflow-x: auto; } .small { font-size: 0.8rem; color: #555; }
@media print {
  @page { size: A4 landscape; margin: 12mm; }
  body { margin: 0; max-width: none; font-size: 10px; }
  table { font-size: 9px; } .wide { overflow: visible; } .small { font-size: 8px; }
  h2 { margin-top: 0.8rem; } figure img { max-height: 82mm; object-fit: contain; }
}
</style>
</head>
<body>
<h1>Feedback structures at {{ point }}</h1>
<p>Sorted by {{ sort }}; best first. Responses follow {{ disturbance }} from steady drilling.</p>
<div class="wide"><table>
<thead><tr><th></th>{% for text in headings %}<th>{{ text }}</th>{% endfor %}</tr></thead>
<tbody>
{% for label, stable, values in rows -%}
<tr{% if not stable %} class="unstable"{% endif %}><td>{{ label }}</td>
{%- for text in values %}<td>{{ text }}</td>{% endfor %}</tr>
{% endfor %}</tbody>
</table></div>
<p class="small">{{ legend }}</p>
<h2>What better costs</h2>
<ul>{% for text in sentences %}<li>{{ text }}</li>{% endfor %}</ul>
<h2>Gains</h2>
<table>
<thead><tr><th></th><th>outputs</th><th>K1</th><th>K2</th></tr></thead>
<tbody>
{% for label, outputs, now, past in gains -%}
<tr><td>{{ label }}</td><td>{{ outputs }}</td><td>{{ now }}</td><td>{{ past }}</td></tr>
{% endfor %}</tbody>
</table>
<p class="small">u = K1 Y(t) + K2 Y(t − τ0) is added to θ''.</p>
<h2>Figures</h2>
<div class="figures">
{% for title, data in figures -%}
<figure><img alt="{{ title }}" src="data:image/svg+xml;base64,{{ data }}"></figure>
{% endfor %}</div>
</body>
</html>
"""


def _image(ax: Axes) -> str:
    import matplotlib as mpl

    figure = ax.get_figure(root=True)
    assert figure is not None
    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return base64.b64encode(stream.getvalue()).decode("ascii")


def comparison_page(draw: Callable[[], Sequence[tuple[str, Axes]]], **values: object) -> str:
    """Return the page.

    Parameters
    ----------
    draw : callable
        Returns titles and Axes; called once it is known that the page can be made.
    **values
        What the page names: see `Comparison.to_html`.

    Raises
    ------
    InputError
        If jinja2 is not installed.
    """
    try:
        import jinja2
    except ImportError:
        raise InputError("report", "HTML", "installed: pip install 'drillctrl[report]'") from None
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    images = [(title, _image(ax)) for title, ax in draw()]
    page: str = environment.from_string(_PAGE).render(figures=images, **values)
    return page
