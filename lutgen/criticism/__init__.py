"""Criticism of the model: compare it with measurements, diagnose missing effects, refine it, plan the next session.

Each file here is the task of one command, and returns a result that ``lutgen/report`` prints. The folders hold the
parts: ``noise`` and ``first_session`` (errors of the readings), ``fit`` (one set of effects), ``search`` (which
effects), ``verdict`` (what may be named), ``compare`` (where the model fails).
"""
