"""The fit: weighted least squares in XYZ for effects, white and primaries, session gains and shared errors.

:class:`~lutgen.criticism.fit.problem.Problem` states the unknowns of the readings in ``data``, ``linear`` computes the
derivatives, ``system`` one Gauss-Newton step, ``least_squares`` the solution. Each file holds one stage of the
solution, or one statistic of a solution. The code calls white and primaries *tips*.
"""
