"""``lutgen explore``: one page on which a display ages, its error is explained, and its LUTs are taken away.

The page is a face of the Python API, as the command line is: it draws, and computes nothing. A window of the page has
two processes: one shows pictures, one fits; a third makes what is taken away. The picture comes first: its table is on
its way with the page, and what fits begins when the page listens. One more file here must hold one part of that road:
from the page's question, by the window's state, to a process and the library.
"""
