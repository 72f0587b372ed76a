"""``python -m plant_fmu.importers``: one driver's process. Reads request.json, writes reply.json, in its folder."""

from __future__ import annotations

import importlib
import json
from dataclasses import asdict
from pathlib import Path

from plant_fmu.errors import ImporterError
from plant_fmu.importers.fmu_file import read_fmu
from plant_fmu.importers.task import Answer, Task


def main() -> None:
    """Run the requested driver; an importer that cannot be loaded, or refuses, is a reply too."""
    folder = Path.cwd()  # an importer may change it
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    reply: dict[str, object]
    try:
        driver = importlib.import_module(f"plant_fmu.importers.{request['module']}")
    except (ImportError, OSError, ImporterError) as error:
        reply = {"unusable": str(error)}
    else:
        try:
            answer: Answer = driver.run(read_fmu(Path(request["fmu"])), Task(**request["task"]), folder / "fmu")
            reply = asdict(answer)
        except Exception as error:  # noqa: BLE001 any exception of an importer is its answer
            reply = {"error": str(error) or type(error).__name__}
    (folder / "reply.json").write_text(json.dumps(reply), encoding="utf-8")


if __name__ == "__main__":
    main()
