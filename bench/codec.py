"""ETSI messages to bytes and back: JSON, UPER by pycrate, UPER by asn1tools as the peer."""

import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import msgspec

ROUNDS = 300


def main() -> None:
    """Print microseconds a message, one of each kind as a small city says it."""
    sys.path.insert(0, str(Path(__file__).parent.parent))
    from tests.unit.v2x.etsi_city import city_messages

    print(f"{'':8}{'JSON':>14}{'bytes':>7}{'UPER':>18}{'bytes':>7}{'asn1tools':>18}{'ratio':>12}")
    for kind, published in city_messages().items():
        longest = max(
            (one.body for one in published), key=lambda one: len(msgspec.json.encode(one))
        )
        print(_line(kind, longest), flush=True)
    print("\nmicroseconds to encode / to decode, the best of three; ratio: ours over asn1tools'.")
    print("Ours also turns records into ASN.1 values and back; asn1tools gets and gives values.")


def _line(kind: str, body: Any) -> str:
    import asn1tools

    from scm.v2x.uper import codec
    from tests.unit.v2x.asn1_text import for_asn1tools, module_of

    text, reader = msgspec.json.encode(body), msgspec.json.Decoder(type(body))
    line = f"{kind:8}{_pair(lambda: msgspec.json.encode(body), lambda: reader.decode(text))}"
    line += f"{len(text):7}"
    coding = codec.CODINGS.get(kind)
    if coding is None:
        return f"{line}   no UPER: pycrate has no ASN.1 of it"
    data = codec.encode(body)
    ours = _times(lambda: codec.encode(body), lambda: codec.decode(kind, data))
    peer = asn1tools.compile_string(module_of(coding.pdu, codec.pdu_of(kind)), "uper")
    value = for_asn1tools(coding.to_asn(body))
    theirs = _times(lambda: peer.encode(coding.pdu, value), lambda: peer.decode(coding.pdu, data))
    ratios = " ".join(f"{a / b:.1f}" for a, b in zip(ours, theirs, strict=True))
    return f"{line}{_text(ours):>18}{len(data):7}{_text(theirs):>18}{ratios:>12}"


def _pair(write: Callable[[], Any], read: Callable[[], Any]) -> str:
    return f"{_text(_times(write, read)):>14}"


def _text(times: tuple[float, float]) -> str:
    return f"{times[0]:.1f} / {times[1]:.1f}"


def _times(write: Callable[[], Any], read: Callable[[], Any]) -> tuple[float, float]:
    return _best_us(write), _best_us(read)


def _best_us(call: Callable[[], Any]) -> float:
    best = float("inf")
    for _ in range(3):
        start = perf_counter()
        for _ in range(ROUNDS):
            call()
        best = min(best, (perf_counter() - start) / ROUNDS * 1e6)
    return best


if __name__ == "__main__":
    main()
