"""Translate the Python of laws to portable C.

`program` translates functions with all that they call into one C99 file without heap, `functions` one of them;
`statements`, `calls`, `subscripts`, `expressions` and `array_expressions` are the constructs, `operand_values`,
`array_views`, `array_lengths` and `function_code` what they use; `operands` and `types` are their parts. `arguments`
converts arrays and tuples to words, and `static_data` to data; `foreign` calls C by address, `generated` defines
functions from a text.

Imports: nothing.
"""
