"""Hostile bags by number, and a process that imports them, each in a child of its own with limits.

``python -m tests.cosim.logs.hostile_bags FOLDER FIRST LAST`` prints a line of JSON for each bag.
"""

from __future__ import annotations

import bz2
import contextlib
import json
import os
import random
import resource
import signal
import sqlite3
import struct
import sys
import traceback
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Attachment, Channel, Chunk, Footer, Message, Metadata, Schema

MEMORY, ADDRESSES, SECONDS = 1 << 30, 5 << 29, 20  # bytes of resident memory, bytes of addresses, s of the processor
MAP = '[position]\ntopic = "/odom"\ncolumns = ["x", "y", "z"]\n'
STAMPED = MAP + 'time = { column = "stamp" }\n'
PLAIN = "float64 x\nfloat64 y\nfloat64 z\n"
SEPARATOR = "=" * 80 + "\nMSG: "
START = 1_700_000_000 * 10**9
PACK = {
    "": bytes, "none": bytes, "bz2": bz2.compress, "lz4": lz4.frame.compress,
    "zstd": zstandard.ZstdCompressor().compress,
}  # fmt: skip
ZEROS = bz2.compress(bytes(1 << 26))


def nested(*bodies: str) -> str:
    """Return a definition whose nested types a/C1, a/C2, ... have the given bodies."""
    return bodies[0] + "".join(f"{SEPARATOR}a/C{k}\n{body}" for k, body in enumerate(bodies[1:], 1))


def idl(constants: str = "", fields: str = "", before: str = "") -> str:
    inner = f"{before} module B_Constants {{ {constants} }}; struct B {{ double x; double y; double z; {fields} }};"
    return f"module a {{ module msg {{ {inner} }}; }};"


def msg_definition(rng: random.Random) -> tuple[str, str]:
    """Return name and text of a definition in MSG."""
    if rng.random() < 0.5:
        return "a/msg/B", PLAIN
    n = rng.choice((3, 50, 1000, 30_000))
    words = ("class", "x", "__init__", "None", "X", "x__y", "_x", "é", "x-y", "x;import os", "structure_needs_at_least")
    word, other = rng.choice(words), rng.choice(words)
    numbers = ("1e999", "-1e999", "nan", "1<<40", "9" * 5000, "0x" + "f" * n, '\'a"""\'', '"\\"', "1", "-" * n)
    number = rng.choice(numbers)
    body = rng.choice((
        f"float64 X={number}\n",
        f"{rng.choice(('int8', 'bool', 'string', 'time', 'duration', 'byte', 'char'))} {other}={number}\n",
        "".join(f"float64 a{k}\n" for k in range(n)), "".join(f"int8 A{k}=1\n" for k in range(n)),
        f"string[{n}] names\n", f"uint8[{rng.choice((0, -1, n, 2**31, 2**63, 10**30))}] data\n",
        f"string<={number} s\n", f"float64[] data [{'1,' * n}]\n", f"float64 data {number}\n",
        f"float64 {word}\nfloat64 {other}\n", "\n" * n, " " * n, "#" * n + "\n", "@" + "a" * n,
        f"{'a/' * min(n, 3000)}B b\n", f"{word}/{other} b\n",
        nested("a/C1 c\n", "a/C1 c\n"), nested("a/C1 c\n", "a/B b\n"), nested("C1[] c\n", ""),
        nested("C1[] c\n", "C2[3] d\n", ""), nested("C1[] c\n", "C2[] d\n", "uint8[0] e\n"),
        nested("C1[] c\n", "C2[] d\n", "uint8 e\n"), nested(f"C1[{n}] c\n", f"C2[{n}] d\n", "uint8 e\n"),
        nested(*(f"C{k}[2] a\nC{k}[2] b\n" for k in range(1, min(n, 40))), "uint8 e\n"),
        nested(*(f"C{k} a\n" for k in range(1, min(n, 2000))), "uint8 e\n"),
        SEPARATOR + f"a/{word}\nint8 x\n" + SEPARATOR * min(n, 2000),
        "".join(rng.choices("float64 x=[]<>/\n#'\"0123456789\té\0", k=min(n, 5000))),
    ))  # fmt: skip
    names = (
        "9x/msg/9Odom",
        "a/msg/B\nint8 q",
        "a/msg/",
        "B",
        "a/msg/B'",
        'a/msg/"""',
        "class",
        "a" * 100_000,
        "",
        "a//B",
    )
    name = rng.choice(names) if rng.random() < 0.15 else "a/msg/B"
    return name, rng.choice((PLAIN + body, body + PLAIN, body, PLAIN))


