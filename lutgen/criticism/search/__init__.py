"""The search finds the effects, and their forms, that lower the error by more than chance does.

``candidates`` fits every form of one effect, ``stepwise`` admits and prunes effects, ``explanation`` is what a search
has found, ``free_term`` describes the residual that no effect explains. Each file here holds one way to propose, admit
or refuse an explanation.
"""
