"""Threads of tests, stopped at the end of each test."""

import ctypes


def ended(thread, seconds=120.0):
    """Wait for a thread and return whether it ended by itself; interrupt it otherwise."""
    thread.join(seconds)
    if not thread.is_alive():
        return True
    interrupt(thread, SystemExit)
    thread.join(120.0)
    return False


def interrupt(thread, error=KeyboardInterrupt):
    """Raise an error in a thread, as Ctrl-C does in the main one."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident), ctypes.py_object(error))
