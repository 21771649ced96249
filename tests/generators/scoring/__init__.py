"""Puts campaigns of all generators to lutgen and counts what it answers; only here is lutgen imported.

``sources`` finds the generators, ``questions`` draws what is hidden, ``strength`` says how well it shows, ``ask`` puts
one campaign to lutgen, ``figures`` counts, ``report`` prints. ``python -m tests.generators`` runs it all.
"""
