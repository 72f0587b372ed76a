"""Python functions compiled to C: equal numbers, argument lifetime, and plain callables."""

import copy
import ctypes
import gc
import signal
import sys
import weakref
from typing import NamedTuple

import numpy as np
import pytest

from controller.compiling.function import INTERPRETED, BoundCall, CompiledFunction, c_text
from controller.errors import TranslationError
from controller.translator.foreign import INT, POINTER, call_c


@pytest.fixture(autouse=True)
def runs_compiled(monkeypatch):
    """Bind calls to C even where all else is interpreted, as for mutants."""
    monkeypatch.delenv(INTERPRETED, raising=False)


class Pair(NamedTuple):
    first: np.ndarray
    factor: float


def scale(pair, count, out):
    for i in range(out.size):
        out[i] = pair.factor * pair.first[i] + count


def read(references, out):
    for i in range(out.size):
        out[i] = references[i]


def call_twice(address, words):
    call_c(address, (POINTER,), words)
    call_c(address, (POINTER,), words)


def interrupt_and_call(raise_signal, number, address, words):
    call_c(raise_signal, (INT,), number)
    call_twice(address, words)


def grow(out):
    out[0] += 1.0


def recursive(out):
    recursive(out)


class TestOneFunction:
    def test_compiled_results_equal_python_results(self):
        first, out = np.array([0.1, -3.0, np.inf]), np.empty(3)
        CompiledFunction(scale)(Pair(first, 0.3), 2, out)
        expected = np.empty(3)
        scale(Pair(first, 0.3), 2, expected)
        assert out.tobytes() == expected.tobytes()

    def test_array_contents_and_arguments_may_change_between_calls(self):
        function, first, out, other = CompiledFunction(scale), np.ones(2), np.empty(2), np.empty(1)
        pair = Pair(first, 2.0)
        for value in (1.0, 5.0):
            first[:] = value
            function(pair, 0, out)
            assert out.tolist() == [2.0 * value] * 2
            function(Pair(first, -1.0), 1, other)
            assert other.tolist() == [1.0 - value]
        for count in range(20):  # more sets of arguments than are kept
            function(pair, count + 1000, out)
            assert out.tolist() == [1010.0 + count] * 2

    def test_unsigned_references_of_32_bits_are_read(self):
        out = np.empty(2)
        CompiledFunction(read)(np.array([7, 2**32 - 1], dtype=np.uint32), out)
        assert out.tolist() == [7.0, 2.0**32 - 1.0]

    def test_a_strided_array_and_an_object_are_refused(self):
        with pytest.raises(TypeError, match="contiguous"):
            CompiledFunction(grow)(np.zeros(6)[::2])
        with pytest.raises(TypeError, match="argument is dict"):
            CompiledFunction(grow)({})

    def test_unsupported_constructs_are_rejected_with_their_line(self):
        with pytest.raises(TranslationError, match=r"recursive calls itself"):
            CompiledFunction(recursive)(np.zeros(1))
        with pytest.raises(TypeError, match="without arguments"):
            CompiledFunction(grow)(None)

    def test_copied_function_is_independent(self):
        function, out = CompiledFunction(grow), np.zeros(1)
        function(out)
        copy.deepcopy(function)(out)
        assert out[0] == 2.0

    def test_c_text_defines_the_entry_function(self):
        assert "void entry(const void *words)" in c_text(grow, (np.zeros(1),))


class TestBoundCalls:
    def test_bound_call_keeps_its_arguments_alive(self):
        out = np.zeros(1)
        call = BoundCall(scale, (Pair(np.array([4.0]), 0.5), 1, out)).call
        gc.collect()
        call()
        assert out[0] == 3.0

    def test_bound_call_releases_its_arguments(self):
        out = np.zeros(1)
        bound, gone = BoundCall(grow, (out,)), weakref.ref(out)
        del out
        assert gone() is not None
        del bound
        gc.collect()
        assert gone() is None

    def test_another_c_function_calls_it_by_its_address(self):
        out = np.zeros(1)
        bound = BoundCall(grow, (out,))
        BoundCall(call_twice, (bound.address, bound.words)).call()
        call_twice(bound.address, bound.words)
        assert out[0] == 4.0

    def test_callable_objects_are_called_through_c(self):
        class Grow:
            def __call__(self, out):
                out[0] += 1.0
                if out[0] > 2.5:
                    raise KeyError("too many")

        out = np.zeros(1)
        bound = BoundCall(Grow(), (out,))
        bound.call()
        BoundCall(call_twice, (bound.address, bound.words)).call()
        assert out[0] == 3.0
        with pytest.raises(KeyError, match="too many"):
            bound.raise_error()
        bound.raise_error()  # once

    @pytest.mark.skipif(sys.platform == "win32", reason="its C library has another name")
    def test_a_signal_during_c_ends_the_call_that_follows(self):
        class Grow:
            def __call__(self, out):
                out[0] += 1.0

        out = np.zeros(1)
        bound, ended = BoundCall(Grow(), (out,)), []
        bound.on_error = lambda: ended.append(out[0])
        raise_signal = ctypes.cast(ctypes.PyDLL(None)["raise"], ctypes.c_void_p).value
        interrupted = BoundCall(interrupt_and_call, (raise_signal, int(signal.SIGINT), bound.address, bound.words))
        for _ in range(3):
            interrupted.call()
            with pytest.raises(KeyboardInterrupt):
                bound.raise_error()
        assert ended == [0.0] * 3

    def test_interpreted_mode_runs_everything_in_python(self, monkeypatch):
        monkeypatch.setenv(INTERPRETED, "1")
        monkeypatch.setenv("CC", "/nowhere")
        seen, out = [], np.zeros(1)

        def note(out):
            seen.append(1)

        CompiledFunction(note)(out)
        bound = BoundCall(note, (out,))
        BoundCall(call_twice, (bound.address, bound.words)).call()
        assert len(seen) == 3
