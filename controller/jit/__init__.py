"""All that rests on Numba's inner workings.

`jit` compiles functions and keeps them on disk, `function_pointer` calls them by address, `bound_call` binds a function
once to arrays whose numbers change, `stack_array` makes small arrays on the stack.

Imports: nothing.
"""
