"""Shared libraries for FMUs.

Sources, compilers, platforms, and libraries that come prebuilt with the package.

Imports: contents, variables.
"""
