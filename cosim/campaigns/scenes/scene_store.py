"""The scenes of a campaign, checked once and stored in a temporary file instead of memory."""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import IO

from cosim.campaigns.scenes.scene_file import encode_scene, scenes_in
from cosim.errors import ScenarioError

STANDARD_INPUT = Path("-")


class SceneStore:
    """Checked scenes in a temporary file, found by seed."""

    def __init__(self, path: Path) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 -- closed by close
        try:
            if path == STANDARD_INPUT:
                if sys.stdin is None:
                    raise ScenarioError("standard input: is closed")
                self._read(sys.stdin.buffer, "standard input")
            else:
                with path.open("rb") as file:
                    self._read(file, str(path))
        except OSError as error:
            self.close()
            raise ScenarioError(f"{path}: {error.strerror or error}") from error
        except BaseException:
            self.close()
            raise

    def _read(self, file: IO[bytes], name: str) -> None:
        self._places: dict[int, tuple[int, int]] = {}  # offset and length [bytes] of each scene's line, by seed
        digest, offset = hashlib.sha256(), 0
        for scene, text in scenes_in(file, name):
            if scene.seed in self._places:
                raise ScenarioError(f"{name}: seed {scene.seed} comes twice, expected each once")
            line = encode_scene(scene, text) + b"\n"
            self._file.write(line)
            digest.update(line)
            self._places[scene.seed] = offset, len(line)
            offset += len(line)
        if not self._places:
            raise ScenarioError(f"{name}: holds no scene, expected one JSON object a line")
        self._file.flush()
        self.digest = digest.hexdigest()
        self.seeds = sorted(self._places)

    def lines(self, seeds: Iterable[int]) -> list[bytes]:
        """Return the lines of the scenes with given seeds, in this order."""
        lines = []
        for seed in seeds:
            offset, length = self._places[seed]
            self._file.seek(offset)
            lines.append(self._file.read(length))
        return lines

    def __len__(self) -> int:
        return len(self.seeds)

    def close(self) -> None:
        """Remove the temporary file. May be called twice."""
        self._file.close()

    def __enter__(self) -> SceneStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
