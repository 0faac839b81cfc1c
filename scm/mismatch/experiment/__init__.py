"""The next drive: what to do with the car so that rival explanations come apart.

`pace` knows what the car and the floor allow, `manoeuvres` are the drives, `changed` changes the
experiment instead, `plan` simulates one under a rival, `separation` says how far rivals come apart,
`suggest` chooses and says it, `scenario` writes it, in one of `folders`, for `scm play`.
"""
