"""A recording as one page that needs nothing else and prints well."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING

from drillctrl.base.language import Language
from drillctrl.base.templates import filled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.records.findings import Findings


def record_page(study: Findings, told: Language) -> str:
    """Return the page; see `RecordStudy.to_html`."""
    from drillctrl.records.overview import separate_figures
    from drillctrl.records.words import record_rows, verdict

    figures = [(title, _image(ax)) for title, ax in separate_figures(study, told)]
    record = study.record
    return filled(
        "drillctrl.records",
        "record.html.j2",
        source=Path(record.source).name,
        verdict=verdict(study),
        rows=record_rows(study, told),
        columns=[(t.quantity.replace("_", " "), t.column, t.unit or "") for t in record.taken],
        notes=study.notes,
        figures=figures,
    )


def _image(ax: Axes) -> str:
    import matplotlib as mpl

    figure = ax.get_figure(root=True)
    assert figure is not None
    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return base64.b64encode(stream.getvalue()).decode("ascii")
