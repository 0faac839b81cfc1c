"""One check a file, each with `CHECK`; the contract is `scm.traffic.misbehaviour.check`."""
