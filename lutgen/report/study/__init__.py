"""Pages and pictures about a reader study: its plan, its power, who has read what, and the analysis of the answers.

A page here yields what one ``lutgen study`` command prints. One more file holds one page or one picture; the numbers
come from :mod:`lutgen.study`.
"""
