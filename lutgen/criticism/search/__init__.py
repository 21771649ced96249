"""The search: which effects, in which form, lower the error by more than chance.

``candidates`` fits every form of one effect, ``stepwise`` admits and prunes effects, ``free_term`` describes what no
effect explains. A file here holds one way to propose, to admit or to refuse an explanation.
"""
