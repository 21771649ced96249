"""Noise of readings: covariance, tails, the estimate from repeated readings, and errors that a session shares.

``model`` holds the noise of one reading; the other files estimate its parts or add errors that several readings
share. A file here holds one part of the noise, with its estimate and its unit.
"""
