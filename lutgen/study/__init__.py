"""The reader study: who reads which image on which display, what they answered, and what that shows.

``protocol.json`` is frozen before the first answer and says everything that was decided; answers are kept one file a
reader. The design follows Avanaki et al. (SPIE 2015), section 2.3.
"""