def idl_definition(rng: random.Random) -> tuple[str, str]:
    """Return name and text of a definition in IDL."""
    if rng.random() < 0.2:
        return "a/msg/B", idl()
    n = rng.choice((3, 50, 400, 3000))
    value = rng.choice((
        "1 << 99999999999", "1<<(1<<30)", "(" * n + "1" + ")" * n, "-(-(-(-(-(5)))))", "9" * 4000 + "*" + "9" * 4000,
        "1e308*10.0", "1e999", "-5", "1.5e-5", "A" * n, "1|" * n + "1", "~" * n + "1",
        '"a\\"; const long D = 1 << 9999999999;',
        "'a'", "::" * n + "A", "5 >> -1", "5/0", "TRUE", '"' + "x" * n, "+1", "1-1", "1 -1", "1--1",
    ))  # fmt: skip
    return "a/msg/B", rng.choice((
        idl(f"const {rng.choice(('long', 'double', 'string', 'wchar', 'octet', 'fixed', 'Q'))} C = {value};"),
        idl("".join(f"const long C{k} = {k};" for k in range(n))),
        idl(fields=f"double a[{value}];"),
        idl(fields=f"sequence<double, {value}> a; string<{value}> b;"),
        idl(fields="".join(f"double a{k}[3];" for k in range(n))),
        idl(fields="wchar a; wstring b; long double c; any d;"),
        idl(fields="B b; sequence<B> c;"),
        idl(before="typedef d2 d1; typedef d1 d2;", fields="d1 a;"),
        idl(before="".join(f"typedef d{k + 1} d{k};" for k in range(n)), fields="d0 a;"),
        idl(before="enum E {" + ",".join(f"e{k}" for k in range(n)) + "};"),
        idl(before=f'@verbatim (language="comment", text={value}) @a({value})'),
        idl(before="/*" * n), idl(before="//" + "/" * n), idl(before='"' * n), idl(before=" " * n),
        "module a {" * n + "};" * n,
        "".join(rng.choices(["module ", "a", "{", "};", "<<", "(", ")", "=", "const ", "long ", '"', "/*", ";"], k=n)),
    ))  # fmt: skip


def payloads(rng: random.Random, head: bytes) -> list[tuple[int, bytes]]:
    """Return times [ns] and data of messages, some of them hostile."""
    step = rng.choice((10**8, 10**8, 1, 0, 3599 * 10**9, -(10**9), 10**15))
    count = rng.choice((40, 40, 400, 5000))
    messages = [(max(0, START + k * step), head + struct.pack("<3d", 0.01 * k, 0.0, 1.0)) for k in range(count)]
    for k in rng.sample(range(count), rng.choice((0, 0, 5, min(count, 40)))):
        data = rng.choice((
            head, b"", rng.randbytes(rng.choice((3, 30, 3000))), head + b"\xff" * 400,
            head + struct.pack("<I", 10**6) * 50,
            head + struct.pack("<3d", *rng.choices((float("nan"), float("inf"), 1e308, -1e308, 5e-324), k=3)),
            head + struct.pack("<24xI", 2**32 - 1), head + struct.pack("<I", 200_000) + bytes(200_000),
        ))  # fmt: skip
        messages[k] = rng.choice((messages[k][0], 0, 2**62, START)), data
    return messages


