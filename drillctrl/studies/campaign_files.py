"""Write a campaign to a file."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

from drillctrl.base.errors import InputError
from drillctrl.base.files import replacing

if TYPE_CHECKING:
    from drillctrl.studies.campaign import Campaign


def save_campaign(campaign: Campaign, path: str | Path) -> None:
    """Write the rows as CSV or all of it as JSON, whole or not at all.

    Raises
    ------
    InputError
        If the name does not end in .csv or .json.
    """
    ending = Path(path).suffix.lower()
    if ending == ".json":
        text = json.dumps(campaign.to_dict(), indent=1, allow_nan=False) + "\n"
    elif ending == ".csv":
        lines = io.StringIO()
        kick = ", ".join(f"{name} {value!r}" for name, value in campaign.disturbance.items())
        lines.write(f"# drillctrl campaign, dimensionless; disturbance of size 1: {kick}\n")
        writer = csv.writer(lines, lineterminator="\n")
        writer.writerow(campaign.columns)
        writer.writerows(campaign.rows())
        text = lines.getvalue()
    else:
        raise InputError("path", str(path), "a name that ends in .csv or .json")
    with replacing(path) as file:
        file.write(text.encode("utf-8"))
