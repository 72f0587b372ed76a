"""Run plain Python functions as C.

`function` calls one with arrays that it validates once, `library` finds its C library: in the package, in the cache,
or compiled now; `compiler` is the compiler of this machine.

Imports: translator.
"""
