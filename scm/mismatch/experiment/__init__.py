"""The drive to do next: which one separates two explanations that a recording leaves undecided.

`pace` knows what the car and the floor allow, `manoeuvres` are the drives, `changed` changes the
experiment instead, `plan` simulates one under an explanation, `separation` computes how far
explanations differ, `suggest` chooses, `scenario` writes files for `scm play`.
"""
