"""Pages and pictures about a model held against readings: compare, diagnose, refine, plan.

A page here yields what one of these commands prints, a picture shows one aspect of the same result. One more file holds
one page or one picture; the numbers come from :mod:`lutgen.criticism`.
"""
