"""Let lutgen diagnose campaigns of all generators and count its answers; only this folder imports lutgen.

``sources`` lists the generators, ``questions`` draws the hidden effects, ``strength`` computes how detectable they are,
``ask`` lets lutgen diagnose one campaign, ``figures`` counts, ``report`` prints. ``python -m tests.generators`` runs
all of them.
"""
