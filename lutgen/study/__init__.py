"""The reader study: its plan (who reads which image on which display), the answers, and their analysis.

``protocol.json`` holds all decisions and is frozen before the first answer. Answers are stored in one file for each
reader. The design and the tables follow Avanaki et al. (SPIE 2015), sections 2.3 and 3.2. Each file of this package
holds one step of a study (plan, read, analyse), one kind of stored data, or one kind of statistics on the answers.
"""
