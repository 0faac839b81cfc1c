"""One attack a file, each with `ATTACK`; the contract is `scm.traffic.misbehaviour.attack`."""
