"""Pictures of a display: how white and primaries age, and what one physical effect does to colours.

A picture here is one PNG page of several plots. One more file holds the page of one subject, with one function a plot
that draws into the axes that it is given; the numbers come from :mod:`lutgen.display`.
"""
