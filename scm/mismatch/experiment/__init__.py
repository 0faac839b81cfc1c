"""The drive to do next: which one separates two explanations that a recording leaves undecided.

`manoeuvres` are the drives at the pace that car and floor allow, `plan` simulates one under an
explanation and computes how far explanations differ, `suggest` chooses a drive or a changed
experiment, `scenario` writes files for `scm play`.
"""
