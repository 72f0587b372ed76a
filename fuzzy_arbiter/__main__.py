"""Command line: ``python -m fuzzy_arbiter {show,eval,explain,verify,convert,plot,bench} FILE``."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any, NoReturn

try:
    from fuzzy_arbiter.arbiter import Arbiter
    from fuzzy_arbiter.command_line.definitions import BUILT_IN, convert, described, load_system, require_suffix
    from fuzzy_arbiter.command_line.drawing import IMAGES, PICTURES, draw, image, middles
    from fuzzy_arbiter.command_line.evaluation import evaluated, evaluated_table, sample
    from fuzzy_arbiter.engines import ENGINES
    from fuzzy_arbiter.errors import ArbiterError, InputError, one_line
    from fuzzy_arbiter.explanation import Explanation
    from fuzzy_arbiter.files import write_atomic
except ModuleNotFoundError as error:  # in a checkout that is not installed
    print(f"fuzzy_arbiter: {error.name} is not installed, expected what pyproject.toml requires", file=sys.stderr)
    sys.exit(2)

FINDINGS, FAULT, INTERRUPTED, NO_READER = 1, 2, 130, 141

_EPILOG = """FILE is of JSON, TOML, FCL, FIS or FLL, by its suffix, or the word section-vi: the paper's arbiter
of obstacle, shape and depth.

examples:
  python -m fuzzy_arbiter show tipping.fis
  python -m fuzzy_arbiter eval tipping.fis service=9.8 food=6.5
  python -m fuzzy_arbiter eval arbiter.toml --csv day.csv --out results.csv
  python -m fuzzy_arbiter explain section-vi 0.75 1 0
  python -m fuzzy_arbiter verify arbiter.fis || echo "see what it found"
  python -m fuzzy_arbiter convert section-vi arbiter.fis --native
  python -m fuzzy_arbiter plot section-vi decisions --input obstacle --input shape --at depth=0.4 --out who.svg
