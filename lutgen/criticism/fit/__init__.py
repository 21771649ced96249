"""The fit: weighted least squares for effects, white and primaries, session gains and shared errors, in XYZ.

:class:`~lutgen.criticism.fit.problem.Problem` is the question, ``linear`` its derivatives, ``system`` one Gauss-
Newton step, ``least_squares`` the solution. A file here holds one stage of the solution, or one figure that is read
off a solution.
"""
