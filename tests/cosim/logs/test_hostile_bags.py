"""Hostile bags end with a run or one line, within 1 GiB of memory and 20 s of a processor."""

import contextlib
import json
import sqlite3
import subprocess
import sys

import pytest

from cosim.errors import ImportLogError
from cosim.logs.decompression import Decompressor
from cosim.logs.message_definitions import parse_definition, reachable_types
from tests.cosim.logs import hostile_bags
from tests.cosim.logs.hostile_bags import idl, nested

pytest.importorskip("rosbags")


def faults(folder, first, last):
    """Import hostile bags in a process; return what is wrong."""
    command = [sys.executable, "-m", "tests.cosim.logs.hostile_bags", str(folder), str(first), str(last)]
    run = subprocess.run(command, capture_output=True, text=True)
    outcomes = [json.loads(line) for line in run.stdout.splitlines()]
    assert len(outcomes) == last - first, run.stderr
    return {outcome["seed"]: outcome["fault"] for outcome in outcomes if outcome["fault"]}


@pytest.mark.medium
@pytest.mark.parametrize("first", [0, 6, 12, 18])
def test_a_few_hostile_bags_are_a_run_or_one_line(first, tmp_path):
    assert not faults(tmp_path, first, first + 6)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_thousand_hostile_bags_are_a_run_or_one_line(first, tmp_path):
    assert not faults(tmp_path, first, first + 100)


@pytest.mark.parametrize("compression", ["bz2", "lz4", "zstd"])
def test_parts_of_a_bag_are_bounded_in_total(compression, tmp_path):
    """Those of a small file to 16 MiB."""
    parts, half = Decompressor(1000), hostile_bags.PACK[compression](bytes(1 << 23))
    assert len(parts.decompress(compression, half)) == len(parts.decompress(compression, half)) == 1 << 23
    with pytest.raises(ImportLogError, match="decompresses to more than 16777216 bytes"):
        parts.decompress(compression, hostile_bags.PACK[compression](b"\0"))


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("float64 X=1e999\n", "constant X = inf, expected a finite one"),
        ("uint8[0] x\n", "array of length 0"),
        ("uint8[-1] x\n", "array of length -1"),
        ("string[1001] x\n", "more than 1000 texts"),
        (nested("C1[40] c\n", "C2[40] d\n" * 30, "uint8 e\n"), "more than 1000 texts and nested"),
        ("float64 x\n" * 1001, "more than 1000 fields"),
        ("\n" * 5001, "is too long"),
        (nested("a/C1 c\n", "a/B b\n"), "nests 'a/msg/B' in itself"),
        (nested(*(f"C{k} c\n" for k in range(1, 18)), "uint8 e\n"), "deeper than 16 types"),
        ("Nowhere x\n", "no definition of 'a/msg/Nowhere'"),
        (nested("C1[] c\n", ""), "sequence of 'a/msg/C1', which has no fields"),
        ("float64[\n", "cannot be parsed"),
        (idl("const long C = 1 << 9999999999;"), "operator '<<'"),
        (idl("const long C = 9*9;"), r"operator '\*'"),
        (idl("const long C = ((((((1))))));"), r"operator '\('"),
        (idl("const long C = A -1;"), "operator '-'"),
        (idl("const double C = 1.0+1.0;"), r"operator '\+'"),
        (idl('const string S = "a\\"; const long C = 1 << 9999999999;'), "operator '<<'"),
        (idl("const long C = 1;" * 1001), "is too long"),
    ],
)
def test_definitions_are_refused_before_code_is_made(text, what):
    language = "ros2idl" if text.startswith("module") else "ros2msg"
    with pytest.raises(ImportLogError, match=what):
        reachable_types(parse_definition(text, "a/msg/B", language), "a/msg/B", 0)


@pytest.mark.parametrize("name", ["9x/msg/9Odom", "class", "a/msg/B\nint8 x", "a/msg/B'", "a//B", "a/msg/é"])
def test_names_that_are_no_identifiers_are_refused(name):
    with pytest.raises(ImportLogError, match="expected identifiers"):
        reachable_types({name: ([], [])}, name, 0)


def test_common_definitions_are_accepted():
    """Of all messages that rosbags knows, and IDL as recorders write it."""
    from rosbags.typesys import Stores, get_typestore

    for store in (Stores.ROS1_NOETIC, Stores.ROS2_HUMBLE):
        types = get_typestore(store).fielddefs
        for name in types:
            assert name in reachable_types(types, name, 1)
    text = idl(
        "const double C = -1.5e-5; const long D = -5;",
        'double__36 a; sequence<string, 5> b; @verbatim (language="comment", text=\n "a * (b" " - c") long c; '
        "@default (value=-1) long d; // 1 << 5 * (2\n",
        "typedef double double__36[36];",
    )
    assert "a/msg/B" in reachable_types(parse_definition(text, "a/msg/B", "ros2idl"), "a/msg/B", 1)


@pytest.mark.parametrize(
    ("script", "what"),
    [
        ("ALTER TABLE messages RENAME TO m; CREATE VIEW messages AS SELECT * FROM m", "view 'messages'"),
        ("CREATE TRIGGER t AFTER INSERT ON messages BEGIN SELECT 1; END", "trigger 't'"),
        (hostile_bags.SCHEMAS[3], "table 'messages', which is no plain table"),
        (hostile_bags.SCHEMAS[4], "column 'data' of messages"),
        (hostile_bags.SCHEMAS[5], "rows that are larger than the file"),
        (hostile_bags.SCHEMAS[6], "column 'id' of messages"),
        (hostile_bags.SCHEMAS[7], "table 'messages', which is no plain table|malformed database schema"),
        ("UPDATE topics SET name = x'00'", "a row has bytes, expected str"),
    ],
)
def test_databases_that_no_recorder_writes_are_refused(script, what, tmp_path, refused):
    path = tmp_path / "bag.db3"
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
            "INSERT INTO topics VALUES(1, '/odom', 'geometry_msgs/msg/Point', 'cdr');"
            "WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c WHERE n < 900)"
            "INSERT INTO messages SELECT n, 1, n, zeroblob(28) FROM c;"
        )
        database.executescript(script)
    (tmp_path / "map.toml").write_text(hostile_bags.MAP)
    refused(what, path, columns=tmp_path / "map.toml")
