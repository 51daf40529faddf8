"""Keypoints from tables that people paste or export from a spreadsheet."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import Invalid
from app.registration.keypoint_csv import COLUMNS, parse_table, write_table

LINE = ("Crane", "812.5", "640", "53.541", "9.9801", "92.4")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("header", [(), COLUMNS])
def test_columns_come_in_the_usual_ways(separator: str, header: tuple[str, ...]) -> None:
    """Commas, semicolons and tabs, with and without a header, give the same keypoint."""
    lines = [separator.join(header)] if header else []
    (point,) = parse_table("\ufeff" + "\n".join([*lines, separator.join(LINE)]) + "\n\n")
    assert (point.name, point.u_px, point.v_px) == ("Crane", 812.5, 640.0)
    assert point.place(0.0) == (53.541, 9.9801, 92.4)
    assert point.role == "control"


def test_a_header_may_reorder_and_leave_out() -> None:
    """Columns follow the header; a known landmark needs no place."""
    (point,) = parse_table("v_px,u_px,role,name\n2,1,check,Church\n")
    assert (point.name, point.u_px, point.v_px, point.role) == ("Church", 1.0, 2.0, "check")
    assert point.place(0.0) is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("Crane,one,2,53,9,1", "line 1, u_px"),
        ("# a note\nCrane,1,2,53,9,1\nChurch,1,2,95,9,1", "line 3, lat_deg"),
        ("Crane,1,2,53,9,1,check,more", "8 columns"),
        ("name,u_px,v_px,colour\nCrane,1,2,red", "knows the columns"),
        ("Crane,1,2,53", "line 1: a landmark's place"),
        (",1,2,53,9,1", "needs the name"),
    ],
)
def test_a_wrong_line_is_named(text: str, says: str) -> None:
    """The error tells the line and the column."""
    with pytest.raises(Invalid, match=says) as caught:
        parse_table(text)
    assert [part.field for part in caught.value.fields] == ["table"]


@given(
    st.lists(
        st.fixed_dictionaries(
            {
                "name": st.text(
                    st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1
                ).filter(lambda name: len(name) <= 200 and not name.startswith("#")),
                "u_px": st.floats(-1e6, 1e6),
                "v_px": st.floats(-1e6, 1e6),
                "lat_deg": st.floats(-90, 90),
                "lon_deg": st.floats(-180, 180),
                "height_m": st.floats(-1e4, 1e4),
                "role": st.sampled_from(["control", "check", "off"]),
            }
        ),
        min_size=1,
        max_size=5,
    )
)
def test_what_is_written_is_read_again(points: list[dict[str, object]]) -> None:
    """A written table gives back every name and every number exactly."""
    read = parse_table(write_table(points))
    assert [point.model_dump(mode="json", include=set(COLUMNS)) for point in read] == points
