"""Noise of readings: covariance, tails, the estimate from replicates, and errors that the readings of a session share.

``model`` holds the noise of one reading; the other files estimate parts of this noise, or add errors that several
readings share. Each file holds one part of the noise, with its estimate and its unit.
"""
