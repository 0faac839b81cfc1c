"""Fits hypotheses to recordings: rollouts, weighed residuals and a Gauss-Newton solver."""
