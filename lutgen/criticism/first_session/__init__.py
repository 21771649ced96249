"""The first session as a model of a real display: its colours, and its errors, which propagate to later predictions.

The baselines ``native`` and ``native-first-hour`` predict later sessions from the first one. Each file holds one kind
of information from the first session, or one kind of error that all predictions from the first session share.
"""
