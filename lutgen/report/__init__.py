"""Reports: the results of all other packages for people, in words, tables, pictures and one HTML page.

A file holds one subject: the page that its commands print and the picture that they draw; ``parts`` and ``drawing``
hold what pages and pictures are made of, ``page`` and ``templates`` the HTML page of ``lutgen report``. One more file
holds one more subject: functions that take a result, compute nothing that a program would want too, and yield the parts
of a page or write a PNG, the same bytes on every run.
"""
