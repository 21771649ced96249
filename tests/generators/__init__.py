"""Generators of simulated campaigns that share no code with lutgen or with one another.

Each folder is one generator, written from the catalogue of effects and from books; ``truth.py`` is what a generator
hands over. Instruments (``meters.py``) and ways of writing a campaign down (``rewritings.py``) apply to all of them.
"""
