"""A translator of the Python in which laws are written to portable C.

`program` translates functions with all that they
call into one C99 file without heap, `functions` one of them; `statements`, `expressions`, `subscripts` and `calls` are
the constructs, `operands` and `types` what they are made of; `arguments` makes words of arrays and tuples, and
`static_data` makes data of them; `foreign` calls C by address, `generated` defines functions of a text.

Imports: nothing.
"""
