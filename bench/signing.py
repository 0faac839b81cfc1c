"""The share of a core that signing and verifying 1 000 CAMs a second takes.

Processor time, so a busy neighbour does not count. Limit: the bare signatures of the library.
"""

import statistics
import time
from collections.abc import Callable

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from scm.clock import NS_PER_S
from scm.v2x.signing import CAM, Signer, Verifier, issue, make_authority

A_SECOND = 1000
STATIONS = 100  # each sends 10 CAMs in it, the first with its certificate
REPEATS = 5
BAR = 0.25
NOW = 1_900_000_000 * NS_PER_S
CAM_BYTES = bytes(41)


def main() -> None:
    authority = make_authority("bench", NOW)
    tickets = [issue(authority, f"n{i}", NOW) for i in range(STATIONS)]
    signed: list[bytes] = []

    def sign() -> None:
        signers = [Signer(ticket) for ticket in tickets]
        signed[:] = [
            signer.sign(CAM_BYTES, CAM, NOW + i * NS_PER_S // 10)
            for i in range(A_SECOND // STATIONS)
            for signer in signers
        ]

    def verify() -> None:
        verifier = Verifier(authority.certificate)
        for data in signed:
            verifier.verify(data, NOW + NS_PER_S // 2)

    share = {"sign": _share(sign), "verify": _share(verify)}
    limit = _limit(tickets[0].key)
    total = sum(share.values())
    print(f"{A_SECOND} CAMs of {len(CAM_BYTES)} bytes: {len(signed[0])} with certificate, "
          f"{len(signed[-1])} with digest")  # fmt: skip
    for name, value in share.items():
        print(f"{name:<8}{100 * value:6.1f} % of a core")
    verdict = "kept" if total < BAR else "NOT KEPT"
    print(f"both    {100 * total:6.1f} % (bar {100 * BAR:.0f} %: {verdict})")
    print(f"limit   {100 * limit:6.1f} %: the library's bare signatures")


def _limit(key: ec.EllipticCurvePrivateKey) -> float:
    algorithm, public = ec.ECDSA(hashes.SHA256()), key.public_key()

    def bare() -> None:
        for _ in range(A_SECOND):
            public.verify(key.sign(CAM_BYTES, algorithm), CAM_BYTES, algorithm)

    return _share(bare)


def _share(work: Callable[[], None]) -> float:
    """Return the processor seconds of one second's work: the median of several."""
    took = []
    for _ in range(REPEATS):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return statistics.median(took)


if __name__ == "__main__":
    main()
