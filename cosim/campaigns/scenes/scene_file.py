"""Files of scenes, one JSON object per line, and the scenes of a campaign in a temporary file."""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

import msgspec

from cosim.campaigns.scenes.scenario_scene import AnyScene, ScenarioScene, check_scenario_scene
from cosim.campaigns.scenes.scene import Scene
from cosim.errors import ScenarioError
from plant_fmu import PlantFmuError
from plant_fmu.toml_tables import decode

STANDARD_INPUT = Path("-")
_MAX_BYTES = 1_000_000  # maximum number of bytes of a line, since a pipe may send an endless one


def decode_scene(line: bytes) -> AnyScene:
    """Parse the scene of a line."""
    try:
        table = msgspec.json.decode(line)
        if not isinstance(table, dict):
            raise ScenarioError(f"expected one JSON object, got {type(table).__name__!r}")
        scene: AnyScene = decode(table, ScenarioScene) if "scenario" in table else decode(table, Scene)
    except (msgspec.MsgspecError, PlantFmuError, RecursionError, UnicodeDecodeError) as error:
        raise ScenarioError(str(error)) from error
    if isinstance(scene, ScenarioScene):
        check_scenario_scene(scene)
    elif not scene.depth_band[0] < scene.depth_band[1]:
        raise ScenarioError(f"depth_band is {scene.depth_band}, expected two depths, the shallow one first")
    return scene


def encode_scene(scene: AnyScene, line: bytes) -> bytes:
    """Encode a scene in the order of its fields, with the keys of its line alone."""
    # Campaigns are identified by this text, so a key that is new here must not appear in scenes of earlier files.
    return msgspec.json.encode(_select_keys(msgspec.to_builtins(scene), msgspec.json.decode(line)))


def _select_keys(value: Any, given: Any) -> Any:
    if isinstance(value, dict):
        return {key: _select_keys(item, given[key]) for key, item in value.items() if key in given}
    if isinstance(value, list | tuple):
        return [_select_keys(*pair) for pair in zip(value, given, strict=True)]
    return value


def read_scenes(path: str | Path) -> Iterator[AnyScene]:
    r"""Read scenes from a file with one JSON object per line; blank lines are skipped.

    Parameters
    ----------
    path : str or Path
        File of the scenes.

    Yields
    ------
    Scene or ScenarioScene
        Scenes in the order of the file.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or a line is not a scene; the message names the line and the key.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> [scene.seed for scene in cosim.read_scenes(Path("scenes.jsonl"))]
    [0, 1]
    """
    try:
        with Path(path).open("rb") as file:
            yield from (scene for scene, _ in scenes_in(file, str(path)))
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror or error}") from error


def scenes_in(file: IO[bytes], name: str) -> Iterator[tuple[AnyScene, bytes]]:
    """Read scenes from an open file, each with its line."""
    for number, line in enumerate(iter(lambda: file.readline(_MAX_BYTES + 1), b""), 1):
        if len(line) > _MAX_BYTES:
            raise ScenarioError(f"{name}, line {number}: has more than {_MAX_BYTES} bytes, expected a scene")
        if line.strip():
            try:
                yield decode_scene(line), line
            except ScenarioError as error:
                raise ScenarioError(f"{name}, line {number}: {error}") from error


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
        self._offsets: dict[int, tuple[int, int]] = {}  # offset and length [bytes] of each scene's line, by seed
        digest, offset = hashlib.sha256(), 0
        for scene, text in scenes_in(file, name):
            if scene.seed in self._offsets:
                raise ScenarioError(f"{name}: seed {scene.seed} comes twice, expected each once")
            line = encode_scene(scene, text) + b"\n"
            self._file.write(line)
            digest.update(line)
            self._offsets[scene.seed] = offset, len(line)
            offset += len(line)
        if not self._offsets:
            raise ScenarioError(f"{name}: holds no scene, expected one JSON object a line")
        self._file.flush()
        self.digest = digest.hexdigest()
        self.seeds = sorted(self._offsets)

    def lines(self, seeds: Iterable[int]) -> list[bytes]:
        """Return the lines of the scenes with given seeds, in this order."""
        lines = []
        for seed in seeds:
            offset, length = self._offsets[seed]
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
