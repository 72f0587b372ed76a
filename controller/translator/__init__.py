"""Translate the Python of laws to portable C.

`program` translates functions with all that they call into one C99 file without heap, `functions` one of them;
`statements`, `expressions`, `subscripts`, `calls`, `array_expressions` and `array_views` are the constructs, `operands`
and `types` their parts; `arguments` converts arrays and tuples to words, and `static_data` to data; `foreign` calls C
by address, `generated` defines functions from a text.

Imports: nothing.
"""
