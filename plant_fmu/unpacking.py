"""Check an FMU's zip file before anything of it is parsed, extracted or run."""

from __future__ import annotations

import functools
import io
import unicodedata
import zipfile
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO
from xml.etree import ElementTree as ET

from plant_fmu.errors import FmuFileError
from plant_fmu.model_limits import INTERFACES, validate_description
from plant_fmu.shared_library import SUFFIXES, library_defect

DESCRIPTION = "modelDescription.xml"

MAX_SIZE = 2**30  # maximum number of bytes of an FMU's files together
MAX_FILES = 100_000  # maximum number of files of an FMU
MAX_RATIO = 200  # maximum ratio of those bytes to the FMU's own: libraries and descriptions compress to about a tenth
FREE_SIZE = 2**26  # number of bytes below which that ratio does not matter
MAX_READ = 2**24  # maximum number of bytes that are read at once; so the list of files is read, before any check
MAX_NAME = 1000  # maximum number of characters of a file's name
MAX_XML = 2**26  # maximum number of bytes of a description
MAX_ELEMENTS = 1_000_000  # maximum number of elements of a description
MAX_VARIABLES = 200_000  # maximum number of variables and aliases, for each of which an importer takes 50 us
MAX_DEPTH = 100  # maximum number of levels of nested elements

_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # methods that FMI allows; others have no bound when unpacked
_TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
_DESCRIPTIONS = (DESCRIPTION, "sources/buildDescription.xml")  # files that FMPy parses
_CHUNK = 2**20  # number of bytes that are parsed at once


class _BoundedFile(io.BufferedReader):
    """A file of which at most `MAX_READ` bytes are read at once, whatever sizes a zip file states."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is None or size < 0:
            size = MAX_READ + 1
        data = super().read(min(size, MAX_READ + 1))
        if len(data) > MAX_READ:
            raise zipfile.BadZipFile(f"its list of files is larger than {MAX_READ} bytes")
        return data


@contextmanager
def open_fmu(path: Path, description: str = DESCRIPTION, what: str = "FMU") -> Iterator[zipfile.ZipFile]:
    """Open an FMU, or another zip file with a description, whose files are safe to extract."""
    try:
        if path.exists() and not path.is_file() and not path.is_dir():  # to open a pipe would wait for its other end
            raise FmuFileError(f"{path}: is no {what}: expected a file")
        with _BoundedFile(io.FileIO(path)) as source, zipfile.ZipFile(source) as archive:
            _check_members(path, archive)
            if description not in archive.namelist():
                raise FmuFileError(f"{path}: is no {what}: there is no {description} in it")
            yield archive
    except OSError as error:
        raise FmuFileError(f"{path}: {error.strerror or error}") from error
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
        raise FmuFileError(f"{path}: is no {what}: {error}; expected a whole zip file") from error


def unpack(path: Path, folder: Path, platforms: Sequence[str]) -> ET.Element:
    """Extract the files that a run needs from an FMU into a folder, and return its model description."""
    with open_fmu(path) as archive:
        root = read_description(path, archive, platforms)
        archive.extractall(folder, [name for name in archive.namelist() if _is_needed(name, platforms)])
    return root


def _is_needed(name: str, platforms: Collection[str]) -> bool:
    top, *rest = name.split("/")
    return rest[0] in platforms if top == "binaries" and rest else top not in ("documentation", "sources")


def read_description(path: Path, archive: zipfile.ZipFile, platforms: Sequence[str]) -> ET.Element:
    """Return the model description of an open FMU, after a check of all that an importer reads."""
    names = set(archive.namelist())
    roots = [parse_member(f"{path}: {name}", archive, name) for name in _DESCRIPTIONS if name in names]
    validate_description(path, roots[0])
    damaged = archive.testzip()  # reads no more than the sizes it states, and so finds those that lie
    if damaged is not None:
        raise FmuFileError(f"{path}: is no FMU: {damaged!r} is damaged")
    _check_libraries(path, archive, library_names(roots[0], platforms), platforms)
    return roots[0]


def terminal_members(path: Path, archive: zipfile.ZipFile) -> dict[str, list[tuple[str, ...]]]:
    """Return the paths of variables in the terminals of an open FMU, each with the name of its member last."""
    members: dict[str, list[tuple[str, ...]]] = {}

    def read(element: ET.Element, above: tuple[str, ...]) -> None:
        for terminal in element.iterfind("Terminal"):
            read(terminal, (*above, terminal.get("name", "")))
        for member in element.iterfind("TerminalMemberVariable"):
            members.setdefault(member.get("variableName", ""), []).append((*above, member.get("memberName", "")))

    if _TERMINALS in archive.namelist():
        for terminals in parse_member(f"{path}: {_TERMINALS}", archive, _TERMINALS).iterfind("Terminals"):
            read(terminals, ())
    return members


def library_names(root: ET.Element, platforms: Sequence[str]) -> dict[str, str]:
    """Return the names of the libraries that an FMU must have for a machine, by the interface that needs them."""
    folder = platforms[0 if root.get("fmiVersion", "").startswith("2") else -1]
    suffix = SUFFIXES.get(platforms[-1].partition("-")[2], "")
    identifiers = {element.tag: element.get("modelIdentifier") for element in root if element.tag in INTERFACES}
    return {interface: f"binaries/{folder}/{name}{suffix}" for interface, name in identifiers.items()}


def _check_libraries(
    path: Path, archive: zipfile.ZipFile, identifiers: Mapping[str, str], platforms: Sequence[str]
) -> None:
    """Refuse libraries of this machine that the system's loader would refuse, or that would end this process."""
    folders = tuple(f"binaries/{platform}/" for platform in platforms)
    for member in archive.infolist():
        if not member.is_dir() and member.filename.startswith(folders):
            is_loaded = member.filename in identifiers.values()
            with archive.open(member) as source:
                defect = library_defect(source, member.file_size, platforms[-1], is_loaded)
            if defect:
                raise FmuFileError(f"{path}: {member.filename} {defect}")


