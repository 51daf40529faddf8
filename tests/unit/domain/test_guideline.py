"""The guideline is whole: every grade and every reason that can be given is explained."""

import numpy as np
import pytest

from app.domain.grading import GUIDELINE_VERSION, MATCH_REASONS, SHAPE_REASONS
from app.domain.guideline import GUIDELINES, current_guideline
from app.guideline.pictures import HEIGHT_PX, WIDTH_PX, pictures
from app.tables.reviews import Grade, MissedReason


def test_every_code_is_explained() -> None:
    """What the review can store stands in the present guideline, and nothing else does."""
    guide = current_guideline()
    assert guide.version == GUIDELINE_VERSION == max(GUIDELINES)
    assert [rule.code for rule in guide.grades] == list(Grade)
    assert tuple(rule.code for rule in guide.shape_reasons) == SHAPE_REASONS
    assert tuple(rule.code for rule in guide.match_reasons) == MATCH_REASONS
    assert [rule.code for rule in guide.missed_reasons] == list(MissedReason)


@pytest.mark.parametrize("grade", list(Grade))
def test_every_grade_has_examples_that_fit_their_frame(grade: Grade) -> None:
    """Each grade has two drawings, and ship and box lie within the picture."""
    drawings = pictures()[grade.value]
    assert len(drawings) == 2
    for drawing in drawings:
        outlines = [face.points for face in drawing.faces] + [drawing.bow]
        points = np.array([pair.split(",") for line in outlines for pair in line.split()], float)
        assert (points >= 0).all(), drawing.caption
        assert (points <= [WIDTH_PX, HEIGHT_PX]).all(), drawing.caption
