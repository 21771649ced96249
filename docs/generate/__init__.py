"""Writes docs/reference from the code: commands, Python API, effects, JSON.

``python -m docs.generate`` writes the pages, which the repository keeps; tests/test_reference.py says when they are
stale. One module a kind of page, each with a function ``pages()`` from a path below docs/reference to its text.
"""