"""


class _Version(argparse.Action):
    """Print the version, which takes a while to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib import metadata

        try:
            version = metadata.version("fuzzy-arbiter")
        except metadata.PackageNotFoundError:
            version = "of a folder that is not installed"
        print(f"fuzzy_arbiter {version}")
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """Report a wrong option in one line, as all other errors."""

    def print_help(self, file: Any = None) -> None:
        """Print it; argparse itself would pass over output that fails."""
        print(self.format_help(), end="", file=file)

    def error(self, message: str) -> NoReturn:
        verb = self.prog.removeprefix("python -m fuzzy_arbiter").strip()
        self.exit(FAULT, f"fuzzy_arbiter: {verb + ': ' if verb else ''}{one_line(message)}; see --help\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="python -m fuzzy_arbiter",
        description="Evaluate, explain, verify, convert and draw fuzzy systems.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    verbs = parser.add_subparsers(dest="verb", required=True)

    def verb(name: str, what: str, *, engine: bool = True, values: bool = False, as_json: bool = False) -> Any:
        added = verbs.add_parser(name, help=what, description=f"{what[0].upper()}{what[1:]}.")
        added.add_argument("file", metavar="FILE", help=f"a definition, or {BUILT_IN}")
        added.add_argument("--block", metavar="NAME", help="which FUNCTION_BLOCK of a FCL file that has several")
        if engine:
            known = f"{', '.join(ENGINES)} (default: %(default)s)"
            added.add_argument("--engine", choices=ENGINES, default="auto", metavar="NAME", help=known)
        if values:
            help = "name=value for each input, or values in their order"
            added.add_argument("values", nargs="*", metavar="VALUE", help=help)
        if as_json:
            added.add_argument("--json", action="store_true", help="JSON in the place of text")
        return added

    verb("show", "variables, terms, rules, norms, and which engine evaluates them")
    what = "outputs for one sample, or for each row of a table"
    add = verb("eval", what, values=True, as_json=True).add_argument
    table = "table whose first line names the inputs, - for standard input; others are ignored"
    add("--csv", metavar="FILE", help=table)
    add("--out", metavar="FILE", help="file to write (default: standard output)")
    verb("explain", "which rules fire for a sample, how strongly, and which decide", values=True, as_json=True)
    what = "whether the rules leave no gap; exit status 1 if they do"
    add = verb("verify", what, engine=False, as_json=True).add_argument
    add("--as-criteria", action="store_true", default=None, help="check also that no two rules contradict each other")

    add = verb("convert", "write a definition in another format, or as source code", engine=False).add_argument
    add("out", metavar="OUT", help=".json, .toml, .fcl, .fis, .fll, or .c, .py for code that evaluates it")
    add("--native", action="store_true", help="fold the normalization of criteria into the universe")

    what = "draw terms, rules at a sample, outputs over inputs, or which output is the greatest where"
    add = verb("plot", what).add_argument
    add("kind", choices=PICTURES, metavar="PICTURE", help=", ".join(PICTURES))
    along = "along which; given twice for surface and decisions (default: the first; for terms all)"
    add("--input", action="append", default=[], metavar="NAME", help=along)
    add("--output", action="append", default=[], metavar="NAME", help="of which (default: the first; for terms all)")
    at = "the sample of rules, places in terms, else the other inputs (default: the middle of each)"
    add("--at", nargs="+", action="extend", default=[], metavar="NAME=VALUE", help=at)
    add("--relief", action="store_true", help="surface in three dimensions")
    add("--out", required=True, metavar="FILE", help=".png, .svg or .pdf")

    verb("bench", "time every engine on this definition, in a few seconds", engine=False)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    if sys.stdout is None:  # closed by the parent process: the next file that is opened would take its place
        return _fault("standard output is closed; expected it open, such as on /dev/null")
    try:
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_: _report(str(message))
                return _run(_parsed(arguments))
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()
        return NO_READER
    except ArbiterError as error:
        return _fault(str(error))
    except ImportError as error:
        return _fault(f"{error.name} is not installed")
    except OSError as error:  # for example a full disk behind the output
        _drop_output()
        return _fault(f"{error.filename or 'standard output'}: {error.strerror or error}")
    except KeyboardInterrupt:
        _fault("interrupted")
        return INTERRUPTED


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse, and allow negative numbers and values after options."""
    parser = _parser()
    options, rest = parser.parse_known_args(arguments)
    for word in rest:
        if not hasattr(options, "values") or (word.startswith("-") and not _is_number(word)):
            parser.error(f"unknown argument {word!r}")
        options.values.append(word)
    return options


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _drop_output() -> None:
    """Redirect standard output to the null device, else the interpreter fails again as it flushes at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _report(what: str) -> None:
    """Print one line on standard error; nothing where that is closed or gone."""
    if sys.stderr is not None:  # else `print` would take standard output
        with contextlib.suppress(OSError):
            print(f"fuzzy_arbiter: {one_line(what)}", file=sys.stderr, flush=True)


def _fault(what: str) -> int:
    _report(what)
    return FAULT


def _run(options: argparse.Namespace) -> int:
    if options.verb == "convert":
        convert(options.file, options.out, options.native, options.block)
        print(options.out)
        return 0
    suffix = require_suffix(options.out, IMAGES) if options.verb == "plot" else ""
    system = load_system(options.file, options.block)
    if options.verb == "bench":
        from fuzzy_arbiter.command_line.bench import bench

        print(bench(system))
        return 0
    arbiter = Arbiter(system, engine=getattr(options, "engine", "auto"))
    if options.verb in ("verify", "explain"):
        explains = options.verb == "explain"
        result = arbiter.explain(sample(options.values, system)) if explains else arbiter.verify(options.as_criteria)
        print(json.dumps(result.as_dict(), indent=2, ensure_ascii=False) if options.json else result)
        return 0 if isinstance(result, Explanation) or result.ok else FINDINGS
    if options.verb == "show":
        print(described(arbiter))
    elif options.verb == "plot":
        assumed = middles(options.at, system) if options.kind == "rules" else []
        figure = draw(arbiter, options.kind, options.input, options.output, [*options.at, *assumed], options.relief)
        write_atomic(options.out, image(figure, suffix))
        if assumed:
            _report(f"drawn at the middle of each input that --at leaves out: {' '.join(assumed)}")
        print(options.out)
    else:
        _evaluate(arbiter, options)
    return 0


def _evaluate(arbiter: Arbiter, options: argparse.Namespace) -> None:
    if options.csv is not None and options.values:
        raise InputError(f"got {options.values[0]!r} with --csv, expected one of the two")
    if options.csv is None:
        text = evaluated(arbiter, sample(options.values, arbiter.system), options.json)
    else:
        text = evaluated_table(arbiter, options.csv, sys.stdin, options.json)
    if options.out is None:
        print(text)
    else:
        write_atomic(options.out, f"{text}\n".encode())


if __name__ == "__main__":
    sys.exit(main())