# ---- the zip file --------------------------------------------------------------------------------------------------


def _check_members(path: Path, archive: zipfile.ZipFile) -> None:
    """Refuse members that are unsafe to extract: not all importers check where they write."""
    members = archive.infolist()
    if len(members) > MAX_FILES:
        raise FmuFileError(f"{path}: refused: holds {len(members)} files, expected at most {MAX_FILES}")
    size, packed = sum(member.file_size for member in members), path.stat().st_size
    if size > MAX_SIZE:
        raise FmuFileError(f"{path}: refused: {size} bytes when extracted, expected at most {MAX_SIZE}")
    if size > max(FREE_SIZE, MAX_RATIO * packed):
        raise FmuFileError(
            f"{path}: refused: {packed} bytes become {size} when extracted, expected at most {MAX_RATIO} times as many"
        )
    known: dict[str, zipfile.ZipInfo] = {}
    for member in members:
        name = member.orig_filename
        if len(name) > MAX_NAME:
            raise FmuFileError(f"{path}: refused: a file's name has {len(name)} characters, expected {MAX_NAME}")
        is_link = member.external_attr >> 16 & 0o170000 == 0o120000
        if "\\" in name:
            raise FmuFileError(f"{path}: refused: {name!r} has a backslash, expected / between folders")
        if is_link or ":" in name or name.startswith("/") or ".." in PurePosixPath(name).parts:
            raise FmuFileError(f"{path}: refused: {name!r} leads out of the folder it is extracted to")
        if not name.isprintable():
            raise FmuFileError(f"{path}: refused: {name!r} is no name of a file")
        key = _file_key(name)
        if key in known and not _is_same(archive, member, known[key]):
            raise FmuFileError(f"{path}: refused: {name!r} would be written over {known[key].orig_filename!r}")
        known[key] = member
        if member.compress_type not in _METHODS:
            raise FmuFileError(f"{path}: refused: {name!r} is neither stored nor deflated")


def _is_same(archive: zipfile.ZipFile, a: zipfile.ZipInfo, b: zipfile.ZipInfo) -> bool:
    """Return True for two folders, and for one file that is in the archive twice."""
    if a.is_dir() or b.is_dir():
        return a.is_dir() and b.is_dir()
    same = (a.orig_filename, a.CRC, a.file_size) == (b.orig_filename, b.CRC, b.file_size)
    return same and archive.read(a) == archive.read(b)


def _file_key(name: str) -> str:
    """Return a key that is equal for names of one file on some system: case folded, accents composed, ends trimmed."""
    parts = (part.rstrip(" .") for part in PurePosixPath(name).parts)
    return unicodedata.normalize("NFC", "/".join(parts)).casefold()


# ---- its descriptions ----------------------------------------------------------------------------------------------


class _TooLargeError(ET.ParseError):
    """Raised for a document that is XML, but too large."""


class _BoundedTreeBuilder(ET.TreeBuilder):
    """Build a tree of limited size and depth, from a document without a document type, and so without entities."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = self._count = self._variables = 0
        self._section = ""  # element below the root

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        raise ET.ParseError("a document type is declared, expected none")

    def start(self, tag: str, attributes: dict[str, str], /) -> ET.Element:
        self._depth, self._count = self._depth + 1, self._count + 1
        if self._depth > MAX_DEPTH:
            raise ET.ParseError(f"elements are nested deeper than {MAX_DEPTH}")
        if self._count > MAX_ELEMENTS:
            raise _TooLargeError(f"has more than {MAX_ELEMENTS} elements")
        if self._depth == 2:
            self._section = tag
        elif self._section == "ModelVariables" and (self._depth == 3 or tag == "Alias"):
            self._variables += 1
            if self._variables > MAX_VARIABLES:
                raise _TooLargeError(f"has more than {MAX_VARIABLES} variables")
        return super().start(tag, attributes)

    def end(self, tag: str, /) -> ET.Element:
        self._depth -= 1
        return super().end(tag)


def parse_member(where: str, archive: zipfile.ZipFile, name: str) -> ET.Element:
    """Return the root of an XML file in an archive, which is not to be changed."""
    size = archive.getinfo(name).file_size
    if size > MAX_XML:
        raise FmuFileError(f"{where} has {size} bytes, expected at most {MAX_XML}")
    try:
        with archive.open(name) as source:
            return _cached_tree(source.read()) if size <= _CHUNK else _parse_tree(source)
    except _TooLargeError as error:
        raise FmuFileError(f"{where} {error}") from error
    except ET.ParseError as error:
        raise FmuFileError(f"{where} is no XML that can be read: {error}") from error
    except (LookupError, ValueError) as error:  # an encoding that is unknown, or wrong
        raise FmuFileError(f"{where} is no XML that can be read: {' '.join(str(error).split())}") from error


@functools.lru_cache(maxsize=16)
def _cached_tree(content: bytes) -> ET.Element:
    """Return the root of a document, which is not to be changed; one FMU is often opened again and again."""
    return _parse_tree(io.BytesIO(content))


def _parse_tree(source: IO[bytes]) -> ET.Element:
    # expat guards its own expansions, and here no document type is let through that could have any
    parser = ET.XMLParser(target=_BoundedTreeBuilder())  # noqa: S314
    while chunk := source.read(_CHUNK):
        parser.feed(chunk)
    root: ET.Element = parser.close()
    return root
