"""Reports: the results of all other packages as sentences, tables, pictures and one HTML page.

Each file holds one subject: the page that its commands print, and the picture that they draw. ``parts`` and ``drawing``
hold the elements of pages and pictures; ``page`` and ``templates`` hold the HTML page of ``lutgen report``. The
functions of a subject take a result, and yield the parts of a page or write a PNG with the same bytes on every run.
They compute no numbers that a program may need: these belong to the result.
"""
