"""Members of an FMU beside description, binaries and sources: page, licenses, icon, terminals, references.

Imports: variables.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from string import Template

from plant_fmu.contents.layered import FOLDER, layered_files
from plant_fmu.contents.licenses import licenses
from plant_fmu.contents.page import page, text
from plant_fmu.contents.terminals import terminals_and_icons
from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle


def contents(vehicle: Vehicle, fmi: int, rows: Sequence[Variable] | None = None) -> dict[str, bytes]:
    """Return the members of a vehicle's FMU that are neither description nor binary nor source."""
    texts = {
        "documentation/index.html": page(vehicle, fmi, rows),
        **{f"documentation/licenses/{name}": content for name, content in licenses(fmi).items()},
    }
    if not any(v.array for v in rows or ()):  # parameter sets of SSP 1.0 have scalars alone
        references = layered_files(vehicle, rows)
        guide = text("fmi-ls-ref.txt")
        if f"{vehicle.name}_out.csv" in references:
            guide += text("fmi-ls-ref-results.txt")
        texts["documentation/fmi-ls-ref.txt"] = Template(guide).substitute(name=vehicle.name)
        texts |= {f"{FOLDER}/{name}": file for name, file in references.items()}
    picture = (resources.files("plant_fmu.contents") / "pages" / "icon.png").read_bytes()
    pictures = {"model.png": picture}
    if fmi == 3:
        texts["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(
            variables(vehicle) if rows is None else rows
        )
        texts["terminalsAndIcons/icon.svg"] = text("icon.svg")
        pictures = {"terminalsAndIcons/icon.png": picture}
    return pictures | {name: content.encode() for name, content in texts.items()}
