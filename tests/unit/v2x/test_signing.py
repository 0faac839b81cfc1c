"""Signed messages: real bytes of IEEE 1609.2, and nothing forged gets past the verifier."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scm.clock import NS_PER_S
from scm.errors import AccessError, MessageError
from scm.v2x.signed_data import read_certificate, read_message
from scm.v2x.signing import (
    CAM,
    DENM,
    MAX_AGE_NS,
    Signer,
    Verifier,
    digest_of,
    issue,
    make_authority,
)

NOW = 1_900_000_000 * NS_PER_S
PAYLOAD = bytes(range(41))
AUTHORITY = make_authority("test city", NOW)
TICKET = issue(AUTHORITY, "n1", NOW)


@pytest.fixture
def signer():
    return Signer(TICKET)


@pytest.fixture
def verifier():
    return Verifier(AUTHORITY.certificate)


@pytest.fixture(scope="module")
def standard():
    """The whole standard, by other people."""
    module = pytest.importorskip("pycrate_asn1dir.ITS_IEEE1609_2", reason="needs scm[v2x]")
    return module.Ieee1609Dot2


@pytest.mark.parametrize("ticket", [AUTHORITY, TICKET], ids=["authority", "station"])
def test_a_certificate_equals_the_standards_encoding(standard, ticket):
    standard.Certificate.from_coer(ticket.certificate)
    values = standard.Certificate.get_val()
    assert standard.Certificate.to_coer() == ticket.certificate
    assert values["toBeSigned"]["id"] == ("name", "n1" if ticket is TICKET else "test city")
    permissions = values["toBeSigned"].get("appPermissions", [])
    assert [one["psid"] for one in permissions] == ([CAM, DENM] if ticket is TICKET else [])


@pytest.mark.parametrize("place", [None, (-1, 1_800_000_001, 4096)])
@pytest.mark.parametrize("size", [0, 41, 127, 128, 300, 70_000])
def test_a_message_equals_the_standards_encoding(standard, signer, place, size):
    for _ in range(2):  # with its certificate, then with its digest
        data = signer.sign(bytes(size), DENM, NOW, place)
        kind = standard.Ieee1609Dot2Data
        kind.from_coer(data)
        name, values = kind.get_val()["content"]
        assert kind.to_coer() == data
        header = values["tbsData"]["headerInfo"]
        assert (name, header["psid"]) == ("signedData", DENM)
        assert header["generationTime"] == (1_900_000_000 - 1_072_915_200 + 5) * 1_000_000
        said = values["tbsData"]["payload"]["data"]["content"]
        assert said == ("unsecuredData", bytes(size))
        assert ("generationLocation" in header) == (place is not None)
        standard.ToBeSignedData.set_val(values["tbsData"])
        assert standard.ToBeSignedData.to_coer() == read_message(data).to_be_signed


def test_what_was_signed_is_verified(signer, verifier):
    for at_ns in (NOW, NOW + 1000):
        found = verifier.verify(signer.sign(PAYLOAD, CAM, at_ns), at_ns)
        assert found == (PAYLOAD, CAM, "n1", at_ns)


def test_the_certificate_comes_once_a_second_and_its_digest_otherwise(signer):
    whole = [
        read_message(signer.sign(PAYLOAD, CAM, NOW + i * NS_PER_S // 10)).certificate is not None
        for i in range(31)
    ]
    assert [i for i, comes in enumerate(whole) if comes] == [0, 10, 20, 30]
    assert read_message(signer.sign(PAYLOAD, CAM, NOW + 4 * NS_PER_S - 10**8 * 9)).digest == (
        digest_of(TICKET.certificate)
    )


def test_who_missed_the_certificate_waits_for_the_next(signer, verifier):
    first, second = (signer.sign(PAYLOAD, CAM, NOW) for _ in range(2))
    with pytest.raises(AccessError, match="has not come yet"):
        verifier.verify(second, NOW)
    verifier.verify(first, NOW)
    assert verifier.verify(second, NOW).station == "n1"


@pytest.mark.parametrize("shown", [True, False], ids=["certificate", "digest"])
def test_no_bit_can_be_changed(signer, verifier, shown):
    first = signer.sign(PAYLOAD, CAM, NOW)
    verifier.verify(first, NOW)
    data = first if shown else signer.sign(PAYLOAD, CAM, NOW)
    for i in range(len(data)):
        for bit in (0x01, 0x80):
            forged = data[:i] + bytes([data[i] ^ bit]) + data[i + 1 :]
            with pytest.raises((AccessError, MessageError)):
                verifier.verify(forged, NOW)


def test_nothing_may_stand_behind_or_be_missing(signer, verifier):
    data = signer.sign(PAYLOAD, CAM, NOW)
    for wrong in (data + b"\0", data[:-1], b""):
        with pytest.raises(MessageError, match="signed data"):
            verifier.verify(wrong, NOW)


def test_another_authority_s_stations_are_strangers(verifier):
    other = make_authority("test city", NOW)
    data = Signer(issue(other, "n1", NOW)).sign(PAYLOAD, CAM, NOW)
    with pytest.raises(AccessError, match="not of our authority"):
        verifier.verify(data, NOW)


def test_a_station_cannot_issue_for_another(verifier):
    data = Signer(issue(TICKET, "n2", NOW)).sign(PAYLOAD, CAM, NOW)
    with pytest.raises(AccessError, match="not of our authority"):
        verifier.verify(data, NOW)
    posing = issue(AUTHORITY._replace(key=TICKET.key), "n2", NOW)
    with pytest.raises(AccessError, match="not the signer's"):
        verifier.verify(Signer(posing).sign(PAYLOAD, CAM, NOW), NOW)


def test_a_stolen_digest_is_not_a_key(signer, verifier):
    verifier.verify(signer.sign(PAYLOAD, CAM, NOW), NOW)
    other = issue(AUTHORITY, "n2", NOW)
    thief = Signer(TICKET._replace(key=other.key))
    thief.sign(PAYLOAD, CAM, NOW)
    with pytest.raises(AccessError, match="not the signer's"):
        verifier.verify(thief.sign(PAYLOAD, CAM, NOW), NOW)


def test_a_station_signs_only_what_its_ticket_names(verifier):
    ticket = issue(AUTHORITY, "n1", NOW, psids=(CAM,))
    with pytest.raises(AccessError, match=r"may sign \(36,\), not 37"):
        verifier.verify(Signer(ticket).sign(PAYLOAD, DENM, NOW), NOW)


@pytest.mark.parametrize(("after_s", "good"), [(-1, False), (0, True), (3600, True), (3602, False)])
def test_a_ticket_is_good_for_its_time(verifier, after_s, good):
    ticket, at_ns = issue(AUTHORITY, "n1", NOW, hours=1), NOW + after_s * NS_PER_S
    data = Signer(ticket).sign(PAYLOAD, CAM, at_ns)
    if good:
        assert verifier.verify(data, at_ns).station == "n1"
        return
    with pytest.raises(AccessError, match="was not good when this was signed"):
        verifier.verify(data, at_ns)


@pytest.mark.parametrize("late_ns", [MAX_AGE_NS + 1000, -NS_PER_S])
def test_what_is_old_or_of_the_future_is_refused(signer, verifier, late_ns):
    with pytest.raises(AccessError, match="s old"):
        verifier.verify(signer.sign(PAYLOAD, CAM, NOW), NOW + late_ns)


def test_an_authority_that_did_not_sign_itself_is_refused():
    other = make_authority("test city", NOW)
    found = read_certificate(AUTHORITY.certificate)
    forged = found.content.signed(read_certificate(other.certificate).signature)
    with pytest.raises(AccessError, match="not the signer's"):
        Verifier(forged)


@settings(max_examples=300)
@given(st.binary(max_size=400), st.integers(0, 60))
def test_noise_is_refused_in_words(noise, kept):
    data = Signer(TICKET).sign(PAYLOAD, CAM, NOW)[:kept] + noise
    with pytest.raises((AccessError, MessageError)):
        Verifier(AUTHORITY.certificate).verify(data, NOW)
