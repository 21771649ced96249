"""The page of ``lutgen report``: one HTML file that needs nothing else, with its style, its script and its pictures.

Each module turns results into the values of one part of the page; the HTML itself stands in ``report/templates``. One
more file holds the values of one more section; it writes no markup, since the templates escape all that they are given.
"""
