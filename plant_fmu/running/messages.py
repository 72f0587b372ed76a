"""Messages of an FMU. Those of FMI 2.0 are formats with variable arguments, as for printf."""

from __future__ import annotations

import ctypes
import logging
import platform
import re
import struct
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from fmpy.fmi2 import defaultCallbacks as default_callbacks
from fmpy.fmi2 import fmi2CallbackFunctions

log = logging.getLogger(__name__)

WARNING = 1  # the highest status that is no failure, in FMI 2.0 and 3.0

_CONVERSION = re.compile(r"%([-+ #0]*)(\*|\d+)?(?:\.(\*|\d*))?(hh|h|ll|l|j|z|t|I64)?([diouxXeEfFgGcsp%])")
_BITS = {"hh": 8, "h": 16, "l": 8 * ctypes.sizeof(ctypes.c_long), **dict.fromkeys(("ll", "j", "z", "t", "I64"), 64)}
_STACK = 16  # number of words of the stack that are read as arguments
_FIRST_PAGE = 4096  # bytes, where no text is
_LONGEST = 4096  # maximum number of characters of an argument, of its width and of its precision

# Variable arguments after five of the logger, by calling convention: words that are no arguments, and the numbers of
# further words and of floating-point numbers in registers. The others follow on the stack, in order.
_IS_KNOWN = platform.machine().lower() in ("x86_64", "amd64", "aarch64", "arm64")
_APPLE_SILICON = sys.platform == "darwin" and platform.machine() == "arm64"
if sys.platform == "win32":
    _SKIPPED, _WORDS, _FLOATS = 0, 0, 0
elif platform.machine() in ("aarch64", "arm64"):
    _SKIPPED, _WORDS, _FLOATS = (3, 0, 0) if _APPLE_SILICON else (0, 3, 8)
else:
    _SKIPPED, _WORDS, _FLOATS = 0, 1, 8
_N_WORDS = _SKIPPED + _WORDS + _STACK
_LOGGER = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p,
    *[ctypes.c_uint64] * _N_WORDS, *[ctypes.c_double] * _FLOATS,
)  # fmt: skip


class Messages:
    """Messages of an FMU. The object has no reference to the instance, so that callbacks keep nothing alive."""

    def __init__(self) -> None:
        self._failures: deque[str] = deque(maxlen=4)
        self._warnings: deque[str] = deque(maxlen=1)

    def receive(self, status: int, message: bytes | None, arguments: Sequence[Any] = ()) -> None:
        """Log a message, and keep it if its status is a failure or a warning; the arguments are those of a format."""
        if status < WARNING and not log.isEnabledFor(logging.DEBUG):
            return
        text = (message or b"").decode("utf-8", "replace")
        if arguments:
            text = _format(text, arguments)
        log.debug("FMU: %s", text)
        if status >= WARNING and text.strip():
            (self._failures if status > WARNING else self._warnings).append(" ".join(text.split()))

    def take_failures(self) -> str:
        """Return the failures since the last call, else the last warning, and clear them; "" for none."""
        text = "; ".join(self._failures or self._warnings)
        self._failures.clear()
        self._warnings.clear()
        return text


def fmi2_callbacks(messages: Messages) -> fmi2CallbackFunctions:
    """Return the callbacks for an FMU of FMI 2.0."""

    # not through FMPy's logger proxy, which serves one instance in the whole process
    def receive(env: Any, name: bytes, status: int, category: bytes, message: bytes | None, *arguments: Any) -> None:
        messages.receive(status, message, arguments if _IS_KNOWN else ())

    callbacks = fmi2CallbackFunctions()
    callbacks.kept = _LOGGER(receive)
    callbacks.logger = ctypes.cast(callbacks.kept, type(callbacks.logger))
    callbacks.allocateMemory = default_callbacks.allocateMemory
    callbacks.freeMemory = default_callbacks.freeMemory
    return callbacks


def _format(text: str, arguments: Sequence[Any]) -> str:
    """Format a text as printf does; a conversion that is unknown, and all after it, stay as they are."""
    words, floats = list(arguments[_SKIPPED:_N_WORDS]), list(arguments[_N_WORDS:])
    registers, stack = words[:_WORDS], iter(words[_WORDS:])

    def next_word() -> int:
        return int(registers.pop(0) if registers else next(stack))

    def next_float() -> float:
        return float(floats.pop(0) if floats else struct.unpack("<d", struct.pack("<Q", next(stack)))[0])

    return "".join(_parts(text, next_word, next_float))


def _parts(text: str, next_word: Callable[[], int], next_float: Callable[[], float]) -> Iterator[str]:
    end = 0
    while (start := text.find("%", end)) >= 0:
        yield text[end:start]
        match = _CONVERSION.match(text, start)
        if match is None:
            end = start
            break
        flags, width, precision, size, kind = match.groups()
        try:
            if width == "*":
                width = str(_signed(next_word(), 32))
            if precision == "*":
                precision = str(_signed(next_word(), 32))
            length = None if precision is None or precision.startswith("-") else int(precision or 0)
            if max(abs(int(width or 0)), length or 0) > _LONGEST:
                raise ValueError("no format of a message")
            form = f"%{flags}{width or ''}{'' if length is None else f'.{length}'}"
            if kind == "%":
                yield "%"
            elif kind in "eEfFgG":
                yield f"{form}{kind}" % next_float()
            elif kind == "s":
                yield f"{form}s" % _string_at(next_word(), length)
            elif kind == "p":
                yield f"{next_word():#x}"
            elif kind in "di":
                yield f"{form}d" % _signed(next_word(), _BITS.get(size, 32))
            else:
                number = next_word() % 2 ** _BITS.get(size, 32)
                yield f"{form}{kind}" % (number % 256 if kind == "c" else number)
        except (StopIteration, ValueError, OverflowError):  # more arguments than are read, or no format
            end = start
            break
        end = match.end()
    yield text[end:]


def _signed(word: int, bits: int) -> int:
    word %= 2**bits
    return word - 2**bits if word >= 2 ** (bits - 1) else word


def _string_at(address: int, length: int | None) -> str:
    """Return the text at an address, up to its end or to a length; "(unknown)" where there is none."""
    if address < _FIRST_PAGE:
        return "(null)"
    size = _LONGEST if length is None else length
    try:
        with open("/proc/self/mem", "rb", buffering=0) as memory:  # an address that is none is an error here
            memory.seek(address)
            data = memory.read(size)
    except FileNotFoundError:  # no Linux
        data = ctypes.string_at(address) if length is None else _bytes_at(address, length)
    except (OSError, ValueError, OverflowError):  # the message was no format
        return "(unknown)"
    return data.partition(b"\0")[0].decode("utf-8", "replace")


def _bytes_at(address: int, length: int) -> bytes:
    """Return the bytes at an address, up to a zero or to a length."""
    data = bytearray()
    while len(data) < length and (byte := ctypes.c_ubyte.from_address(address + len(data)).value):
        data.append(byte)
    return bytes(data)
