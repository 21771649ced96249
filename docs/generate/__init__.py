"""Write docs/reference from the code: commands, Python API, effects, JSON.

``python -m docs.generate`` writes the pages, which are in the repository. tests/test_reference.py fails if they are
stale. Each module writes one kind of page and has a function ``pages()``, which returns paths below docs/reference and
their texts.
"""
