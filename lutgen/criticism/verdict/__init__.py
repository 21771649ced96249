"""The verdict: what the evidence of a search allows to say, and what these readings cannot show.

``pronounce`` decides, ``words`` writes the sentence; the other files answer one question each: whether the residual
is noise, which other effect a form could imitate, how small an effect these readings can show. A file here answers
one such question.
"""
