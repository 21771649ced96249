"""An independent spectral display with hidden faults, against which lutgen's diagnosis is scored.

Nothing here imports lutgen, except ``score`` and ``__main__``, which put the question to it. The display is told
wavelength by wavelength, and each fault exists in the catalogue's form and in another one, so that a diagnosis that
only knows its own equations is found out. ``campaign.csv_text`` writes one data set, ``sealed.make`` a folder of
them under random names, with the answers apart.
"""
