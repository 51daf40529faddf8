"""Parameters of runs as people write them: kept exactly, or refused by name."""

import json
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.db import json_text
from app.domain.fusion_settings import FusionSettings, MatchingMethod, Preset
from app.domain.vessel_state import TrackMethod
from app.errors import Invalid
from app.runs.parameters import as_json, fusion_settings
from app.runs.setting_words import MATCHINGS, SETTINGS, TRACK_METHODS, described, shown

NAMES = sorted({field.name for field in fields(FusionSettings)} - {"preset"})
ANYTHING = st.one_of(
    st.floats(),
    st.integers(),
    st.text(max_size=5),
    st.none(),
    st.booleans(),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


def answered(asked: dict[str, Any]) -> FusionSettings | Invalid:
    """Return the settings, or why there are none."""
    try:
        return fusion_settings("paper", asked)
    except Invalid as error:
        return error


@given(st.dictionaries(st.sampled_from([*NAMES, "speed", "preset", ""]), ANYTHING, max_size=4))
def test_whatever_is_asked_is_storable_or_refused_by_name(asked: dict[str, Any]) -> None:
    """Settings that are accepted survive JSON and make the same settings again."""
    answer = answered(asked)
    if isinstance(answer, Invalid):
        assert answer.fields
        for problem in answer.fields:
            name = problem.field.removeprefix("parameters.").partition(".")[0]
            assert name in asked
            assert problem.message
    else:
        stored = json.loads(json_text(as_json(answer)))
        assert fusion_settings(answer.preset.value, stored) == answer


def test_nothing_asked_is_the_presets_own() -> None:
    """Without overrides a run has the settings that reproduce the paper."""
    assert fusion_settings("paper", {}) == FusionSettings()
    assert set(as_json(FusionSettings())) == set(NAMES)


def test_an_unknown_preset_lists_those_there_are() -> None:
    """The answer to a wrong preset holds the right ones."""
    with pytest.raises(Invalid) as refused:
        fusion_settings("magic", {})
    assert [problem.field for problem in refused.value.fields] == ["preset"]
    assert all(preset in refused.value.detail for preset in Preset)


def test_every_setting_has_words() -> None:
    """Pages and documents name all settings a run has, none by its name in the code."""
    assert set(SETTINGS) == set(NAMES)
    assert set(MATCHINGS) == set(MatchingMethod)
    assert set(TRACK_METHODS) == set(TrackMethod)
    told = shown(json.loads(json_text(as_json(FusionSettings()))))
    assert not any("_" in setting.label + setting.value for setting in told)
    assert all(f"`{name}`" in described() for name in NAMES)


def test_settings_of_other_versions_are_shown_by_their_names() -> None:
    """A run made by another version shows what this one does not know."""
    assert shown({"tide_offset_m": 1.5})[0][:2] == ("Tide offset m", "1.5")
