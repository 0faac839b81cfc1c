"""The fleet file, its secrets and the commands that write them."""

import stat
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from scm.__main__ import main
from scm.errors import AccessError
from scm.v2x.access import access_control, credentials_of
from scm.v2x.certificates import expiry_of
from scm.v2x.credentials import read_credentials
from scm.v2x.fleet_file import Fleet, add, load_fleet, name_hosts, remove
from scm.v2x.rights import rights_of

NOW = datetime(2030, 1, 1, tzinfo=UTC)


@pytest.fixture(params=["password", "mtls"])
def fleet(request, tmp_path):
    return Fleet(tmp_path / "fleet.toml", request.param)


def test_what_was_written_is_read_again(fleet):
    add(fleet, "n1", "vehicle", NOW)
    add(fleet, "world", "part", NOW)
    add(fleet, "n2", "vehicle", NOW)
    remove(fleet, "n2")
    assert load_fleet(fleet.path) == fleet


def test_the_file_itself_holds_no_secret(fleet):
    made = add(fleet, "n1", "vehicle", NOW)
    text = fleet.path.read_text()
    assert (made.password or made.private_key) not in text
    assert "PRIVATE" not in text


def test_every_secret_can_be_read_by_its_owner_alone(fleet):
    add(fleet, "n1", "vehicle", NOW)
    files = list(fleet.folder.iterdir())
    assert len(files) >= 2
    assert {stat.S_IMODE(path.stat().st_mode) for path in files} == {0o600}
    assert stat.S_IMODE(fleet.folder.stat().st_mode) == 0o700


def test_credentials_that_others_can_read_are_refused(fleet):
    add(fleet, "n1", "vehicle", NOW)
    path = fleet.credentials("n1")
    assert read_credentials(path, "n1").station == "n1"
    path.chmod(0o640)
    with pytest.raises(AccessError, match="chmod 600"):
        read_credentials(path)


def test_credentials_of_another_station_are_refused(fleet):
    add(fleet, "n1", "vehicle", NOW)
    with pytest.raises(AccessError, match="they are of 'n1', expected 'n2'"):
        read_credentials(fleet.credentials("n1"), "n2")


@pytest.mark.parametrize(
    "text",
    [
        "", "[", 'station = "n1"\nrole = "vehicle"', 'station = "n1"\nuser = "n1.1"\npassword = 5',
        'station = "n1"\nuser = "n1.1"\npassword = "x"\ncolour = "red"',
        'user = "a"\npassword = "b"',
    ],
)  # fmt: skip
def test_a_credentials_file_that_is_not_complete_is_refused(tmp_path, text):
    path = tmp_path / "n1.toml"
    path.touch(0o600)
    path.write_text(text)
    with pytest.raises(AccessError, match="expected"):
        read_credentials(path)


def test_new_credentials_end_the_old_ones(fleet):
    old = add(fleet, "n1", "vehicle", NOW)
    new = add(fleet, "n1", "vehicle", NOW)
    known = str(access_control(fleet, "city")["subjects"])
    assert "n1.2" in known
    assert "n1.1" not in known
    if old.password:
        assert old.password != new.password
        assert fleet.users.read_text() == f"n1.2:{new.password}\n"


def test_a_name_that_comes_back_is_not_let_in_with_what_it_had(fleet):
    add(fleet, "n1", "vehicle", NOW)
    remove(fleet, "n1")
    assert access_control(fleet, "city")["subjects"] == []
    assert not fleet.credentials("n1").exists()
    again = load_fleet(fleet.path)
    add(again, "n1", "vehicle", NOW)
    assert again.members["n1"].identity == "n1.2"


def test_the_city_s_own_stations_are_added_once(fleet):
    first = credentials_of(fleet, {"world": "part", "n5": "vehicle"}, NOW)
    before = {name: path.read_text() for name, path in first.items()}
    again = credentials_of(load_fleet(fleet.path), {"world": "part", "n5": "vehicle"}, NOW)
    assert {name: path.read_text() for name, path in again.items()} == before


@pytest.mark.parametrize("name", ["world", "eye-north", "rsu-x1", "up"])
def test_a_car_cannot_take_the_name_of_a_part(fleet, name):
    with pytest.raises(AccessError, match="a name of the city's own"):
        add(fleet, name, "vehicle", NOW)


def test_an_unknown_role_or_part_is_refused_with_the_valid_names():
    with pytest.raises(AccessError, match=r"did you mean 'vehicle'"):
        rights_of("vehicel", "n1")
    with pytest.raises(AccessError, match=r"did you mean 'traffic'"):
        rights_of("part", "trafic")


@pytest.mark.parametrize(
    "text",
    [
        "auth = 'none'", "auth = 'mtls'\n[stations.n1]\nrole = 'vehicle'",
        "auth = 'mtls'\n[stations.n1]\nrole = 'king'\nissued = 1",
        "auth = 'mtls'\n[stations.'n 1']\nrole = 'vehicle'\nissued = 1", "auth",
        "auth = 'mtls'\nstations = 3",
    ],
)  # fmt: skip
def test_a_fleet_file_that_makes_no_sense_is_refused(tmp_path, text):
    path = tmp_path / "fleet.toml"
    path.write_text(text)
    with pytest.raises(AccessError, match=str(path)):
        load_fleet(path)


