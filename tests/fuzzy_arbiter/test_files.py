"""Files are written atomically, with the usual permissions."""

import os
import stat

import pytest

from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.files import write_atomic


def test_file_permissions_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomic(tmp_path / "a", b"new")
    finally:
        os.umask(before)
    assert (tmp_path / "a").read_bytes() == b"new"
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


def test_symbolic_link_is_preserved(tmp_path):
    (tmp_path / "a").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    write_atomic(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "a").read_bytes() == b"new"


@pytest.mark.parametrize("name", ["none/a", "folder", "null\0", "long" * 100])
def test_failed_write_leaves_no_file(name, tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(FormatError, match=name[:4]):
        write_atomic(tmp_path / name, b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
