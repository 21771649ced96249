"""Reports: what the results of every other package say to people, in words, tables, pictures and one HTML page.

Each folder holds one subject; ``drawing`` holds what all pictures share, ``templates`` the HTML. One more file holds
the page or the picture of one result: a function that takes the result, computes nothing that a program would want too,
and yields the parts of a page or writes a PNG, the same bytes on every run.
"""
