"""The page of ``lutgen report``: one HTML file that needs nothing else, with its style, its script and its pictures."""
