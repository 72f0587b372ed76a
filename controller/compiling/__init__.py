"""Plain functions of Python, run as C.

`function` calls one with arrays that it looks at once, `library` finds its C library: with the package, in the cache,
or compiled now; `compiler` is the compiler of this machine.

Imports: translator.
"""
