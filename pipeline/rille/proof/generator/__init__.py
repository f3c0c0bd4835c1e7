"""The independent generator: recordings of machines, with no physics in common with the solver.

Bodies and joints are MuJoCo's, soil is integrated by adaptive quadrature, the equations of motion are integrated by methods and with
steps of their own. Only values (``rille.model``, ``rille.proof.machine``) are shared with the rest of rille.
"""
