"""``lutgen explore``: one page on which a display ages, its error is explained, and its LUTs are downloaded.

The page is a face of the Python API, as the command line is: it draws, and computes nothing. A window of the page has
two processes: one shows pictures, one fits; a third makes the files to download. The picture comes first: its table is
sent with the page, and the fitting process starts when the page listens for news. One more file here must hold one part
of the way from the page's question, by the window's state, to a process and the library.
"""
