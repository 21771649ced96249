"""Pages and pictures about the sessions of one display: inspect, explain, trend.

A page here yields what one of these commands prints, the plot beside it shows the same result. One more file holds one
page or one picture; the numbers come from :mod:`lutgen.history`.
"""
