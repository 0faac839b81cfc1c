"""Pages join without a gap or a repeat, whatever is added meanwhile; bad cursors are told."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.requests import Request

from scm.api.paging import cursor_at, page_of, page_response
from scm.api.problem import RefusedError


def same(row):
    return row


@given(st.lists(st.text("ab\n:", max_size=3), max_size=30), st.integers(1, 7))
def test_pages_joined_are_the_whole_list_though_rows_may_be_alike(rows, limit):
    found, cursor = [], ""
    while True:
        page = page_of(rows, same, limit=limit, cursor=cursor)
        assert len(page.items) <= limit
        found += page.items
        assert len(found) <= len(rows)
        if page.next is None:
            break
        cursor = page.next
    assert found == rows


def test_rows_added_before_the_cursor_do_not_move_the_next_page():
    first = page_of(["c", "b", "a"], same, limit=2)
    second = page_of(["e", "d", "c", "b", "a"], same, limit=2, cursor=first.next)
    assert (first.items, second.items, second.next) == (("c", "b"), ("a",), None)


def test_a_full_last_page_ends_the_list():
    assert page_of(["a", "b"], same, limit=2).next is None


def test_a_cursor_holds_although_its_row_is_not_wanted_any_more():
    first = page_of(["c", "b", "a"], same, limit=2)
    second = page_of(["c", "b", "a"], same, keep=lambda row: row != "b", cursor=first.next)
    assert (first.items, second.items) == (("c", "b"), ("a",))


@pytest.mark.parametrize("cursor", ["!", "a", "aGVsbG8", "\u00e9", cursor_at("x")[:-3]])
def test_a_cursor_that_is_none_of_ours_is_refused(cursor):
    with pytest.raises(RefusedError, match="expected `next` of the page before") as refused:
        page_of(["a"], same, cursor=cursor)
    assert refused.value.refused.code == "invalid"


def test_a_cursor_whose_row_is_gone_says_so():
    with pytest.raises(RefusedError, match="its row is gone: begin again"):
        page_of(["a"], same, cursor=cursor_at("z"))


def test_the_next_page_is_named_in_link_with_the_query_kept():
    scope = {"type": "http", "path": "/api/v1/x", "query_string": b"limit=1&q=a%20b", "headers": []}
    rows = ["a", "b"]
    page = page_of(rows, same, limit=1)
    answer = page_response(Request({**scope, "method": "GET"}), page)
    assert json.loads(answer.body) == {"items": ["a"], "next": page.next}
    link = f'</api/v1/x?limit=1&q=a+b&cursor={page.next}>; rel="next"'
    assert answer.headers["link"] == link
    last = page_response(Request({**scope, "method": "GET"}), page_of(rows, same))
    assert "link" not in last.headers
