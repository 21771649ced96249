"""Generators of simulated campaigns. They share no code with lutgen or with one another.

Each folder is one generator. Each generator is written from the catalogue of effects and from books. ``truth.py``
defines the object that a generator returns. The instruments (``meters.py``) and the ways to write a campaign to a file
(``rewritings``) apply to all generators.
"""
