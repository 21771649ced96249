"""The reader study: who reads which image on which display, the answers, and their analysis.

``protocol.json`` holds all decisions and is frozen before the first answer; answers are kept in one file for each
reader. The design and the tables follow Avanaki et al. (SPIE 2015), sections 2.3 and 3.2. One more file holds one step
of a study (plan, read, analyse), one thing that a study keeps, or one kind of statistics on its answers.
"""
