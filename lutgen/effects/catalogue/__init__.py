"""The built-in effects: one module for each effect, of the same name, with ``_`` for ``-``.

A module defines one function with the decorator :func:`lutgen.effects.effect`, which declares the effect's stage,
parameters, neutral values and forms. The docstring of the module gives the equation, the meaning of 0 and 1, the range
of validity and the sources; it is the effect's page in the reference.
"""
