"""``lutgen explore``: one page that shows how a display ages, explains the model's error, and offers LUTs to download.

The page is an interface to the Python API, as the command line is: it draws, and computes nothing. A window of the page
has two processes: one computes pictures, one fits. Another process makes the files to download. The picture comes
first: its table is sent with the page, and the fitting process starts when the page listens for events. Each file of
this package holds one step of the path from a request of the page, through the window's state, to a process and the
library.
"""
