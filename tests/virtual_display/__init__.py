"""An independent simulated display with hidden effects. lutgen's diagnosis of the display is scored.

Nothing here imports lutgen, except ``score`` and ``__main__``, which run lutgen. The display is computed wavelength by
wavelength. Each effect exists in the catalogue's form and in another form. The second form tests a diagnosis that knows
only its own equations. ``campaign.csv_text`` writes one data set. ``sealed.make`` writes a folder of data sets under
random names, with the answers in a separate file.
"""
