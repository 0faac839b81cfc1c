"""The interface describes itself wholly: whoever reads openapi.json needs nothing else."""

import pytest

from scm.api.app import create_app
from scm.api.openapi import described
from scm.api.view import CityView
from scm.errors import RunError
from scm.maps.load import load_map

SUCCESS = ("200", "201", "202", "204", "206")
REFERENCE = "#/components/schemas/"


def application():
    return create_app(CityView(), lambda _request, _timeout_s: None, load_map("driving_school"))


def described_anew():
    return application().openapi()


@pytest.fixture(scope="module")
def document():
    return described_anew()


def operations_of(document):
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield f"{method.upper()} {path}", operation


def fields_of(document):
    for record, schema in document["components"]["schemas"].items():
        for name, field in schema.get("properties", {}).items():
            yield f"{record}.{name}", field


CHANGES = ("POST", "PUT", "PATCH", "DELETE")
WITHOUT_KEY = {
    "PUT /api/v1/session": "sets the caller's cookie, the same each time",
    "DELETE /api/v1/session": "forgets the caller's cookie, each time",
}


def said(problems):
    return "\n".join(["", *sorted(problems)])


def test_every_operation_says_what_it_does_and_whose_noun_it_is(document):
    wrong = [
        where
        for where, operation in operations_of(document)
        if not (operation.get("summary") and len(operation.get("tags", ())) == 1)
    ]
    assert not wrong, said(wrong)


def test_the_audit_log_says_every_change_in_words(document):
    words = application().state.words
    changes = [item for item in operations_of(document) if item[0].startswith(CHANGES)]
    assert len(changes) > 40
    for where, operation in changes:
        summary = operation["summary"]
        assert words.of(where, {}).startswith(summary[0].lower() + summary[1:]), where


def test_it_does_not_name_the_map_to_who_has_no_key(document):
    assert document["info"]["title"] == "Smart City Manager"


def test_every_application_of_a_process_describes_itself_alike(document):
    assert described_anew() == document


def test_every_operation_has_an_answer_with_a_schema(document):
    """`responses=answer(Record)` and the like of scm.api.schemas; 204 has no content."""
    wrong = []
    for where, operation in operations_of(document):
        if "204" in operation["responses"]:
            if operation["responses"]["204"].get("content") or "200" in operation["responses"]:
                wrong.append(where)
            continue
        told = [operation["responses"][code] for code in SUCCESS if code in operation["responses"]]
        schemas = [media.get("schema") for one in told for media in one.get("content", {}).values()]
        if not schemas or not all(schemas):
            wrong.append(where)
    assert not wrong, said(wrong)


def test_every_change_takes_an_idempotency_key_or_needs_none(document):
    without = {
        where
        for where, operation in operations_of(document)
        if where.startswith(CHANGES)
        and not any(one["name"] == "Idempotency-Key" for one in operation.get("parameters", ()))
    }
    assert without == set(WITHOUT_KEY), said(without ^ set(WITHOUT_KEY))


def test_every_operation_names_the_role_that_its_key_needs(document):
    scheme = document["components"]["securitySchemes"]["key"]
    assert (scheme["type"], scheme["scheme"]) == ("http", "bearer")
    needs = {where: one.get("security") for where, one in operations_of(document)}
    assert {where for where, need in needs.items() if not need} == {"GET /healthz", "GET /readyz"}
    for where, role in (
        ("GET /api/v1/vehicles", "viewer"),
        ("PUT /api/v1/stop", "operator"),
        ("GET /api/v1/audit", "engineer"),
        ("PUT /api/v1/scenarios/{name}", "admin"),
    ):
        assert needs[where] == [{"key": [role]}], where


def test_every_list_bounds_its_page(document):
    wrong = [
        where
        for where, operation in operations_of(document)
        for one in operation.get("parameters", ())
        if one["name"] == "limit"
        and not (one["schema"].get("minimum", 0) >= 0 and one["schema"].get("maximum", 0) > 0)
    ]
    assert not wrong, said(wrong)


def test_every_operation_may_answer_a_problem(document):
    for where, operation in operations_of(document):
        told = operation["responses"]["404"]["content"]["application/problem+json"]["schema"]
        assert told == {"$ref": REFERENCE + "Problem"}, where


def test_every_parameter_has_words_and_an_example(document):
    wrong = [
        f"{where} {parameter['name']}: {lacks}"
        for where, operation in operations_of(document)
        for parameter in operation.get("parameters", ())
        for lacks in ("description", "examples")
        if not (parameter.get(lacks) or parameter["schema"].get(lacks))
    ]
    assert not wrong, said(wrong)


def test_every_field_has_words(document):
    """In the `Meta` of its type (scm.records.fields), or below `Attributes:` of its record."""
    wrong = [where for where, field in fields_of(document) if not field.get("description")]
    assert not wrong, said(wrong)


def test_every_field_has_an_example_of_its_type(document):
    wrong = [where for where, field in fields_of(document) if "examples" not in field]
    assert not wrong, said(wrong)


def test_every_reference_finds_its_record(document):
    def references(node):
        if isinstance(node, dict):
            if "$ref" in node:
                yield node["$ref"]
            for child in node.values():
                yield from references(child)
        elif isinstance(node, list):
            for child in node:
                yield from references(child)

    known = {REFERENCE + name for name in document["components"]["schemas"]}
    assert set(references(document)) <= known
    assert "$defs" not in str(document)


def test_examples_hold_by_their_own_schema(document):
    jsonschema = pytest.importorskip("jsonschema_rs")
    wrong = []
    for where, field in fields_of(document):
        refers = "$ref" in str(field)
        schema = {**field, "components": document["components"]} if refers else field
        validator = jsonschema.validator_for(schema)
        for example in field.get("examples", ()):
            wrong += [f"{where}: {fault.message}" for fault in validator.iter_errors(example)]
    assert not wrong, said(wrong)


def test_two_records_of_one_name_are_refused():
    document = {"paths": {}, "a": {"$defs": {"X": {"type": "string"}}}, "b": {"$defs": {"X": {}}}}
    with pytest.raises(RunError, match="two records are named 'X'"):
        described(document)
