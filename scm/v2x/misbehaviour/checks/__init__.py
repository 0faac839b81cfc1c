"""One check a file, each with `CHECK`; the contract is `scm.v2x.misbehaviour.check`."""
