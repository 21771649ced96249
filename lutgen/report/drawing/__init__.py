"""What the pictures of all subjects share: the figure with its title and foot, the grey page, the PNG file.

Nothing here knows a subject: a module offers canvases, colours and files to the plots of the other folders. One more
file holds one such means, and writes the same bytes on every run.
"""
