"""Command line: ``python -m fuzzy_arbiter {show,eval,explain,verify,convert,plot,bench} FILE``."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

try:
    from fuzzy_arbiter.arbiter import Arbiter
    from fuzzy_arbiter.command_line.definitions import BUILT_IN, convert, describe, load_system, require_suffix
    from fuzzy_arbiter.command_line.drawing import IMAGES, PICTURES, draw, image, middles
    from fuzzy_arbiter.command_line.evaluation import evaluate, evaluate_table, parse_sample
    from fuzzy_arbiter.engines import ENGINES
    from fuzzy_arbiter.errors import ArbiterError, InputError, one_line
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
    parser.add_argument("--version", action="version", version=f"fuzzy_arbiter {_version()}")
    verbs = parser.add_subparsers(dest="verb", required=True)

    def verb(run: Callable[[argparse.Namespace], int | None], what: str, *options: str) -> Any:
        name = run.__name__.removeprefix("_")
        added = verbs.add_parser(name, help=what, description=f"{what[0].upper()}{what[1:]}.")
        added.set_defaults(run=run)
        added.add_argument("file", metavar="FILE", help=f"a definition, or {BUILT_IN}")
        added.add_argument("--block", metavar="NAME", help="which FUNCTION_BLOCK of a FCL file that has several")
        if "engine" in options:
            known = f"{', '.join(ENGINES)} (default: %(default)s)"
            added.add_argument("--engine", choices=ENGINES, default="auto", metavar="NAME", help=known)
        if "values" in options:
            help = "name=value for each input, or values in their order"
            added.add_argument("values", nargs="*", metavar="VALUE", help=help)
        if "json" in options:
            added.add_argument("--json", action="store_true", help="JSON in the place of text")
        return added.add_argument

    verb(_show, "variables, terms, rules, norms, and which engine evaluates them", "engine")
    add = verb(_eval, "outputs for one sample, or for each row of a table", "engine", "values", "json")
    table = "table whose first line names the inputs, - for standard input; others are ignored"
    add("--csv", metavar="FILE", help=table)
    add("--out", metavar="FILE", help="file to write (default: standard output)")
    verb(_explain, "which rules fire for a sample, how strongly, and which decide", "engine", "values", "json")
    add = verb(_verify, "whether the rules leave no gap; exit status 1 if they do", "json")
    add("--as-criteria", action="store_true", default=None, help="check also that no two rules contradict each other")

    add = verb(_convert, "write a definition in another format, or as source code")
    add("out", metavar="OUT", help=".json, .toml, .fcl, .fis, .fll, or .c, .py for code that evaluates it")
    add("--native", action="store_true", help="fold the normalization of criteria into the universe")

    add = verb(
        _plot, "draw terms, rules at a sample, outputs over inputs, or which output is the greatest where", "engine"
    )
    add("kind", choices=PICTURES, metavar="PICTURE", help=", ".join(PICTURES))
    along = "along which; given twice for surface and decisions (default: the first; for terms all)"
    add("--input", action="append", default=[], metavar="NAME", help=along)
    add("--output", action="append", default=[], metavar="NAME", help="of which (default: the first; for terms all)")
    at = "the sample of rules, places in terms, else the other inputs (default: the middle of each)"
    add("--at", nargs="+", action="extend", default=[], metavar="NAME=VALUE", help=at)
    add("--relief", action="store_true", help="surface in three dimensions")
    add("--out", required=True, metavar="FILE", help=".png, .svg or .pdf")

    verb(_bench, "time every engine on this definition, in a few seconds")
    return parser


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("fuzzy-arbiter")
    except metadata.PackageNotFoundError:
        return "of a folder that is not installed"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    if sys.stdout is None:  # closed by the parent process: the next file that is opened would take its place
        print_error("standard output is closed; expected it open, such as on /dev/null")
        return FAULT
    try:
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_: print_error(str(message))
                options = parse(arguments)
                return options.run(options) or 0
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        _discard_output()
        return NO_READER
    except ArbiterError as error:
        print_error(str(error))
    except ImportError as error:
        print_error(f"{error.name} is not installed")
    except OSError as error:  # for example a full disk behind the output
        _discard_output()
        print_error(f"{error.filename or 'standard output'}: {error.strerror or error}")
    except KeyboardInterrupt:
        print_error("interrupted")
        return INTERRUPTED
    return FAULT


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse the arguments, and allow negative numbers and values after options."""
    parser = _parser()
    options, rest = parser.parse_known_args(arguments)
    for word in rest:
        if not hasattr(options, "values") or (word.startswith("-") and not _is_number(word)):
            parser.error(f"unknown argument {word!r}")
        options.values.append(word)
    return options


def _is_number(word: str) -> bool:
    with contextlib.suppress(ValueError):
        float(word)
        return True
    return False


def _discard_output() -> None:
    """Redirect standard output to the null device, else the interpreter fails again as it flushes at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_error(message: str) -> None:
    """Print one line on standard error; nothing where that is closed or gone."""
    if sys.stderr is not None:  # else `print` would take standard output
        with contextlib.suppress(OSError):
            print(f"fuzzy_arbiter: {one_line(message)}", file=sys.stderr, flush=True)


def _arbiter(options: argparse.Namespace) -> Arbiter:
    return Arbiter(load_system(options.file, options.block), engine=options.engine)


def _show(options: argparse.Namespace) -> None:
    print(describe(_arbiter(options)))


def _eval(options: argparse.Namespace) -> None:
    if options.csv is not None and options.values:
        raise InputError(f"got {options.values[0]!r} with --csv, expected one of the two")
    arbiter = _arbiter(options)
    if options.csv is None:
        text = evaluate(arbiter, parse_sample(options.values, arbiter.system), options.json)
    else:
        text = evaluate_table(arbiter, options.csv, sys.stdin, options.json)
    if options.out is None:
        print(text)
    else:
        write_atomic(options.out, f"{text}\n".encode())


def _explain(options: argparse.Namespace) -> None:
    arbiter = _arbiter(options)
    _print(arbiter.explain(parse_sample(options.values, arbiter.system)), options.json)


def _verify(options: argparse.Namespace) -> int:
    report = Arbiter(load_system(options.file, options.block)).verify(options.as_criteria)
    _print(report, options.json)
    return 0 if report.ok else FINDINGS


def _print(result: Any, as_json: bool) -> None:
    print(json.dumps(result.as_dict(), indent=2, ensure_ascii=False) if as_json else result)


def _convert(options: argparse.Namespace) -> None:
    convert(options.file, options.out, options.native, options.block)
    print(options.out)


def _plot(options: argparse.Namespace) -> None:
    suffix, arbiter = require_suffix(options.out, IMAGES), _arbiter(options)
    assumed = middles(options.at, arbiter.system) if options.kind == "rules" else []
    figure = draw(arbiter, options.kind, options.input, options.output, [*options.at, *assumed], options.relief)
    write_atomic(options.out, image(figure, suffix))
    if assumed:
        print_error(f"drawn at the middle of each input that --at leaves out: {' '.join(assumed)}")
    print(options.out)


def _bench(options: argparse.Namespace) -> None:
    from fuzzy_arbiter.command_line.bench import bench

    print(bench(load_system(options.file, options.block)))


if __name__ == "__main__":
    sys.exit(main())
