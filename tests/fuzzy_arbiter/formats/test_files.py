"""Files: format by suffix, errors that name the file, atomic writes."""

import os
import warnings
from dataclasses import replace

import pytest

from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.__main__ import main
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.formats import FORMATS, load, save, writes
from tests.fuzzy_arbiter.formats.systems import TIPPING


@pytest.mark.parametrize("format", FORMATS)
def test_file_suffix_selects_the_format_case_insensitively(format, tmp_path):
    for suffix in (format, format.upper()):
        path = tmp_path / f"a.b.{suffix}"
        save(TIPPING, path)
        assert load(path) == load(str(path)) == TIPPING


def test_existing_file_is_replaced_without_temporary_files(tmp_path):
    path, link = tmp_path / "a.json", tmp_path / "link.json"
    save(TIPPING, path)
    save(prioritized(), path)
    assert load(path) == prioritized() and os.listdir(tmp_path) == ["a.json"]
    assert path.stat().st_mode & 0o777 == 0o644
    link.symlink_to(path)  # is kept
    before = os.umask(0o027)
    try:
        save(TIPPING, link)
    finally:
        os.umask(before)
    assert link.is_symlink() and load(path) == TIPPING and link.stat().st_mode & 0o777 == 0o640


def test_a_failed_save_leaves_the_existing_file(tmp_path, monkeypatch):
    path = tmp_path / "a.fis"
    save(TIPPING, path)
    with pytest.raises(UnsupportedError):
        save(replace(TIPPING, name="a:b"), path)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(FormatError, match=r"a\.fis: No space left on device"):
        save(prioritized(), path)
    assert load(path) == TIPPING and os.listdir(tmp_path) == ["a.fis"]


@pytest.mark.parametrize("name", ["a.xml", "a", ".json", "a.json.txt"])
def test_unknown_suffixes_are_rejected(name, tmp_path):
    for call in (lambda path: save(TIPPING, path), load):
        with pytest.raises(FormatError, match="expected one of json, toml, fcl, fis, fll"):
            call(tmp_path / name)
    assert not os.listdir(tmp_path)


def test_unreadable_and_unwritable_paths_are_rejected(tmp_path):
    (tmp_path / "folder.json").mkdir()
    for path, fault in (
        ("none/a.json", "No such file"),
        ("folder.json", "is a folder|Is a directory"),
        ("a\0b.json", "null"),
        ("long" * 100 + ".json", "too long"),
    ):
        for call in (lambda path: save(TIPPING, path), load):
            with pytest.raises(FormatError, match=fault):
                call(tmp_path / path)
    assert os.listdir(tmp_path) == ["folder.json"]


@pytest.mark.parametrize("format", FORMATS)
def test_text_of_other_tools_may_be_of_other_encodings(format, tmp_path, capsys):
    path, comment = tmp_path / f"a.{format}", {"fcl": "// ", "fis": "% ", "fll": "# "}.get(format, "")
    mixed = "caf\xe9 in UTF-8\n".encode(), "caf\xe9, \u201cquoted\u201d\n".encode("cp1252"), b"caf\xe9 \x81\n"
    path.write_bytes(b"".join(comment.encode() + line for line in mixed) + writes(TIPPING, format).encode())
    if not comment:
        with pytest.raises(FormatError, match=rf"a\.{format}: byte \d+ is no UTF-8, expected text in UTF-8"):
            load(path)
        return
    for read in (load, Arbiter.load):
        with pytest.warns(UserWarning, match=rf"a\.{format}: line 2 is no UTF-8, so .* Windows-1252") as caught:
            assert getattr(read(path), "system", TIPPING) == TIPPING
        assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        assert main(["show", str(path)]) == 0
    assert capsys.readouterr().err == f"fuzzy_arbiter: {caught[0].message}\n"
    path.write_bytes(b"caf\xe9\0")
    with pytest.raises(FormatError, match="byte 3 is no UTF-8, expected text in UTF-8"):
        load(path)


def test_errors_name_the_file(tmp_path):
    path = tmp_path / "a.fll"
    save(TIPPING, path)
    text = path.read_text()
    path.write_text(text.replace("tip is low", "tip is lo"))
    with pytest.raises(
        DefinitionError, match=r"a\.fll: line \d+: R1 .*'tip' has no term 'lo', expected one of high, low"
    ):
        load(path)
    path.write_text("x")
    with pytest.raises(FormatError, match=r"a\.fll: line 1: 'x', expected a key, a colon and its value"):
        load(path)
    term = "  term: tip Ramp 0 1\n"
    for number, added in ((4, "  range: 1 0\n" + term), (6, "  range: 0 1\n" + 2 * term)):
        path.write_text(f"Engine: e\nInputVariable: tip\n  enabled: true\n{added}")
        with pytest.raises(DefinitionError, match=rf"a\.fll: line {number}: "):
            load(path)
    path.write_text(text, encoding="utf-16")
    with pytest.raises(FormatError, match=r"a\.fll: is UTF-16, expected UTF-8"):
        load(path)
