"""The first session as a model of a real display: its colours, and the errors that later predictions inherit.

The baselines ``native`` and ``native-first-hour`` predict later sessions from the first one. A file here holds one
thing that the first session tells, or one kind of error that all predictions from the first session share.
"""