class TestCertificates:
    @pytest.fixture
    def made(self, tmp_path):
        fleet = Fleet(tmp_path / "fleet.toml", "mtls")
        return fleet, add(fleet, "n1", "vehicle", NOW)

    def test_a_station_s_is_its_own_and_no_router_s(self, made):
        _, credentials = made
        found = x509.load_pem_x509_certificate(credentials.certificate.encode())
        (name,) = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        purposes = found.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        basic = found.extensions.get_extension_for_class(x509.BasicConstraints).value
        assert name.value == "n1.1"
        assert list(purposes) == [ExtendedKeyUsageOID.CLIENT_AUTH]
        assert not basic.ca
        assert isinstance(found.public_key().curve, ec.SECP256R1)

    def test_it_comes_from_the_authority_and_ends_after_a_year(self, made):
        _, credentials = made
        found = x509.load_pem_x509_certificate(credentials.certificate.encode())
        found.verify_directly_issued_by(
            x509.load_pem_x509_certificate(credentials.authority.encode())
        )
        assert expiry_of(credentials.certificate) == NOW + timedelta(days=365)

    def test_no_two_have_the_same_serial_number(self, made):
        fleet, first = made
        second = add(fleet, "n2", "vehicle", NOW)
        numbers = {
            x509.load_pem_x509_certificate(one.certificate.encode()).serial_number
            for one in (first, second)
        }
        assert len(numbers) == 2

    def test_the_router_s_names_every_address(self, made):
        fleet, _ = made
        name_hosts(fleet, ["192.168.1.5", "city.example"], NOW)
        text = fleet.pem("router.crt").read_bytes()
        names = (
            x509.load_pem_x509_certificate(text)
            .extensions.get_extension_for_class(x509.SubjectAlternativeName)
            .value
        )
        found = {str(name.value) for name in names}
        assert found == {"127.0.0.1", "::1", "localhost", "192.168.1.5", "city.example"}
        assert "192.168.1.5" in load_fleet(fleet.path).hosts

    @pytest.mark.parametrize(("days", "renewed"), [(300, False), (340, True)])
    def test_what_ends_soon_is_renewed_for_the_city_s_own(self, made, days, renewed):
        fleet, _ = made
        before = self.at(fleet, NOW)
        after = self.at(fleet, NOW + timedelta(days=days))
        assert [old != new for old, new in zip(before, after, strict=True)] == [renewed] * 2

    @staticmethod
    def at(fleet, now):
        files = credentials_of(fleet, {"world": "part"}, now)
        return files["world"].read_text(), fleet.pem("router.crt").read_text()


class TestCommands:
    def test_a_password_is_in_its_file_and_on_no_screen(self, tmp_path, capsys):
        fleet = str(tmp_path / "fleet.toml")
        assert main(["fleet", "add", "n7", "--role", "vehicle", "--fleet", fleet]) == 0
        said = capsys.readouterr().out
        password = read_credentials(tmp_path / "fleet.secrets/n7.toml").password
        assert password not in said
        assert len(password) >= 40
        assert main(["fleet", "list", "--fleet", fleet]) == 0
        listed = capsys.readouterr().out
        assert "n7" in listed
        assert password not in listed

    def test_the_other_kind_of_fleet_is_refused(self, tmp_path, capsys):
        fleet = str(tmp_path / "fleet.toml")
        assert main(["fleet", "add", "n7", "--role", "vehicle", "--mtls", "--fleet", fleet]) == 0
        assert "password" not in capsys.readouterr().out
        again = ["fleet", "add", "n8", "--role", "vehicle", "--password", "--fleet", fleet]
        assert main(again) == 2
        assert "use mtls, not password" in capsys.readouterr().err

    def test_who_is_removed_is_listed_no_more(self, tmp_path, capsys):
        fleet = str(tmp_path / "fleet.toml")
        main(["fleet", "add", "n7", "--role", "vehicle", "--fleet", fleet])
        assert main(["fleet", "remove", "n7", "--fleet", fleet]) == 0
        capsys.readouterr()
        main(["fleet", "list", "--fleet", fleet])
        assert "n7" not in capsys.readouterr().out
        assert main(["fleet", "remove", "n7", "--fleet", fleet]) == 2

    def test_an_api_key_is_made_listed_and_ended(self, tmp_path, capsys):
        store = f"sqlite:{tmp_path / 'keys.db'}"
        assert main(["key", "add", "anna", "--role", "operator", "--keys", store]) == 0
        key = capsys.readouterr().out.split()[-1]
        main(["key", "list", "--keys", store])
        listed = capsys.readouterr().out
        key_id, secret = key.split("_", 2)[1:]
        assert (key_id in listed, secret in listed, "anna" in listed) == (True, False, True)
        assert main(["key", "revoke", key_id, "--keys", store]) == 0
        capsys.readouterr()
        main(["key", "list", "--keys", store])
        assert capsys.readouterr().out.startswith("0 keys")


@pytest.mark.parametrize("host", ['a"b', "", "a b", "x\ny", "../x"])
def test_what_is_no_host_reaches_no_file(tmp_path, host):
    path = tmp_path / "fleet.toml"
    words = ["fleet", "add", "n7", "--role", "vehicle", "--fleet", str(path), "--host", host]
    assert main(words) == 2
    assert list(tmp_path.iterdir()) == []
