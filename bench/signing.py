"""The share of a core that signing and verifying 1 000 CAMs a second takes.

First the signed bytes alone; then as the bus of a guarded city does it, with the hash of the body
as JSON and base64, beside what the same CAMs cost there unsigned. Processor time, so a busy
neighbour does not count. Limit: the bare signatures of the library.
"""

import statistics
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from scm.clock import NS_PER_S
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import cam_of
from scm.v2x.fleet_file import Fleet, add
from scm.v2x.message import decode, encode
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.signed_cams import SignedCams
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
    _print_city()


def _print_city() -> None:
    """Print the same on the bus, written to bytes and read again."""
    with TemporaryDirectory() as folder:
        fleet = Fleet(Path(folder) / "fleet.toml", "password")
        now = datetime.fromtimestamp(NOW / NS_PER_S, UTC)
        names = [f"n{i}" for i in range(STATIONS)]
        held = [add(fleet, name, "vehicle", now) for name in names]
    times = [NOW + i * NS_PER_S // 10 for i in range(A_SECOND // STATIONS)]
    cams = [CamTx(station=name, t_ns=t_ns, body=_body(t_ns)) for t_ns in times for name in names]
    sent: list[tuple[bytes, bytes | None]] = []

    def plain_write() -> None:
        sent[:] = [encode(cam) for cam in cams]

    def write() -> None:
        air = {one.station: SignedCams(one) for one in held}
        sent[:] = [encode(air[cam.station].signed(cam, cam.t_ns)) for cam in cams]

    def read(check: Callable[[CamTx, int], None]) -> None:
        for frame in sent:
            cam = decode(CamTx, *frame)
            check(cam, cam.t_ns)

    plain = _share(plain_write) + _share(lambda: read(lambda cam, t_ns: None))
    few = len(sent[0][0])
    writing = _share(write)
    reading = _share(lambda: read(SignedCams(held[0]).check))
    print(f"on the bus: {few} bytes plain, {len(sent[0][0])} with certificate, "
          f"{len(sent[-1][0])} with digest")  # fmt: skip
    print(f"plain   {100 * plain:6.1f} % to write and read")
    print(f"signed  {100 * writing:6.1f} % to write, {100 * reading:.1f} % to read")


def _body(t_ns: int) -> CamBody:
    state = VehicleState(
        vehicle="n1", t_ns=t_ns, seq=1, x_m=1.0, y_m=2.0, yaw_rad=0.5, speed_mps=0.3,
        yaw_rate_radps=0.1, steering_rad=0.1, throttle=0.2, source="model",
    )  # fmt: skip
    return cam_of(state, length_m=0.3, width_m=0.175, front_m=0.23)


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
