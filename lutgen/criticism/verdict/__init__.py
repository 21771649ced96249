"""The verdict: the finding that the evidence of a search supports, and the effects that these readings cannot show.

``pronounce`` decides, ``words`` writes the sentence. Each other file answers one question on which the decision rests:
whether the readings need an effect, which other effect a form could imitate, how small an effect they can show.
"""