def packed(rng: random.Random, compression: str, data: bytes) -> bytes:
    """Compress data, perhaps with much after it, or not as said."""
    trick = rng.choice(("",) * 8 + (("zeros", "messages", "cut", "lie") if compression not in ("", "none") else ()))
    if trick == "zeros" and compression == "bz2":
        return bz2.compress(data) + ZEROS
    if trick == "zeros":
        data += bytes(rng.choice((1 << 20, 1 << 26)))
    if trick == "messages":
        size = 1 << (21 if compression == "bz2" else rng.choice((22, 26)))
        data = data[: 1 << 16] * max(1, size // max(1, len(data[: 1 << 16])))
    result = PACK["zstd" if trick == "lie" else compression](data)
    return result[: len(result) // 2] if trick == "cut" else result


def mcap_bag(rng: random.Random, path: Path) -> None:
    language = rng.choice(("ros2msg",) * 5 + ("ros2idl", "ros2idl", "protobuf", "jsonschema", ""))
    name, text = idl_definition(rng) if language == "ros2idl" else msg_definition(rng)
    inner, outer = RecordBuilder(), RecordBuilder()
    outer.write(b"\x89MCAP0\r\n")
    Schema(id=1, name=name, encoding=language, data=text.encode()).write(inner)
    channels = rng.choice((1,) * 12 + (30, 30, 30_000))
    for k in range(channels):
        topic = "/odom" if not k else f"/other{k}"
        encoding = rng.choice(("cdr",) * 20 + ("ros1", "json", "protobuf"))
        Channel(k % 65536, topic, encoding, {}, rng.choice((1,) * 20 + (0, 7))).write(inner)
    messages = payloads(rng, b"\0\1\0\0")
    for k, (when, data) in enumerate(messages):
        Message(k % channels if rng.random() < 0.9 else 60_000, when, data, when, k).write(inner)
    for _ in range(rng.choice((0, 0, 0, 2000))):  # tiny records
        kind, size = rng.choice((3, 4, 5, 6, 7, 9, 12, 99)), rng.choice((0, 0, 22, 2**40, 2**64 - 1))
        inner.write(struct.pack("<BQ", kind, size))
    data, compression = inner.end(), rng.choice(("zstd", "lz4", "", "zstd", "lz4", "zstd", "xz"))
    for _ in range(rng.choice((1, 1, 3, 10))):
        body = packed(rng, compression if compression in PACK else "", data)
        size = rng.choice((len(data), len(data), 0, 2**63))
        Chunk(compression, body, 2**62, 0, rng.choice((0, 0, 0, 7)), size).write(outer)
    if rng.random() < 0.2:
        Attachment(0, 0, "a", "b", bytes(10)).write(outer)
        Metadata("a", {str(k): "b" for k in range(rng.choice((3, 10_000)))}).write(outer)
    Footer(rng.choice((0, 8, 8, 2**62)), 0, 0).write(outer)
    outer.write(b"\x89MCAP0\r\n")
    path.write_bytes(outer.end())


SCHEMAS = (
    "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c) "
    "SELECT n AS id, 1 AS topic_id, n AS timestamp, zeroblob(100) AS data FROM c",
    "DROP TABLE topics; CREATE VIEW topics AS SELECT 1 AS id, '/odom' AS name, 'a' AS type, randomblob(10) AS x",
    "CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM messages; END",
    "DROP TABLE messages; CREATE VIRTUAL TABLE messages USING fts4(id, topic_id, timestamp, data)",
    "ALTER TABLE messages RENAME TO m; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp, "
    "data AS (zeroblob(100000000))); INSERT INTO messages SELECT id, topic_id, timestamp FROM m",
    "ALTER TABLE messages RENAME TO m; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp); "
    "INSERT INTO messages SELECT id, topic_id, timestamp FROM m; "
    f"ALTER TABLE messages ADD COLUMN data DEFAULT x'{'00' * 40_000}'",
    "ALTER TABLE messages RENAME TO m; CREATE TABLE messages AS SELECT * FROM m",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE VIEW messages AS SELECT 1 AS id, "
    "1 AS topic_id, 1 AS timestamp, zeroblob(10) AS data' WHERE name = 'messages'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = 1",
    "CREATE INDEX i ON messages(topic_id, timestamp, data)",
    "UPDATE messages SET data = 'text' WHERE id % 2",
    "UPDATE messages SET timestamp = 'soon' WHERE id > 3",
    "UPDATE messages SET topic_id = 7 WHERE id > 3",
    "UPDATE topics SET name = x'00ff'",
    "UPDATE topics SET serialization_format = char(10, 27)",
    "UPDATE message_definitions SET encoded_message_definition = zeroblob(1000000)",
    "INSERT INTO topics SELECT id + 10, '/t' || id, 'a/msg/B', 'cdr', '', '' FROM messages",
    "".join(f"CREATE TABLE t{k}(a);" for k in range(3000)),
    "ALTER TABLE messages ADD COLUMN " + "; ALTER TABLE messages ADD COLUMN ".join(f"c{k}" for k in range(150)),
)


def sqlite_bag(rng: random.Random, path: Path) -> None:
    is_idl = rng.random() < 0.3
    name, text = idl_definition(rng) if is_idl else msg_definition(rng)
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.executescript(
            "PRAGMA journal_mode = OFF; PRAGMA page_size = 4096; BEGIN;"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
            "offered_qos_profiles TEXT, type_description_hash TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
            "encoded_message_definition TEXT, type_description_hash TEXT)"
        )
        database.execute("INSERT INTO topics VALUES(1, '/odom', ?, 'cdr', '', '')", (name,))
        encoding = "ros2idl" if is_idl else "ros2msg"
        if rng.random() < 0.9:
            database.execute("INSERT INTO message_definitions VALUES(1, ?, ?, ?, '')", (name, encoding, text))
        compressed = rng.random() < 0.3
        for k, (when, data) in enumerate(payloads(rng, b"\0\1\0\0")):
            data = packed(rng, "zstd", data) if compressed and k < 50 else data
            database.execute("INSERT INTO messages VALUES(?, 1, ?, ?)", (k + 1, when, data))
        if rng.random() < 0.5:
            with contextlib.suppress(sqlite3.Error):
                database.executescript(rng.choice(SCHEMAS))
        with contextlib.suppress(sqlite3.Error):
            database.execute("COMMIT")
    if rng.random() < 0.2:
        share_pages(rng, path)


def share_pages(rng: random.Random, path: Path) -> None:
    """Let all children of the inner pages of a database's trees be the same page, of which there are more levels."""
    data = bytearray(path.read_bytes())
    inner = [at for at in range(4096, len(data), 4096) if data[at] == 5]
    for at in inner:
        (count,) = struct.unpack_from(">H", data, at + 3)
        children = [struct.unpack_from(">H", data, at + 12 + 2 * k)[0] + at for k in range(count)]
        target = rng.choice((at // 4096 + 1, *(struct.unpack_from(">I", data, child)[0] for child in children)))
        for child in (*children, at + 8):
            if child + 4 <= len(data):
                struct.pack_into(">I", data, child, target)
    path.write_bytes(data)


def header(**fields: bytes) -> bytes:
    """Return the header of a record of a bag of ROS 1 with its length."""
    body = b"".join(struct.pack("<I", len(key) + 1 + len(v)) + key.encode() + b"=" + v for key, v in fields.items())
    return struct.pack("<I", len(body)) + body


def number(value: int, form: str = "<I") -> bytes:
    return struct.pack(form, value & (2 ** (8 * struct.calcsize(form)) - 1))


def ros1_bag(rng: random.Random, path: Path) -> None:
    name, text = msg_definition(rng)
    about = {"topic": b"/odom", "type": name.replace("/msg/", "/").encode(), "message_definition": text.encode()}
    connection = header(op=b"\7", conn=number(0), topic=b"/odom") + header(**about, md5sum=b"*")
    body, entries = BytesIO(), []
    for when, data in payloads(rng, b""):
        time = number(min(when // 10**9, 2**32 - 1)) + number(when % 10**9)
        entries.append(time + number(body.tell()))
        for _ in range(rng.choice((0, 0, 0, 1)) if len(entries) > 1 else rng.choice((1, 5000, 50_000))):
            body.write(connection[:200])
        connected = number(0 if rng.random() < 0.999 else 9)
        body.write(header(op=b"\2", conn=connected, time=time) + number(len(data)) + data)
    if rng.random() < 0.2:
        entries = [rng.choice(entries)] * rng.choice((10, 20_000))
    out = BytesIO()
    out.write(b"#ROSBAG V2.0\n")
    chunk_count = rng.choice((1, 1, 2, 8))
    out.write(header(op=b"\3", index_pos=number(0, "<Q"), conn_count=number(0), chunk_count=number(0)) + number(0))
    positions, content = [], body.getvalue()
    for _ in range(chunk_count):
        positions.append(out.tell())
        compression = rng.choice(("none", "bz2", "lz4", "none", "bz2", "lz4", "xz"))
        data = packed(rng, compression if compression in PACK else "", content)
        out.write(header(op=b"\5", compression=compression.encode(), size=number(len(content))))
        out.write(number(rng.choice((len(data),) * 12 + (2**32 - 1,))) + data)
        out.write(header(op=b"\4", ver=number(1), conn=number(0), count=number(len(entries))))
        out.write(number(12 * len(entries)) + b"".join(entries))
    index = out.tell()
    out.write(connection)
    repeats = rng.choice((1, 1, 1, 500))
    for position in positions * repeats:
        times = {"start_time": bytes(8), "end_time": bytes(8)}
        out.write(header(op=b"\6", ver=number(1), chunk_pos=number(position, "<Q"), **times, count=number(1)))
        out.write(number(8) + number(0) + number(len(entries)))
    out.seek(13)
    counts = {"conn_count": rng.choice((1,) * 12 + (2**32 - 1,)), "chunk_count": chunk_count * repeats}
    out.write(header(op=b"\3", index_pos=number(index, "<Q"), **{k: number(v) for k, v in counts.items()}) + number(0))
    path.write_bytes(out.getvalue())


BAGS = {".mcap": mcap_bag, ".db3": sqlite_bag, ".bag": ros1_bag}


def write_hostile_bag(seed: int, folder: Path) -> Path:
    """Write a hostile bag, of which some are cut or have damaged bytes; return its path."""
    rng = random.Random(seed)
    suffix = list(BAGS)[seed % 3]
    path = folder / f"bag{suffix}"
    BAGS[suffix](rng, path)
    data = bytearray(path.read_bytes())
    damage = rng.choice(("",) * 7 + ("cut", "bytes"))
    if damage == "cut":
        del data[rng.randrange(len(data)) :]
    for _ in range(rng.choice((1, 20, 500)) if damage == "bytes" else 0):
        data[rng.randrange(len(data))] = rng.choice((0, 1, 0x7F, 0xFF, rng.randrange(256)))
    path.write_bytes(data)
    (folder / "map.toml").write_text(rng.choice((MAP,) * 9 + (STAMPED,)))
    return path


def in_child(work: Callable[[], int]) -> tuple[int, resource.struct_rusage]:
    """Do work in a child, so that this process stays small; return how it ended, and what it used."""
    child = os.fork()
    if child == 0:
        status = 99
        try:
            status = work()
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else 98
        except BaseException:  # noqa: BLE001 - the child must end here
            traceback.print_exc()
        finally:
            os._exit(status)
    _, status, usage = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), usage


def write_in_child(seed: int, folder: Path) -> Path:
    """Write a hostile bag; return its path."""
    in_child(lambda: int(not (folder / "path").write_text(str(write_hostile_bag(seed, folder)))))
    return Path((folder / "path").read_text())


def import_in_child(path: Path, folder: Path) -> str:
    """Import a bag by the command line with limits; return what is wrong, "" for a run, or one line on stderr."""

    def work() -> int:
        for stream, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(folder / name, os.O_CREAT | os.O_WRONLY), stream)
        for limit, most in ((resource.RLIMIT_AS, ADDRESSES), (resource.RLIMIT_CPU, SECONDS)):
            resource.setrlimit(limit, (most, most))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
        signal.alarm(30 * SECONDS)
        from cosim.command_line.cli import main

        options = ["--vehicle", "bluerov2_heavy", "--map", str(folder / "map.toml"), "--no-report"]
        status = main(["import", str(path), *options, "--out", str(folder / "run")])
        sys.stdout.flush()
        sys.stderr.flush()
        return status

    status, usage = in_child(work)
    words = (folder / "stderr").read_text() if (folder / "stderr").exists() else ""
    lines = [line for line in words.splitlines() if line.strip()]
    if status not in (0, 2):
        return f"ended with {status}: {words[-300:]}"
    if "Traceback" in words or (status == 2 and len(lines) != 1) or len(words) > 2000:
        return f"said {words[-300:]!r}"
    if usage.ru_maxrss * 1024 > MEMORY:
        return f"took {usage.ru_maxrss * 1024} bytes"
    return "half a run" if status and (folder / "run").exists() else ""


def main() -> None:
    import shutil
    import tempfile

    import rosbags.rosbag1
    import rosbags.typesys  # noqa: F401 - what children share is imported once

    import cosim.command_line.cli
    import cosim.logs.importing  # noqa: F401

    for seed in range(int(sys.argv[2]), int(sys.argv[3])):
        folder = Path(tempfile.mkdtemp(dir=sys.argv[1]))
        fault = import_in_child(write_in_child(seed, folder), folder)
        sys.stdout.write(json.dumps({"seed": seed, "fault": fault}) + "\n")
        sys.stdout.flush()
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
