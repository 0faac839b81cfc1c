"""One attack a file, each with `ATTACK`; the contract is `scm.v2x.misbehaviour.attack`."""
