"""Pages and pictures about images on an aged display: lifetimes, cohorts, maps, nuclei, sheets, animations, figures.

A page here yields what a command prints of an image, a picture shows the image or its ΔE2000. One more file holds one
page or one kind of picture; pixels and numbers come from :mod:`lutgen.pictures`.
"""
