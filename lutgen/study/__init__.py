"""The reader study: which reader reads which image as which display shows it, the answers, and their analysis.

``protocol.json`` holds all decisions and is frozen before the first answer; answers are kept in one file for each
reader. The design follows Avanaki et al. (SPIE 2015), section 2.3. One more file holds one step of a study
(plan, read, analyse) or one thing that a study keeps.
"""
