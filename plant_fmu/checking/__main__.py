"""``python -m plant_fmu.checking``: one driver's process. Reads request.json, writes reply.json, in its folder."""

from __future__ import annotations

import json
import pkgutil
from pathlib import Path

from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.checking.task import Task


def main() -> None:
    """Run the requested driver; an importer that cannot be loaded, or refuses, is a reply too."""
    folder = Path.cwd()  # an importer may change it
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    reply: dict[str, object]
    try:
        driver = pkgutil.resolve_name(request["driver"])
        values, note = driver(read_fmu(Path(request["fmu"])), Task(**request["task"]), folder / "fmu")
        reply = {"status": "ok", "note": note, "values": values}
    except Exception as error:  # noqa: BLE001 any exception of an importer is its answer
        reply = {"status": "failed", "note": str(error) or type(error).__name__}
    (folder / "reply.json").write_text(json.dumps(reply), encoding="utf-8")


if __name__ == "__main__":
    main()
